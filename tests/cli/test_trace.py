"""What `softslip trace` prints, draws and ends with."""

import json
from pathlib import Path

import lineage_synthetic
import pytest
from chain import SCENARIO
from lineage_synthetic import Results
from typer.testing import CliRunner, Result

from softslip.cli import app
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.files.stamps import check_figure
from softslip.provenance.attribution import code
from softslip.provenance.product_labels import read_product


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Results:
    return lineage_synthetic.some(tmp_path_factory.mktemp("made") / "results" / "demo")


def call(*words: object) -> Result:
    return CliRunner().invoke(app, ["trace", *map(str, words)])


def lines(*words: object, status: int = 0) -> list[str]:
    result = call(*words)
    assert result.exit_code == status, result.output
    return [line.rstrip() for line in result.stdout.splitlines()]


def test_a_value_comes_first_with_its_runs_and_their_code(made: Results) -> None:
    said = lines(f"{made.path('fits')}:yield_stress[roughness=0]")
    assert said[0].startswith("yield_stress[roughness=0] = 0.0")
    assert " ± " in said[0]
    assert said[0].endswith(" stress unit")
    assert said[1] == f"Herschel-Bulkley yield stress, {made.path('fits')}"
    assert said[2] == "fitted"
    assert said[3] == "from 8 shear runs (shear_rate_bulk of 8), seeds 1-2"
    commit = f"commit {str(code()['commit'])[:7]}" + "*" * bool(code()["dirty"])
    assert said[4].startswith(commit)
    # Eight shear runs and two of each stage before, a thousand seconds each.
    spent = float(said[4].split("; ")[2].removesuffix(" core-hours"))
    # To the three digits that are shown.
    assert spent == pytest.approx(14000 / 3600, abs=0.005)
    assert "; 14 restarts; " in said[4]


def test_the_tree_goes_back_stage_by_stage(made: Results) -> None:
    said = lines(f"{made.path('fits')}:yield_stress[roughness=0.59]")
    tree = said[next(n for n, line in enumerate(said) if line.startswith("fits demo")) :]
    words = [line.lstrip(" │├└─") for line in tree]
    assert words[1].startswith("flow_curve demo")
    assert words[2].startswith("5 shear runs: stress 0.2, 0.5, 1; roughness 0.59; seed 1, 2; code")
    assert [line.split()[1] for line in words[2:6]] == list(reversed(STAGES))
    unsteady, other, missing = (
        (0.3, 0.59, 1), (0.3, 0.59, 2), (0.5, 0.59, 2)
    )  # fmt: skip
    assert words[6:] == [
        "3 cells left out",
        f"stress 0.3, roughness 0.59, seed 1  {made.ids[unsteady]['shear']}  "
        "shear_rate_bulk not steady",
        f"stress 0.3, roughness 0.59, seed 2  {made.ids[other]['shear']}  "
        "shear_rate_bulk not steady with its other seeds",
        "stress 0.5, roughness 0.59, seed 2  shear_rate_bulk missing",
    ]
    assert missing in made.missing


def test_a_fit_that_was_not_made_says_why(made: Results) -> None:
    said = lines(f"{made.path('fits')}:yield_stress[roughness=0.59]")
    assert said[0] == "yield_stress[roughness=0.59] = unknown"
    assert said[2] == "too few steady points: 3 of at least 4"


def test_a_variable_of_another_dataset_is_shown_and_said(made: Results) -> None:
    named = lines(f"{made.path('flow_curve')}:yield_stress[roughness=0]")
    direct = lines(f"{made.path('fits')}:yield_stress[roughness=0]")
    (more,) = [line for line in named if line not in direct]
    assert more == (
        f"yield_stress is not in {made.path('flow_curve')}, but in what was made from it"
    )


def test_all_lists_every_run_and_value(made: Results) -> None:
    target = f"{made.path('flow_curve')}:slip_velocity[roughness=0]"
    assert not any("  stress 0.2, " in line for line in lines(target))
    said = "\n".join(lines(target, "--all"))
    for stress in made.stresses:
        for seed in made.seeds:
            ids = made.ids[stress, 0.0, seed]
            assert f"  roughness 0, stress {stress:g}, seed {seed}: " in said
            assert all(f"{stage} {ids[stage]}  " in said for stage in STAGES)


def test_a_figure_is_named_with_all_its_runs(made: Results) -> None:
    path = made.folder / "figures" / "fig5.png"
    said = lines(path)
    assert said[:2] == [f"fig5 demo, {path}", "from 15 shear runs, seeds 1-2"]


def test_json_holds_all_of_it_in_a_stable_order(made: Results) -> None:
    target = f"{made.path('fits')}:yield_stress[roughness=0]"
    first, second = (call(target, "--json").stdout for _ in range(2))
    assert first == second
    found = json.loads(first)
    assert list(found) == ["target", "results", "value", "nodes", "edges", "problems"]
    value = found["value"]
    assert 0.04 < value["value"] < 0.06
    assert 0 < value["error"] < 0.01
    assert (value["units"], value["coordinates"]) == ("stress unit", {"roughness": 0.0})
    used = {each["run"] for each in value["runs"] if each["left_out"] is None}
    shears = {node["run"]: node for node in found["nodes"] if node["stage"] == "shear"}
    assert used == set(shears)
    node = shears[made.ids[0.2, 0.0, 2]["shear"]]
    assert node["swept"] == {"stress": 0.2, "roughness": 0.0, "seed": 2}
    assert node["provenance"]["core_seconds"] == 1000.0
    identities = [node["id"] for node in found["nodes"]]
    assert len(identities) == len(set(identities)) == 2 + 8 + 3 * 2
    assert len(found["edges"]) == 1 + 8 + 8 + 2 * 2
    assert {edge["to"] for edge in found["edges"]} == set(identities[1:])
    assert found["problems"] == []


def test_problems_are_printed_and_end_it_with_status_1(made: Results, tmp_path: Path) -> None:
    results = made.copy(tmp_path / "demo")
    path = results.place("ageing", 0.2, 0.0)
    path.unlink()
    said = lines(results.folder / "figures" / "fig5.png", status=1)
    assert said[-2] == "1 problem:"
    assert said[-1].endswith(f"was made from ageing {path.stem}, but {path} is not there")
    assert any("4 ageing runs: " in line and "1 missing" in line for line in said)
    result = call(results.folder / "figures" / "fig5.png", "--json")
    assert result.exit_code == 1
    assert len(json.loads(result.stdout)["problems"]) == 1


def test_many_problems_are_cut_short_unless_all_are_asked_for(
    made: Results, tmp_path: Path
) -> None:
    results = made.copy(tmp_path / "demo")
    for path in (results.folder / "shear").glob("*.nc"):
        path.unlink()
    said = lines(results.path("flow_curve"), status=1)
    assert "15 problems:" in said
    assert said[-1] == "- and 7 more; list them with --all"
    assert len([line for line in lines(results.path("flow_curve"), "--all", status=1)
                if line.startswith("- flow_curve demo was made from")]) == 15  # fmt: skip


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["nothing"], 2, "ConfigError: target: "),
        (["no.nc"], 1, "DatasetError: no.nc: does not exist"),
        (["{fits}:yield"], 2, "ConfigError: variable: "),
        (["{fits}:yield_stress[roughness=2]"], 2, "it has 0, 0.59"),
        (["{fits}", "--graph", "graph.txt"], 2, "ConfigError: graph: "),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    made: Results, words: list[str], status: int, said: str
) -> None:
    result = call(*(word.format(fits=made.path("fits")) for word in words))
    assert result.exit_code == status
    assert said in result.stderr
    assert result.stderr.count("\n") == 1
    assert result.stdout == ""


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_graph_is_a_figure_that_can_be_traced_itself(
    made: Results, tmp_path: Path, suffix: str
) -> None:
    graph = tmp_path / f"graph{suffix}"
    lines(f"{made.path('fits')}:yield_stress[roughness=0]", "--graph", graph)
    labels = check_figure(graph)
    assert (labels["title"], labels["run"]) == ("lineage", "demo")
    (parent,) = read_product(graph).parents
    fits = read_product(made.path("fits"))
    assert (parent.stage, parent.content, parent.record) == ("fits", fits.content, fits.record)
    said = lines(graph, "--results", made.folder)
    assert said[0] == f"lineage demo, {graph}"


def test_a_real_chain_is_traced_from_its_figure_to_its_packing(tmp_path: Path) -> None:
    scenario, folder = tmp_path / "small.yaml", tmp_path / "small"
    scenario.write_text(SCENARIO)
    (run,) = load_scenario(str(scenario)).runs()
    before: list[str] = []
    for stage in STAGES:
        path = folder / stage / f"{run.ids[stage]}.nc"
        do(stage, scenario, run.ids[stage], *before, "--output", path)
        before = ["--parent", str(path)]
    figure = folder / "figures" / "snapshots" / f"{run.ids['shear']}.png"
    curve = folder / "flow_curve.nc"
    do("draw", "snapshot", folder / "shear" / f"{run.ids['shear']}.nc", "--output", figure)
    do("gather", "flow_curve", scenario, "--results", folder, "--output", curve)
    for target in (figure, f"{curve}:slip_velocity"):
        found = json.loads(call(target, "--json").stdout)
        assert found["problems"] == []
        assert [node["run"] for node in found["nodes"][1:]] == [
            run.ids[stage] for stage in reversed(STAGES)
        ]
        assert found["nodes"][1]["provenance"]["seed"] == run.parameters.seed


def do(*words: object) -> None:
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 0, result.output
