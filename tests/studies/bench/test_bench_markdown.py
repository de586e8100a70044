import pytest
from projects import ROOT

from softslip.errors import DatasetError
from softslip.files.publication import blocks_in
from softslip.files.storage import read_dataset
from softslip.studies.bench.bench_markdown import BENCH, KINDS, bench_blocks, schemes_table

PUBLISHED = ROOT / BENCH.folder


def test_the_document_has_the_tables_of_what_is_published():
    document = (ROOT / BENCH.document).read_text(encoding="utf-8")
    assert blocks_in(document) == bench_blocks(PUBLISHED)


def test_a_ratio_is_that_of_the_two_costs_above_it():
    sizes = [
        {kind: read_dataset(PUBLISHED / f"{kind}_{count}.nc", stage="bench") for kind in KINDS}
        for count in (100, 800)
    ]
    table = schemes_table(sizes)
    rows = [line.strip("| ").split(" | ") for line in table.splitlines()]
    assert rows[0] == ["What", "100 particles", "800 particles"]
    paper, level, ratio = ([float(cell) for cell in row[1:]] for row in rows[2:5])
    assert ratio == pytest.approx([a / b for a, b in zip(paper, level, strict=True)], rel=1e-2)


def test_benchmarks_that_are_missing_are_named(tmp_path):
    with pytest.raises(DatasetError, match=r"run_100\.nc"):
        bench_blocks(tmp_path)
