"""The chain through the command line, on the smallest packing that has a bulk."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from projects import drawings
from typer.testing import CliRunner

from softslip.cli import app
from softslip.config.parameters import Parameters
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES, stage_ids, stage_parameters
from softslip.files.storage import CONTENT_DIGEST, read_dataset

TINY = """
description: The chain in its smallest form.
base:
  channel: {length: 0.0625, height: 0.09375, outer_gap: 0.0078125}
  hydrodynamics: {resolution: 2048}
  suspension: {area_fraction: 0.7}
  time_stepping: {step: 0.002, ageing_time: 0.02, shear_time: 0.2}
  recording: {snapshots: [0.1], profile_interval: 0.1}
axes:
  rheometer.stress: [0.1, 0.5]
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run every stage of the tiny scenario by hand and return its folder."""
    folder = tmp_path_factory.mktemp("cli")
    (folder / "tiny.yaml").write_text(TINY)
    scenario = load_scenario(str(folder / "tiny.yaml"))
    for stage in STAGES:
        for identity, row in scenario.stage_table(stage).items():
            before = STAGES[STAGES.index(stage) - 1]
            parent = ["--parent", str(folder / before / f"{row.parent}.nc")] if row.parent else []
            output = ["--output", str(folder / stage / f"{identity}.nc")]
            command = [stage, str(folder / "tiny.yaml"), identity, *parent, *output]
            result = CliRunner().invoke(app, command, catch_exceptions=False)
            assert result.exit_code == 0, result.output
    return folder


def call(*words: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    return result.exit_code, result.output


def test_stages_write_their_identity_parameters_and_units(results: Path) -> None:
    scenario = load_scenario(str(results / "tiny.yaml"))
    for stage in STAGES:
        for identity, row in scenario.stage_table(stage).items():
            data = read_dataset(results / stage / f"{identity}.nc", stage=stage, run=identity)
            assert data.attrs["parameters"] == stage_parameters(row.parameters, stage)
            assert data.attrs["parent"] == (row.parent or "")
            bare = [
                name for name, variable in data.data_vars.items() if "units" not in variable.attrs
            ]
            assert not bare, f"{stage}: {bare} have no units"


def test_stresses_share_one_aged_packing(results: Path) -> None:
    counts = {stage: len(list((results / stage).glob("*.nc"))) for stage in STAGES}
    assert counts == {"packing": 1, "expansion": 1, "ageing": 1, "shear": 2}


def test_a_longer_run_continues_the_shorter_one(results: Path, tmp_path: Path) -> None:
    """From its end state, with the content of one that was as long from the start."""
    longer = tmp_path / "longer.yaml"
    longer.write_text(TINY.replace("shear_time: 0.2", "shear_time: 0.3"))
    identity, row = next(iter(load_scenario(str(longer)).stage_table("shear").items()))
    parent = results / "ageing" / f"{row.parent}.nc"
    digest, said = [], []
    for folder in (results / "shear", tmp_path / "shear"):
        output = folder / f"{identity}.nc"
        status, text = call("shear", longer, identity, "--parent", parent, "--output", output)
        assert status == 0, text
        said.append(text)
        digest.append(read_dataset(output, stage="shear", run=identity).attrs[CONTENT_DIGEST])
    assert "continuing a shorter run" in said[0]
    assert "t = 0.2" in said[0]
    assert "continuing" not in said[1]
    assert digest[0] == digest[1]
    (results / "shear" / f"{identity}.nc").unlink()


def test_tables_fits_and_figures_follow(results: Path) -> None:
    scenario = results / "tiny.yaml"
    for table in ("flow_curve", "creep", "profiles", "structure"):
        output = results / f"{table}.nc"
        status, said = call("gather", table, scenario, "--results", results, "--output", output)
        assert status == 0, said
    curve = xr.load_dataset(results / "flow_curve.nc")
    assert list(curve["stress"].values) == [0.1, 0.5]
    assert set(np.unique(curve["status"].values)) == {"done"}
    status, said = call("fit", results / "flow_curve.nc", "--output", results / "fits.nc")
    assert status == 0, said
    assert "too few" in said, f"two short runs give no law, but it says {said!r}"
    figures = {name: data for name, data, _ in drawings(load_scenario(str(scenario)), results)}
    assert {"fig3", "fig4", "fig5", "fig6", "fig7", "fig8", "fig9"} <= set(figures)
    figures["snapshot"] = [next((results / "shear").glob("*.nc"))]
    for name, data in figures.items():
        status, said = call("draw", name, *data, "--output", results / f"{name}.png")
        assert status == 0, said
        assert (results / f"{name}.png").stat().st_size > 10_000, f"{name} is an empty picture"


def test_a_missing_run_is_marked_and_not_guessed(results: Path, tmp_path: Path) -> None:
    (tmp_path / "shear").mkdir()
    kept, _ = sorted((results / "shear").glob("*.nc"))
    (tmp_path / "shear" / kept.name).write_bytes(kept.read_bytes())
    output = tmp_path / "flow_curve.nc"
    status, said = call(
        "gather", "flow_curve", results / "tiny.yaml", "--results", tmp_path, "--output", output
    )
    assert status == 0, said
    curve = xr.load_dataset(output)
    assert sorted(curve["status"].values) == ["done", "missing"]
    missing = curve["shear_rate_wall"].values[curve["status"].values == "missing"]
    assert np.isnan(missing).all(), f"a missing run has the value {missing}"


def test_runs_lists_every_run_and_ticks_the_finished(results: Path) -> None:
    status, said = call("runs", results / "tiny.yaml", "--results", results)
    assert status == 0, said
    for run in load_scenario(str(results / "tiny.yaml")).runs():
        assert run.ids["shear"] in said, f"{run.ids['shear']} is not listed in\n{said}"
    assert said.count("✓") == 2 * len(STAGES), said


@pytest.mark.parametrize(
    ("words", "status", "parts"),
    [
        (("runs", "nowhere"), 2, ("scenario", "nowhere")),
        (("packing", "demo", "0000", "--output", "x.nc"), 2, ("run", "softslip runs demo")),
        (("gather", "flows", "demo", "--output", "x.nc"), 2, ("table", "flow_curve")),
        (("gather", "creep", "demo", "--results", "none", "--output", "x.nc"), 1, ("done",)),
        (("draw", "pie", "x.nc", "--output", "x.png"), 2, ("figure", "snapshot")),
        (("draw", "fig4", "none.nc", "--output", "x.png"), 1, ("none.nc", "does not exist")),
        (("fit", "none.nc", "--output", "x.nc"), 1, ("none.nc", "does not exist")),
    ],
)
def test_bad_calls_end_in_one_line(
    words: tuple[str, ...], status: int, parts: tuple[str, ...]
) -> None:
    found, said = call(*words)
    assert found == status, f"exit status {found}: {said}"
    assert len(said.strip().splitlines()) == 1, f"more than one line: {said}"
    for part in parts:
        assert part in said, f"{part!r} is not in {said!r}"


def test_a_parent_of_another_run_is_refused(results: Path, tmp_path: Path) -> None:
    scenario = load_scenario(str(results / "tiny.yaml"))
    (row,) = scenario.stage_table("expansion").values()
    wrong = next((results / "ageing").glob("*.nc"))
    output = tmp_path / "out.nc"
    status, said = call(
        "expansion", results / "tiny.yaml", row.id, "--parent", wrong, "--output", output
    )
    assert status == 1
    assert "stage 'ageing', not 'packing'" in said, said
    assert not output.exists(), "a refused stage must write nothing"


def test_a_stage_with_its_parameters_does_not_read_the_scenario(
    results: Path, tmp_path: Path
) -> None:
    ((run, row),) = load_scenario(str(results / "tiny.yaml")).stage_table("expansion").items()
    words = ("--parent", results / "packing" / f"{row.parent}.nc", "--output", tmp_path / "out.nc")
    text = row.parameters.model_dump_json()
    status, said = call("expansion", "nowhere", run, "--parameters", text, *words)
    assert status == 0, said
    made = read_dataset(tmp_path / "out.nc", stage="expansion", run=run)
    before = read_dataset(results / "expansion" / f"{run}.nc", stage="expansion", run=run)
    assert made.attrs[CONTENT_DIGEST] == before.attrs[CONTENT_DIGEST]
    for name in ("parameters", "parent", "mean_radius", "area_fraction"):
        assert made.attrs[name] == before.attrs[name]


SHEARED = stage_ids(Parameters())["shear"]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (Parameters(seed=2).model_dump_json(), ("parameters", "shear", SHEARED, "leave them out")),
        ("{", ("parameters: '{' is not valid JSON",)),
        ("[" * 10_000, ("parameters", "is not valid JSON")),
        ("[1]", ("must be a group of keys",)),
        ('{"wall": {"roughness": -1}}', ("wall.roughness: -1",)),
        ('{"walls": {}}', ("walls", "does not exist")),
        ('{"seed": "\udc80"}', ("parameters", "is not valid JSON")),
    ],
)
def test_parameters_of_no_or_another_run_are_refused(text: str, parts: tuple[str, ...]) -> None:
    words = ("--parent", "none.nc", "--output", "out.nc")
    status, said = call("shear", "nowhere", SHEARED, "--parameters", text, *words)
    assert status == 2, said
    assert len(said.strip().splitlines()) == 1, f"more than one line: {said}"
    for part in parts:
        assert part in said, f"{part!r} is not in {said!r}"


def test_a_stage_with_its_parameters_says_what_its_accuracy_picked() -> None:
    parameters = Parameters.from_mapping({"accuracy": 0.05})
    words = ("--parameters", parameters.model_dump_json(), "--parent", "none.nc")
    run = stage_ids(parameters)["shear"]
    status, said = call("shear", "nowhere", run, *words, "--output", "out.nc")
    assert status == 1
    first, second = said.strip().splitlines()
    assert first.startswith("accuracy 0.05: ")
    assert "none.nc" in second


def validated(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["validate", *words])
    return result.exit_code, result.stdout, result.stderr


def test_a_case_prints_one_json_object() -> None:
    status, printed, _ = validated(
        "friction", "--shape", "circles", "--separation", "0.8", "--json"
    )
    found = json.loads(printed)
    assert status == 0
    assert {"case", "parameters", "result", "reference", "error"} <= set(found)
    assert found["parameters"]["separation"] == 0.8
    assert found["error"] == found["result"]["friction"]


def test_a_case_fails_when_its_error_is_over_the_tolerance() -> None:
    status, printed, _ = validated("friction", "--tolerance", "1e-9")
    assert status == 1
    assert "over 1e-09" in printed
    status, printed, _ = validated("friction", "--tolerance", "1e-9", "--json")
    assert status == 1
    assert not json.loads(printed)["passed"]


def test_a_case_refuses_what_it_cannot_solve_in_one_line() -> None:
    status, printed, said = validated("friction", "--separation", "2")
    assert (status, printed) == (2, "")
    assert said.startswith("ConfigError: separation: 2.0 must be less than 1")
    assert said.count("\n") == 1


def test_cases_are_listed_with_what_they_solve() -> None:
    status, printed, _ = validated("--help")
    assert status == 0
    assert all(name in printed for name in ("couette", "cylinders", "capsule", "order"))


def test_an_accuracy_says_what_it_picked(tmp_path: Path) -> None:
    scenario = tmp_path / "own.yaml"
    scenario.write_text("description: One run.\nbase: {accuracy: 0.05}\n")
    result = CliRunner().invoke(app, ["runs", str(scenario)])
    assert result.exit_code == 0
    assert "accuracy 0.05: " in result.stderr
    assert "hydrodynamics.node_spacing" in result.stderr
    assert "measured error" in result.stderr
