"""What is published of a scenario is a copy of its results, and its document says what they say."""

from pathlib import Path

import pytest
from small_results import NAME, call, results, source

from softslip.config.scenario import load_scenario
from softslip.files.products import DATASETS
from softslip.files.publication import blocks_in
from softslip.files.storage import read_dataset
from softslip.operations.publish import DOCUMENT, PUBLISHED, publication_of
from softslip.provenance.archive import FOUND, MISSING
from softslip.provenance.tracing.targets import Target
from softslip.provenance.tracing.walk import trace
from softslip.provenance.verification import verify

__all__ = ["results"]

ROOT = Path(__file__).parents[2]

SCENARIOS = sorted(path.parent.name for path in (ROOT / PUBLISHED).glob("*/flow_curve.nc"))
"""Scenarios with published results."""

PARTS = tuple(f"{NAME}_{part}" for part in ("scope", "comparison", "laws", "effort"))


@pytest.fixture
def project(results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with a document that has a place for each part."""
    document = tmp_path / DOCUMENT
    document.parent.mkdir()
    marks = (f"<!-- begin {part}: generated -->\n\n<!-- end {part} -->" for part in PARTS)
    document.write_text("# Results\n\n" + "\n\n".join(marks) + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_results_are_copied_and_told(project, results):
    assert not call(["publish", source(results), "--results", results])
    folder = project / PUBLISHED / NAME
    for name in (*DATASETS, "effort"):
        copy = folder / f"{name}.nc"
        assert copy.read_bytes() == (results / f"{name}.nc").read_bytes()
        read_dataset(copy, stage=name, run=NAME)
    assert {path.name for path in folder.glob("figures/*")} == {
        path.name for path in results.glob("figures/*.*")
    }
    told = blocks_in((project / DOCUMENT).read_text())
    assert set(told) == set(PARTS)
    assert "2 of 2 runs done" in told[f"{NAME}_scope"]
    assert "`rheometer.stress` | 0.2, 0.4" in told[f"{NAME}_scope"]
    assert told[f"{NAME}_effort"].count("\n| shear | 2 | 2 |") == 1
    assert "| flow law, each roughness |" in told[f"{NAME}_laws"]
    assert "0.055 ± 0.004" in told[f"{NAME}_comparison"]


def test_publishing_again_changes_no_word(project, results):
    assert not call(["publish", source(results), "--results", results])
    once = (project / DOCUMENT).read_text()
    assert not call(["publish", source(results), "--results", results])
    assert (project / DOCUMENT).read_text() == once


def test_what_is_not_finished_is_not_published(project, results):
    (results / "comparison.nc").unlink()
    said = call(["publish", source(results), "--results", results])
    assert said
    assert not (project / PUBLISHED).exists()


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_document_says_what_the_published_datasets_say(name):
    scenario = load_scenario(str(ROOT / "config" / f"{name}.yaml"))
    said = blocks_in((ROOT / DOCUMENT).read_text("utf-8"))
    for part, text in publication_of(scenario).blocks(ROOT / PUBLISHED / name).items():
        assert said[part] == text.strip(), part


@pytest.mark.parametrize("name", SCENARIOS)
def test_published_results_are_sound_and_traced_without_their_runs(name):
    scenario, folder = load_scenario(str(ROOT / "config" / f"{name}.yaml")), ROOT / PUBLISHED / name
    found = verify(scenario, folder)
    assert not [each for verdict in found.verdicts for each in verdict.problems]
    assert not [verdict.name for verdict in found.verdicts if verdict.foreign]
    walked = trace(Target(folder / "figures" / "fig5.png"))
    there = {node.stage for node in walked.nodes if node.state == FOUND}
    assert there == {"fits", "flow_curve", "figure"}
    assert {node.stage for node in walked.nodes if node.state == MISSING} == {"shear"}
