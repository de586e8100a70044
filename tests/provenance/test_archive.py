from softslip.provenance.archive import Archive


def test_a_report_of_snakemake_is_no_result(tmp_path):
    for name in ("explorer.html", "report.html"):
        (tmp_path / name).write_text("<html></html>")
    assert [path.name for path in Archive(tmp_path).files] == ["explorer.html"]
