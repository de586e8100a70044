"""A plan is printed as tables or as JSON that say the same."""

import json
import os
from pathlib import Path

import pytest
import runs_synthetic
from plans_synthetic import leave
from runs_synthetic import Work
from typer.testing import CliRunner, Result

from softslip.cli import plan as module
from softslip.cli.plan import app
from softslip.config.scenario import Scenario, load_scenario
from softslip.config.stages import STAGES
from softslip.operations.costs import shipped
from softslip.operations.planning import make_plan

OLD = "0" * 16


def call(work: Work, *words: str) -> Result:
    path = work.results.parent / "four.yaml"
    every = ["plan", str(path), "--results", str(work.results), *words]
    return CliRunner().invoke(app, every, catch_exceptions=False)


def said(work: Work, *words: str) -> str:
    result = call(work, *words)
    assert result.exit_code == 0, result.output
    return result.stdout


def cells(text: str, first: str) -> list[list[str]]:
    """Return the cells of the rows of tables that begin with a word."""
    lines = [line for line in text.splitlines() if line.startswith(f"│ {first} ")]
    return [[cell.strip() for cell in line.split("│")[1:-1]] for line in lines]


@pytest.fixture
def mixed(scenario: Scenario, work: Work) -> list[str]:
    """Leave all but two shears, one of which has a checkpoint; return the shears."""
    runs = list(scenario.stage_table("shear"))
    for place, stage in enumerate(STAGES):
        for run in scenario.stage_table(stage):
            if run not in runs[:2]:
                os.utime(leave(work.results, stage, run), (1000.0 + place,) * 2)
    work.stop("shear", runs[1], [(40.0, 2.0, 100), (60.0, 3.0, 200)])
    return runs


def test_each_stage_has_a_row_and_so_has_the_whole(mixed: list[str], work: Work) -> None:
    text = said(work)
    assert "four: Four runs of two packings." in text
    assert cells(text, "packing") == [["packing", "0", "0", "0", "2", "", "", "", ""]]
    (row, *_) = cells(text, "shear")
    assert row[:5] == ["shear", "1", "1", "0", "2"]
    assert row[-1] == "missing 2"
    (row,) = cells(text, "all")
    assert row[:5] == ["all", "1", "1", "0", "8"]


def test_new_runs_of_a_sweep_have_a_row_each_with_swept_values(
    mixed: list[str], work: Work
) -> None:
    rows = cells(said(work), "shear")[1:]
    assert [row[:6] for row in rows] == [
        ["shear", mixed[0], "1", "0.1", "begin", "missing"],
        ["shear", mixed[1], "1", "0.5", "resume", "missing"],
    ]
    assert rows[1][6:8] == ["30.0%", "2.3 min"]


def test_all_lists_every_run(mixed: list[str], work: Work) -> None:
    text = said(work, "--all")
    assert [row[1] for row in cells(text, "shear")[1:]] == mixed
    assert cells(text, "packing")[1][4] == "reuse"


def test_a_scenario_that_was_never_run_is_not_listed(scenario: Scenario, work: Work) -> None:
    text = said(work)
    assert len(cells(text, "shear")) == 1
    assert len(cells(said(work, "--all"), "shear")) == 5
    assert "estimated from the runs of costs.json" in text


def test_of_many_new_runs_only_the_first_are_listed(
    mixed: list[str], work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_ROWS", 1)
    text = said(work)
    assert len(cells(text, "shear")) == 2
    assert "and 1 new run more; to list them all: --all" in text
    assert "more" not in said(work, "--all")


def test_the_chain_and_the_wall_time_are_told(scenario: Scenario, work: Work) -> None:
    made = make_plan(scenario, work.results)
    text = said(work, "--cores", "7")
    ids = " → ".join(f"{task.stage} {task.run[:8]}" for task in made.chain)
    assert any(line.startswith("longest chain: ") and ids in line for line in text.splitlines())
    assert [task.stage for task in made.chain] == list(STAGES)
    assert "wall time on 7 cores: about " in text
    assert "wall time on 1 core: about " in said(work, "--cores", "1")


def test_nothing_to_do_is_said(scenario: Scenario, work: Work) -> None:
    for place, stage in enumerate(STAGES):
        for run in scenario.stage_table(stage):
            os.utime(leave(work.results, stage, run), (1000.0 + place,) * 2)
    text = said(work)
    assert "nothing to do" in text
    assert "longest chain" not in text
    assert len(cells(text, "shear")) == 1


def test_code_that_has_changed_is_told(mixed: list[str], work: Work) -> None:
    path = leave(work.results, "shear", mixed[2], code=OLD)
    text = said(work)
    assert "1 dataset made by other code than the present one" in text
    assert "code changed 1" in cells(text, "shear")[0][-1]
    path.write_bytes(b"")
    text = said(work)
    assert f"cannot be read, and Snakemake does not notice; delete: shear/{mixed[2]}.nc" in text


def test_what_nobody_needs_is_told_where_there_is_such(mixed: list[str], work: Work) -> None:
    assert "not needed" not in said(work)
    (work.results / "packing").rename(work.results / "elsewhere")
    text = said(work)
    assert "not needed" in text
    assert cells(text, "packing")[0][:6] == ["packing", "0", "0", "0", "0", "2"]


def test_another_scenario_tells_what_is_new(mixed: list[str], work: Work, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(runs_synthetic.SCENARIO.replace("[0.1, 0.5]", "[0.1, 0.3]"))
    text = said(work, "--against", str(other))
    assert [row[1] for row in cells(text, "shear")[1:]] == [mixed[1], mixed[3]]
    assert "only in other: 0 packing, 0 expansion, 0 ageing, 2 shear" in text
    found = json.loads(said(work, "--against", str(other), "--json"))
    assert found["against"] == "other"
    gone = set(load_scenario(str(other)).stage_table("shear")) - set(mixed)
    assert set(found["gone"]["shear"]) == gone


def test_json_says_the_same(mixed: list[str], scenario: Scenario, work: Work) -> None:
    found = json.loads(said(work, "--json", "--cores", "3"))
    made = make_plan(scenario, work.results)
    assert found["scenario"] == "four"
    assert found["results"] == str(work.results)
    counts = {"begin": 1, "resume": 1, "running": 0, "reuse": 2, "skip": 0}
    assert found["stages"]["shear"]["counts"] == counts
    assert found["stages"]["shear"]["reasons"] == {"missing": 2}
    assert found["core_seconds"] == pytest.approx(made.core_seconds)
    assert (found["cores"], found["wall_seconds"]) == (3, pytest.approx(made.wall_seconds(3)))
    assert found["chain"] == [{"stage": "shear", "run": mixed[1]}]
    assert found["chain_seconds"] == 140.0
    assert found["gone"] is None
    by_run = {run["run"]: run for run in found["runs"]}
    assert len(by_run) == 10
    assert by_run[mixed[1]]["coordinates"] == {"seed": 1, "stress": 0.5}
    assert by_run[mixed[1]]["fraction"] == 0.3
    assert by_run[mixed[1]]["core_seconds"] == 140.0
    assert by_run[mixed[2]]["action"] == "reuse"


def test_estimates_have_their_factor(scenario: Scenario, work: Work) -> None:
    row = cells(said(work), "shear")[0]
    assert row[6] == f"× {shipped().factors['shear']:.2g}"
    hours = sum(
        shipped().estimate("shear", run.parameters).core_seconds / 3600
        for run in scenario.stage_table("shear").values()
    )
    assert float(row[5]) == pytest.approx(hours, rel=5e-3)


@pytest.mark.parametrize("words", [("--against", "nowhere"), ("--cores", "0")])
def test_what_makes_no_sense_is_refused(
    scenario: Scenario, work: Work, words: tuple[str, ...]
) -> None:
    result = call(work, *words)
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr
    assert words[0] in result.stderr or words[1] in result.stderr


def test_results_are_looked_for_under_the_name_of_the_scenario(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave(tmp_path / "results" / "four", "packing", next(iter(scenario.stage_table("packing"))))
    monkeypatch.chdir(tmp_path)
    text = CliRunner().invoke(app, ["plan", "four.yaml"], catch_exceptions=False).stdout
    assert cells(text, "packing")[0][:5] == ["packing", "1", "0", "0", "1"]


def test_calibrating_writes_the_table_that_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(
        "softslip.operations.calibration.calibrate", lambda path, say: asked.append(path)
    )
    result = CliRunner().invoke(app, ["calibrate", str(tmp_path / "table.json")])
    assert result.exit_code == 0
    assert asked == [tmp_path / "table.json"]


def test_requests_are_compared_with_finished_runs(mixed: list[str], work: Work) -> None:
    text = said(work, "--requests")
    assert "time requested over time used" in text
    (row,) = cells(text, "shear")
    assert row[1:3] == ["costs that come with softslip", "2"]
    (ageing, shear) = json.loads(said(work, "--requests", "--json"))["requests"]
    assert (ageing["stage"], shear["stage"]) == ("ageing", "shear")
    assert len(shear["ratios"]) == 2


def test_without_finished_runs_there_is_nothing_to_compare(scenario: Scenario, work: Work) -> None:
    assert said(work, "--requests") == "no ageing or shear of four is finished\n"
