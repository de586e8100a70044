"""The chain through every stage, and then what is asked of its results and exported from them."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from projects import drawings
from typer.testing import CliRunner, Result

import softslip
from softslip.cli import app
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.files.products import FIGURES
from softslip.files.storage import read_dataset
from softslip.provenance.product_labels import read_product

SCENARIO = """\
description: Two runs of eight particles and a third that is never made.
base:
  fidelity: preview
  channel: {length: 0.046875, height: 0.046875, outer_gap: 0.0078125}
  packing: {equilibration_steps: 500}
  suspension: {area_fraction: 0.7}
  expansion: {ramp_steps: 500, relaxation_steps: 200, growth_nodes: 24}
  time_stepping: {ageing_time: 0.1, shear_time: 0.2, longest_step: 0.05}
  recording:
    {snapshots: [0.1], bulk_margin: null, stride: 2, profile_interval: 0.1, samples_per_decade: 2}
axes:
  rheometer.stress: [0.1, 0.3, 0.5]
"""

MADE = 2


def call(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)


def done(*words: object) -> str:
    result = call(*words)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make two of the three runs by hand, their tables and figures, and return the folder."""
    folder = tmp_path_factory.mktemp("query")
    scenario, results = folder / "desk.yaml", folder / "results" / "desk"
    scenario.write_text(SCENARIO)
    for stage in STAGES:
        for identity, row in list(load_scenario(str(scenario)).stage_table(stage).items())[:MADE]:
            before = STAGES[STAGES.index(stage) - 1]
            parent = ["--parent", results / before / f"{row.parent}.nc"] if row.parent else []
            done(stage, scenario, identity, *parent, "--output", results / stage / f"{identity}.nc")
    for table in ("flow_curve", "creep", "profiles", "structure"):
        output = results / f"{table}.nc"
        done("gather", table, scenario, "--results", results, "--output", output)
    done("fit", results / "flow_curve.nc", "--output", results / "fits.nc")
    for figure, data, output in drawings(load_scenario(str(scenario)), results):
        if not FIGURES[figure].sample:
            done("draw", figure, *data, "--output", output)
    run = next((results / "shear").glob("*.nc"))
    done("draw", "snapshot", run, "--output", results / "figures" / "snapshots" / f"{run.stem}.png")
    return folder


@pytest.fixture
def inside(desk: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(desk)
    return desk


def test_a_scenario_shows_its_runs_with_their_states(inside: Path) -> None:
    said = done("query", "desk.yaml", "stress > 0.1")
    runs = [
        run for run in load_scenario("desk.yaml").runs() if run.parameters.rheometer.stress > 0.1
    ]
    for run, state in zip(runs, ("done", "missing"), strict=True):
        (line,) = [line for line in said.splitlines() if run.ids["shear"] in line]
        cells = [cell.strip() for cell in line.split("│")]
        assert cells[1:4] == [run.ids["shear"], state, f"{run.parameters.rheometer.stress:g}"]
    assert said.rstrip().endswith("2 runs")


def test_a_folder_is_enough(inside: Path, tmp_path: Path) -> None:
    sent = Path(shutil.copytree("results/desk", tmp_path / "sent"))
    recorded = json.loads(done("query", sent, "run != 'zz'", "--json"))
    assert recorded["folder"] == str(sent)
    assert [run["stress"] for run in recorded["runs"]] == [0.1, 0.3]
    assert all(run["state"] == "done" and run["core_seconds"] > 0 for run in recorded["runs"])
    assert "1 run\n" in done("query", sent, "stress == 0.3")
    assert "0 runs" in done("query", sent, "stress == 0.5")


def test_columns_are_chosen(inside: Path, tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    done("query", "results/desk", "--columns", "run, rheometer.stress,host", "--csv", path)
    frame = pd.read_csv(path)
    assert list(frame.columns) == ["run", "rheometer.stress", "host"]
    assert frame["rheometer.stress"].tolist() == [0.1, 0.3]


def test_the_chosen_runs_become_a_dataset_as_gather_makes_it(inside: Path, tmp_path: Path) -> None:
    path = tmp_path / "some.nc"
    done("query", "results/desk", "stress <= 0.1", "--output", path)
    some = read_dataset(path, stage="flow_curve")
    every = read_dataset(Path("results/desk/flow_curve.nc"), stage="flow_curve")
    for name in ("shear_rate_wall", "shear_rate_wall_error", "run_id"):
        assert some[name].values.tolist() == every[name].sel(stress=[0.1]).values.tolist()
    product = read_product(path)
    (parent,) = product.parents
    assert (parent.stage, parent.run) == ("shear", some["run_id"].item())
    assert parent.record == read_product(Path(f"results/desk/shear/{parent.run}.nc")).record
    assert product.parameters["query"] == ["stress <= 0.1"]
    assert (
        product.provenance["fingerprint"]
        == read_product(Path("results/desk/flow_curve.nc")).provenance["fingerprint"]
    )
    done("query", "desk.yaml", "--table", "creep", "--output", path)
    assert read_dataset(path, stage="creep")["status"].values.tolist() == [
        "done",
        "done",
        "missing",
    ]


def test_python_gives_the_same_as_the_command(inside: Path, tmp_path: Path) -> None:
    path = tmp_path / "some.nc"
    done("query", "results/desk", "stress > 0.1", "--output", path)
    chosen = softslip.open_results("results/desk").query("stress > 0.1")
    dataset = chosen.dataset()
    for name, variable in read_dataset(path, stage="flow_curve").variables.items():
        np.testing.assert_array_equal(variable.values, dataset[name].values, err_msg=str(name))
    (run,) = chosen
    assert chosen.records(run.run[:6]).attrs["run"] == run.run


def test_a_figure_of_one_run_shows_the_finished_one_that_is_nearest(inside: Path) -> None:
    done("draw", "fig3", "desk.yaml", "--output", "near.png")
    runs = load_scenario("desk.yaml").runs()
    assert read_product(Path("near.png")).run == runs[1].ids["shear"], "0.5 is not there, 0.3 is"


@pytest.mark.parametrize("name", ["fig4", "fig5", "fig8", "fig9", "snapshots/*"])
def test_figures_of_real_runs_are_exported(inside: Path, tmp_path: Path, name: str) -> None:
    (figure,) = Path("results/desk/figures").glob(f"{name}.png")
    output = tmp_path / "out.csv"
    result = call("export", figure, "--output", output)
    assert result.exit_code == 0, result.output
    assert "looks different" not in result.output
    assert len(pd.read_csv(output, comment="#")) > 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("results/desk", "strss > 1"), "strss, which is unknown at character 1"),
        (("results/desk", "stress >"), "cannot be read at character"),
        (
            ("results/desk", "__import__('os').system('touch pwned')"),
            "something else than comparisons",
        ),
        (("results/desk", "run == 1"), "a text, with 1, a number"),
        (("results/desk", "--columns", "run,strss"), "did you mean stress"),
        (("results/desk", "--columns", ","), "is not the name of one value; use "),
        (("results/desk", "--output", "out.png"), "does not end in .nc"),
        (("results/desk", "--csv", "out.nc"), "does not end in .csv"),
        (("results/desk", "--table", "fits", "--output", "out.nc"), "use one of flow_curve"),
        (("results/desk", "stress > 9", "--output", "out.nc"), "none of the runs was chosen"),
        (("results/desk", "--results", "results/desk"), "is given with a folder"),
        (("results/none",), "nor a folder or file that exists"),
        (("none",), "is not in the folder config"),
        (("results/desk/figures",), "holds no run"),
    ],
)
def test_what_cannot_be_answered_is_refused_in_one_line(
    inside: Path, words: tuple[str, ...], said: str
) -> None:
    before = sorted(inside.iterdir())
    refused = call("query", *words)
    assert refused.exit_code in (1, 2)
    assert refused.stdout == ""
    assert refused.stderr.count("\n") == 1, refused.stderr
    assert said in refused.stderr
    assert sorted(inside.iterdir()) == before


def test_damaged_files_are_named_and_the_rest_is_listed(inside: Path, tmp_path: Path) -> None:
    sent = Path(shutil.copytree("results/desk", tmp_path / "sent"))
    damaged = sorted((sent / "shear").glob("*.nc"))[0]
    damaged.write_bytes(b"broken")
    result = call("query", sent)
    assert result.exit_code == 0
    assert "1 run\n" in result.stdout
    assert f"{damaged.name}: cannot be read" in result.stderr
