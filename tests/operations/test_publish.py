"""What is published of a scenario is a copy of its results, and its document says what they say."""

import hashlib
from pathlib import Path

import pytest
from small_results import NAME, call, results, source

from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.files.products import DATASETS
from softslip.files.publication import blocks_in
from softslip.files.storage import read_dataset
from softslip.operations.publish import (
    DOCUMENT,
    PUBLISHED,
    README,
    RESEARCH_OBJECT,
    publication_of,
)
from softslip.provenance.archive import FOUND, MISSING
from softslip.provenance.crate import METADATA
from softslip.provenance.tracing.targets import Target
from softslip.provenance.tracing.walk import trace
from softslip.provenance.verification import verify

__all__ = ["results"]

ROOT = Path(__file__).parents[2]

SCENARIOS = sorted(path.parent.name for path in (ROOT / PUBLISHED).glob("*/flow_curve.nc"))
"""Scenarios with published results."""

WITH_RUNS = [name for name in SCENARIOS if (ROOT / PUBLISHED / name / "shear").is_dir()]
"""Those whose runs are published too."""

PARTS = tuple(f"{NAME}_{part}" for part in ("scope", "comparison", "laws", "effort"))


@pytest.fixture
def project(results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with a document that has a place for each part."""
    document = tmp_path / DOCUMENT
    document.parent.mkdir()
    marks = (f"<!-- begin {part}: generated -->\n\n<!-- end {part} -->" for part in PARTS)
    document.write_text("# Results\n\n" + "\n\n".join(marks) + "\n")
    # A research object has the workflow too.
    (tmp_path / "workflow").symlink_to(ROOT / "workflow")
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


def test_the_research_object_is_that_of_the_same_results(project, results):
    given = [source(results), "--results", results]
    assert not call(["publish", *given])
    told = blocks_in((project / DOCUMENT).read_text())[f"{NAME}_scope"]
    metadata = (project / PUBLISHED / NAME / RESEARCH_OBJECT).read_bytes()
    assert not call(["crate", *given, "--partial", "--output", project / "packed"])
    assert (project / "packed" / METADATA).read_bytes() == metadata
    assert hashlib.sha256(metadata).hexdigest() in told


def test_runs_are_copied_where_that_is_asked_for(project, results):
    assert not call(["publish", source(results), "--results", results, "--runs"])
    for stage in STAGES:
        copies = {path.name for path in (project / PUBLISHED / NAME / stage).iterdir()}
        assert copies == {path.name for path in (results / stage).glob("*.nc")}
    found = verify(load_scenario(source(results)), project / PUBLISHED / NAME)
    assert not [each for verdict in found.verdicts for each in verdict.problems]


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
def test_documents_say_what_the_published_datasets_say(name):
    scenario = load_scenario(str(ROOT / "config" / f"{name}.yaml"))
    said, in_short = (blocks_in((ROOT / each).read_text("utf-8")) for each in (DOCUMENT, README))
    for part, text in publication_of(scenario).blocks(ROOT / PUBLISHED / name).items():
        assert said[part] == text.strip(), part
        assert in_short.get(part, text.strip()) == text.strip(), part


@pytest.mark.parametrize("name", SCENARIOS)
def test_published_results_are_sound_and_traced_as_far_as_they_go(name):
    scenario, folder = load_scenario(str(ROOT / "config" / f"{name}.yaml")), ROOT / PUBLISHED / name
    found = verify(scenario, folder)
    assert not [each for verdict in found.verdicts for each in verdict.problems]
    assert not [verdict.name for verdict in found.verdicts if verdict.foreign]
    walked = trace(Target(folder / "figures" / "fig5.png"))
    there = {node.stage for node in walked.nodes if node.state == FOUND}
    assert there >= {"fits", "flow_curve", "figure"}
    if name in WITH_RUNS:
        assert there > set(STAGES)
    else:
        assert {node.stage for node in walked.nodes if node.state == MISSING} == {"shear"}
