"""`softslip explorer`, and what the other commands make of its page."""

import json
from pathlib import Path

import pytest
import small_results
from explorer_synthetic import data_of
from small_results import results
from typer.testing import CliRunner

from softslip.cli import app
from softslip.config.scenario import load_scenario
from softslip.files.products import EXPLORER
from softslip.files.stamps import check_figure
from softslip.files.storage import CONTENT_DIGEST, read_dataset
from softslip.provenance.fingerprints import fingerprint
from softslip.provenance.verification import possible_reruns, reexecute, verify
from softslip.provenance.verification.agreement import EQUAL

__all__ = ["results"]


def made() -> Path:
    return small_results.made() / "results" / "explorer.html"


def said(*words: object) -> str:
    return small_results.call(["explorer", *words])


def test_a_page_says_what_it_was_made_from() -> None:
    labels, folder = check_figure(made()), made().parent
    assert (labels["title"], labels["stage"], labels["run"]) == (EXPLORER, "figure", "small")
    tables = ["flow_curve", "creep", "profiles"]
    runs = sorted(path.name for path in folder.glob("shear/*.nc"))
    stated = [(each["run"], each[CONTENT_DIGEST]) for each in labels["parents"]]
    read = [read_dataset(folder / f"{stage}.nc", stage=stage) for stage in tables]
    read += [read_dataset(folder / "shear" / name, stage="shear") for name in runs]
    assert sorted(stated) == sorted(
        (each.attrs["run"], each.attrs[CONTENT_DIGEST]) for each in read
    )
    assert labels["provenance"]["fingerprint"] == fingerprint(EXPLORER)
    origins = labels["provenance"]["runs"]
    assert sorted(origins) == [name.removesuffix(".nc") for name in runs]
    for name in origins:
        run = read_dataset(folder / "shear" / f"{name}.nc", stage="shear")
        noted = json.loads(run.attrs["provenance"])
        assert origins[name]["commit"] == noted["commit"]
        assert origins[name]["ended"] == noted["ended"]
    data = data_of(made().read_bytes())
    assert sorted(data["runs"]) == sorted(data["snapshots"]) == sorted(origins)


def test_a_page_is_verified_like_every_other_result(results: Path) -> None:
    scenario = load_scenario(small_results.source(results))
    found = {each.name: each for each in verify(scenario, results).verdicts}[made().name]
    assert (found.problems, found.remarks, found.foreign, found.other_code) == (
        (),
        (),
        False,
        False,
    )
    page = results / made().name
    page.write_bytes(page.read_bytes().replace(b'"roughness"', b'"ruffness"', 1))
    found = {each.name: each for each in verify(scenario, results).verdicts}[made().name]
    assert "has been altered since it was drawn" in found.problems[0]
    page.unlink()
    assert made().name in verify(scenario, results).missing


def test_a_page_is_rerun_to_the_same_content() -> None:
    folder, source = made().parent, str(small_results.made() / "small.yaml")
    verification = verify(load_scenario(source), folder)
    (rerun,) = (each for each in possible_reruns(verification) if each.name == made().name)
    (outcome,) = reexecute([rerun], source, folder, small_results.call)
    assert (outcome.verdict, outcome.problem) == (EQUAL, "")


def test_tables_of_other_runs_are_refused(results: Path, tmp_path: Path) -> None:
    source = small_results.source(results)
    small_results.edit(results / "creep.nc", {"parents": json.dumps([])})
    small_results.redigest(results / "creep.nc")
    words = said(source, "--results", results, "--output", tmp_path / "page.html")
    assert "exit status 1" in words
    done = CliRunner().invoke(
        app, ["explorer", source, "--results", str(results), "--output", str(tmp_path / "x.html")]
    )
    assert "creep.nc: was made from other runs than flow_curve.nc; rerun: snakemake" in done.stderr
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize("name", ["page.nc", "page.png", "page"])
def test_a_page_is_written_to_a_file_of_its_kind_only(tmp_path: Path, name: str) -> None:
    source = small_results.made() / "small.yaml"
    words = ["explorer", str(source), "--output", str(tmp_path / name)]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 2
    assert "does not end in .html" in done.stderr


def test_export_of_a_page_names_the_datasets_that_it_shows() -> None:
    done = CliRunner().invoke(app, ["export", str(made())])
    assert done.exit_code == 1
    for name in ("flow_curve.nc", "creep.nc", "profiles.nc"):
        assert str(made().parent / name) in done.stderr
    assert "shear" not in done.stderr
