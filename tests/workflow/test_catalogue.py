"""What the Snakemake workflow catalogue asks of a workflow in its standardised usage."""

from projects import ROOT
from ruamel.yaml import YAML


def test_the_files_that_the_catalogue_looks_for_are_there() -> None:
    for name in ("workflow/Snakefile", "config/README.md", "config/config.yaml", "LICENSE"):
        assert (ROOT / name).is_file(), name
    readme = (ROOT / "README.md").read_text("utf-8").lower()
    assert "snakemake" in readme
    assert "workflow" in readme
    assert list((ROOT / "workflow" / "rules").glob("*.smk"))


def test_the_catalogue_is_told_how_the_workflow_is_used() -> None:
    told = YAML(typ="safe", pure=True).load(ROOT / ".snakemake-workflow-catalog.yml")
    assert told.keys() == {"usage"}
    usage = told["usage"]
    assert usage.keys() == {"mandatory-flags", "software-stack-deployment", "report"}
    assert usage["mandatory-flags"].keys() == {"desc", "flags"}
    assert all(isinstance(each, bool) for each in usage["software-stack-deployment"].values())
    assert usage["report"] is True
