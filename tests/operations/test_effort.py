"""What runs took is what their files say, and what is told of it adds up."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_results import results, source

from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.operations.costs import shipped
from softslip.operations.effort import measure_effort
from softslip.operations.results_markdown import effort_table
from softslip.provenance.attribution import read_provenance

__all__ = ["results"]


@pytest.fixture
def effort(results: Path) -> xr.Dataset:
    return measure_effort(load_scenario(source(results)), results)[0]


def records(results: Path, stage: str) -> list[xr.Dataset]:
    return [xr.load_dataset(path) for path in sorted((results / stage).glob("*.nc"))]


@pytest.mark.parametrize("stage", STAGES)
def test_the_effort_of_a_stage_is_that_of_its_files(effort, results, stage):
    runs, told = records(results, stage), effort.sel(stage=stage)
    spent = sum(read_provenance(run.attrs)["core_seconds"] for run in runs)
    assert int(told["runs"]) == int(told["runs_done"]) == len(runs)
    assert float(told["core_seconds"]) == pytest.approx(spent)
    assert int(told["evaluations"]) == sum(run.attrs.get("evaluations", 0) for run in runs)
    assert int(told["runs_failed"]) == int(told["restarts"]) == int(told["ended_early"]) == 0


def test_every_step_has_one_cause(effort):
    flowing = effort.sel(stage=list(STAGES[2:]))
    np.testing.assert_array_equal(flowing["steps_set"].sum("cause"), flowing["steps"])


def test_estimates_are_those_of_the_table(effort, results):
    scenario = load_scenario(source(results))
    rows = scenario.stage_table("shear").values()
    estimates = [shipped().estimate("shear", row.parameters).core_seconds for row in rows]
    told = effort.sel(stage="shear")
    assert float(told["estimated_core_seconds"]) == pytest.approx(sum(estimates))
    ratio = float(told["core_seconds"] / told["estimated_core_seconds"])
    assert float(told["least_ratio"]) <= ratio <= float(told["largest_ratio"])


def test_the_parents_are_the_runs_that_were_counted(results):
    _, parents = measure_effort(load_scenario(source(results)), results)
    found = {(each.attrs["stage"], each.attrs["run"]) for each in parents}
    assert found == {(s, path.stem) for s in STAGES for path in (results / s).glob("*.nc")}


def test_runs_that_are_missing_are_left_out(results):
    next((results / "shear").glob("*.nc")).unlink()
    effort, _ = measure_effort(load_scenario(source(results)), results)
    told = effort.sel(stage="shear")
    assert (int(told["runs"]), int(told["runs_done"])) == (2, 1)
    for path in (results / "shear").glob("*.nc"):
        path.unlink()
    effort, _ = measure_effort(load_scenario(source(results)), results)
    assert np.isnan(effort["least_ratio"].sel(stage="shear"))
    assert effort_table(effort).endswith("No run is done.")


def test_shares_of_causes_are_told_in_order(effort):
    effort["steps_set"].loc[{"stage": "shear"}] = [30, 60, 9, 1, 0, 0]
    effort["steps"].loc[{"stage": "shear"}] = 100
    told = effort_table(effort).splitlines()[-1]
    assert told.endswith(
        "a film that closes 60%, the accepted error 30%, the motion of the nodes 9%, "
        "a time to be recorded 1%."
    )
