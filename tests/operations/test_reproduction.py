"""Runs made again are held beside the published ones: the same bits, or so many errors apart."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_results import NAME, call, results, source

from softslip.errors import DatasetError
from softslip.files.publication import blocks_in
from softslip.files.storage import CONTENT_DIGEST, read_dataset
from softslip.operations.publish import DOCUMENT, PUBLISHED
from softslip.operations.reproduction import OBSERVABLES, is_identical, measure_reproduction
from softslip.operations.results_markdown import reproduction_table

__all__ = ["results"]


def curve(
    means: dict[str, float | None], error: float, digest: str = "a", processor: str = "Z80"
) -> xr.Dataset:
    """Return a flow curve of one wall and stresses from 1 on, of runs that are done or None."""
    done = np.array([[value is not None for value in means.values()]])
    values = np.array([[np.nan if value is None else value for value in means.values()]])
    dims = ("roughness", "stress")
    variables = {
        name: (dims, each, {"long_name": name})
        for observable in OBSERVABLES
        for name, each in {
            observable: values,
            f"{observable}_error": np.full_like(values, error),
        }.items()
    }
    variables["run_id"] = (dims, [list(means)], {})
    variables["status"] = (dims, np.where(done, "done", "missing"), {})
    parents = [{"stage": "shear", "run": run, CONTENT_DIGEST: digest} for run in means]
    coordinates = {"roughness": [0.0], "stress": np.arange(1.0, len(means) + 1)}
    labels = {"parents": json.dumps(parents), "provenance": json.dumps({"processor": processor})}
    return xr.Dataset(variables, coordinates, labels)


def test_differences_are_in_errors_of_the_difference():
    found = measure_reproduction(
        curve({"p": 1.0, "q": 2.0, "r": None}, 0.3), curve({"q": 3.0, "r": 1.0, "p": None}, 0.4)
    )
    assert list(found["run"].values) == ["q"]
    assert float(found["slip_velocity_difference"].item()) == pytest.approx(1.0 / 0.5)
    assert float(found["stress"].item()) == 2.0


def test_the_same_mean_without_an_error_differs_by_nothing():
    found = measure_reproduction(curve({"p": 1.0}, np.nan), curve({"p": 1.0}, np.nan))
    assert float(found["slip_velocity_difference"].item()) == 0.0


def test_a_difference_without_an_error_is_not_known():
    found = measure_reproduction(curve({"p": 1.0}, np.nan), curve({"p": 1.5}, 0.1))
    assert np.isnan(found["slip_velocity_difference"].item())


def test_bits_are_the_same_where_digests_are():
    same = measure_reproduction(curve({"p": 1.0}, 0.1), curve({"p": 1.0}, 0.1))
    parted = measure_reproduction(curve({"p": 1.0}, 0.1), curve({"p": 1.0}, 0.1, "b"))
    assert is_identical(same).all()
    assert not is_identical(parted).any()


def test_a_scenario_without_axes_has_one_run():
    one = curve({"p": 1.0}, 0.1).squeeze(drop=True)
    found = measure_reproduction(one, one)
    assert list(found["run"].values) == ["p"]
    assert is_identical(found).all()


def test_other_runs_cannot_be_compared():
    with pytest.raises(DatasetError, match="none of 1 runs made here is among the 1 published"):
        measure_reproduction(curve({"p": 1.0}, 0.1), curve({"q": 1.0}, 0.1))


def test_the_table_says_what_differs_and_by_how_much():
    found = measure_reproduction(
        curve({"p": 1.0, "q": 1.0}, 0.1), curve({"p": 1.0, "q": 1.5}, 0.1, "b", "6502")
    )
    said = reproduction_table(found)
    assert "2 runs made again, published from Z80, again on 6502: 0 with the same bits" in said
    assert "1 with means that agree to 0.01 standard errors" in said
    # Three observables differ by nothing, and three by 0.5 over 0.1 times the root of two.
    assert "Over the 6 means of all runs the difference is 2.50 standard errors" in said
    assert "3.54 at most, and more than two in 50%" in said
    assert "| 0 | 2 | 1 | 1.5 | +3.54 |" in said
    assert "| 0 | 1 | 1 | 1 |" not in said


def test_a_run_whose_error_is_not_known_has_a_row():
    found = measure_reproduction(curve({"p": 1.0}, np.nan), curve({"p": 1.5}, 0.1, "b"))
    said = reproduction_table(found)
    assert "0 with means that agree" in said
    assert "| 0 | 1 | 1 | 1.5 | – |" in said


@pytest.fixture
def project(results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with published results, and a document with a place for the table."""
    document = tmp_path / DOCUMENT
    document.parent.mkdir()
    part = f"{NAME}_reproduction"
    document.write_text(f"<!-- begin {part}: generated -->\n\n<!-- end {part} -->\n")
    published = tmp_path / PUBLISHED / NAME
    published.mkdir(parents=True)
    shutil.copy(results / "flow_curve.nc", published)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_same_runs_are_the_same_and_published(project, results):
    assert not call(["reproduce", source(results), "--results", results, "--publish"])
    copy = project / PUBLISHED / NAME / "reproduction.nc"
    found = read_dataset(copy, stage="reproduction", run=NAME)
    assert found.sizes["run"] == 2
    assert is_identical(found).all()
    told = blocks_in((project / DOCUMENT).read_text())[f"{NAME}_reproduction"]
    assert told == reproduction_table(found)
    assert "2 with the same bits, 2 with means that agree" in told


def test_a_part_of_the_runs_is_enough(project, results, tmp_path):
    here = tmp_path / "again"
    shutil.copytree(results, here)
    next((here / "shear").glob("*.nc")).unlink()
    compared = tmp_path / "compared.nc"
    assert not call(["reproduce", source(results), "--results", here, "--output", compared])
    assert read_dataset(compared, stage="reproduction").sizes["run"] == 1


def test_a_flow_curve_from_elsewhere_is_compared(project, results, tmp_path):
    compared = tmp_path / "compared.nc"
    given = ["--results", results, "--flow-curve", results / "flow_curve.nc", "--output", compared]
    assert not call(["reproduce", source(results), *given])
    assert is_identical(read_dataset(compared, stage="reproduction")).all()


def test_the_results_stay_as_they_are(project, results):
    before = sorted(results.rglob("*"))
    assert not call(["reproduce", source(results), "--results", results, "--publish"])
    assert sorted(results.rglob("*")) == before


def test_what_is_not_published_cannot_be_compared(project, results):
    (project / PUBLISHED / NAME / "flow_curve.nc").unlink()
    assert call(["reproduce", source(results), "--results", results])
