"""What people are told of runs, and that cleaning removes nothing that is needed."""

import io
import json
import os
import socket
import time
from contextlib import suppress
from pathlib import Path

import pytest
from rich.console import Console
from runs_synthetic import CHECKPOINT_BYTES, Work
from typer.testing import CliRunner, Result

from softslip.cli import stage_commands
from softslip.cli import status as module
from softslip.cli.status import app
from softslip.config.scenario import Scenario
from softslip.errors import NumericalError
from softslip.operations.failures import failure_recorded
from softslip.operations.lock import claim, holder_path, lock_path, run_lock
from softslip.operations.scenario_status import ScenarioStatus, scenario_status

UNKNOWN = "f" * 16


def call(command: str, work: Work, *words: str) -> Result:
    path = work.results.parent / "four.yaml"
    every = [command, str(path), "--results", str(work.results), *words]
    return CliRunner().invoke(app, every, catch_exceptions=False)


def said(command: str, work: Work, *words: str) -> str:
    result = call(command, work, *words)
    assert result.exit_code == 0, result.output
    return result.stdout


def runs(scenario: Scenario, stage: str = "shear") -> list[str]:
    return list(scenario.stage_table(stage))


def rows(text: str, run: str) -> list[list[str]]:
    """Return the cells of the rows of a table that are of a run."""
    lines = [line for line in text.splitlines() if run in line and "│" in line]
    return [[cell.strip() for cell in line.split("│")[1:-1]] for line in lines]


@pytest.fixture
def mixed(scenario: Scenario, work: Work) -> list[str]:
    """Leave a run of each state but running; what is stale is of the first."""
    done, stopped, *_ = listed = runs(scenario)
    work.stop("shear", done)
    work.finish("shear", done)
    work.stop("shear", stopped, [(40.0, 2.0, 100), (60.0, 3.0, 200)], written=time.time() - 300)
    return listed


def test_runs_that_are_not_done_have_a_row_each(mixed: list[str], work: Work) -> None:
    done, stopped, missing, _ = mixed
    text = said("status", work)
    assert not rows(text, done)
    (cells,) = rows(text, stopped)
    expected = ["shear", stopped, "1", "0.5", "interrupted", "3", "10", "30.0%", "200", "5"]
    assert cells == [*expected, "2.3 min", "5.0 min ago", "0", ""]
    (cells,) = rows(text, missing)
    assert cells == ["shear", missing, "2", "0.1", "missing", *[""] * 9]


def test_those_that_run_come_first(mixed: list[str], work: Work) -> None:
    with run_lock(work.folder("shear"), mixed[3]):
        text = said("status", work, "--all")
    states = [line.split("│")[5].strip() for line in text.splitlines() if line.count("│") == 15]
    assert [state for state in states if state] == [
        "running",
        "interrupted",
        *["missing"] * 7,
        "done",
    ]


def test_all_lists_the_finished_too(mixed: list[str], work: Work) -> None:
    (cells,) = rows(said("status", work, "--all"), mixed[0])
    assert cells[4] == "done"


def test_each_stage_is_summed_up(mixed: list[str], work: Work) -> None:
    lines = [line.split() for line in said("status", work).splitlines()]
    for stage, counts in (("packing", "00002"), ("ageing", "00002"), ("shear", "10012")):
        assert " │ ".join(["", stage, *counts, ""]).split() in lines


def test_stale_checkpoints_come_with_the_command_that_removes_them(
    mixed: list[str], work: Work
) -> None:
    text = said("status", work)
    path = work.results.parent / "four.yaml"
    command = f"softslip clean {path} --results {work.results}"
    assert any(
        line.startswith("1 stale checkpoint, ") and line.rstrip().endswith(f": {command}")
        for line in text.splitlines()
    ), text
    assert "3 checkpoints, " in text
    said("clean", work)
    assert "stale" not in said("status", work)


def test_who_works_on_a_run_and_what_is_damaged_is_remarked(scenario: Scenario, work: Work) -> None:
    running, damaged, *_ = runs(scenario)
    newest, _ = work.stop("shear", damaged)
    newest.write_bytes(b"")
    with run_lock(work.folder("shear"), running):
        text = said("status", work)
    (cells,) = rows(text, running)
    assert cells[4] == "running"
    assert f"process {os.getpid()}" in text
    assert rows(text, damaged)[0][-1].startswith("1 checkpoint")
    assert "1 checkpoint damaged" in text


def test_json_says_the_same(mixed: list[str], scenario: Scenario, work: Work) -> None:
    stopped, running = mixed[1:3]
    with run_lock(work.folder("shear"), running):
        found = json.loads(said("status", work, "--json"))
    assert found["scenario"] == "four"
    assert found["results"] == str(work.results)
    counts = {"done": 1, "running": 1, "failed": 0, "interrupted": 1, "missing": 1}
    assert found["stages"]["shear"] == counts
    assert list(found["stages"]["shear"]) == list(counts)
    assert {run["error"] for run in found["runs"]} == {None}
    by_run = {run["run"]: run for run in found["runs"] if run["stage"] == "shear"}
    assert [by_run[run]["state"] for run in mixed] == ["done", "interrupted", "running", "missing"]
    assert by_run[stopped]["coordinates"] == {"seed": 1, "stress": 0.5}
    progress = by_run[stopped]["progress"]
    assert (progress["time"], progress["fraction"], progress["remaining"]) == (3.0, 0.3, 140.0)
    assert by_run[running]["holder"]["process"] == os.getpid()
    assert by_run[running]["progress"] is None
    files = found["checkpoints"]
    assert (files["files"], files["damaged"], files["stale"]) == (3, 0, 1)
    assert files["bytes"] > 3 * CHECKPOINT_BYTES > files["stale_bytes"] > CHECKPOINT_BYTES


def test_failed_runs_come_after_those_at_work_with_the_beginning_of_their_error(
    mixed: list[str], work: Work
) -> None:
    message = "[bold] is not finite; lower time_stepping.step, or raise what limits it"
    error = f"NumericalError: tether[3] at step 7: {message}"
    folder = work.folder("shear")
    with suppress(NumericalError), failure_recorded(folder, mixed[3]):
        raise NumericalError("tether", 3, 7, message)
    with run_lock(work.folder("shear"), mixed[2]):
        text = said("status", work)
        (told,) = [
            run for run in json.loads(said("status", work, "--json"))["runs"] if run["error"]
        ]
    states = [line.split("│")[5].strip() for line in text.splitlines() if line.count("│") == 15]
    assert [state for state in states if state][:3] == ["running", "failed", "interrupted"]
    lines = text[text.index(mixed[3]) :].splitlines()
    remark = "".join(line.split("│")[-2].strip() for line in lines[:8] if line.count("│") > 5)
    assert remark.replace(" ", "").startswith("NumericalError:tether[3]atstep7:[bold]isnot")
    assert "or raise what limits it" not in " ".join(text.split())
    assert (told["run"], told["state"], told["error"]) == (mixed[3], "failed", error)
    failure = told["failure"]
    assert (failure["error"], failure["message"]) == (
        "NumericalError",
        f"tether[3] at step 7: {message}",
    )
    assert (failure["field"], failure["index"], failure["step"]) == ("tether", 3, 7)


def test_a_stage_that_fails_records_why(scenario: Scenario, work: Work) -> None:
    run, missing = runs(scenario, "expansion")[0], work.results / "none.nc"
    output = work.results / "expansion" / f"{run}.nc"
    words = ["--parent", str(missing), "--output", str(output)]
    call = ["expansion", str(work.results.parent / "four.yaml"), run, *words]
    result = CliRunner().invoke(stage_commands.app, call, catch_exceptions=False)
    assert result.exit_code == 1
    (told,) = [run for run in json.loads(said("status", work, "--json"))["runs"] if run["error"]]
    assert (told["run"], told["state"]) == (run, "failed")
    assert told["error"] == result.stderr.strip()
    assert told["error"].startswith("DatasetError: ")


def test_a_killed_run_is_remarked(mixed: list[str], work: Work) -> None:
    record = {"process": 2**22 + 1, "host": socket.gethostname(), "started": "2026-01-02T03:04:05Z"}
    holder_path(work.folder("shear"), mixed[1]).write_text(json.dumps(record))
    text = said("status", work)
    assert f"process {2**22 + 1}" in text
    assert "killed or crashed" in " ".join(text.split())
    found = json.loads(said("status", work, "--json"))["runs"]
    killed = {run["run"]: run["killed"] for run in found if run["killed"]}
    assert {run: holder["process"] for run, holder in killed.items()} == {mixed[1]: 2**22 + 1}


def test_of_many_missing_runs_only_the_first_are_listed(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MOST_MISSING", 3)
    work.stop("shear", runs(scenario)[3])
    text = said("status", work)
    assert text.count("│ missing ") == 3, text
    assert rows(text, runs(scenario)[3])[0][4] == "interrupted"
    assert "and 6 missing runs more; to list them all: --all" in text
    text = said("status", work, "--all")
    assert text.count("│ missing ") == 9
    assert "more" not in text


def test_watching_ends_when_all_is_done(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept = []

    def finish(seconds: float) -> None:
        slept.append(seconds)
        stage = ("packing", "expansion", "ageing", "shear")[len(slept) - 1]
        for run in runs(scenario, stage):
            work.finish(stage, run)

    monkeypatch.setattr(module.time, "sleep", finish)
    text = said("status", work, "--watch", "7")
    assert slept == [7.0] * 4
    assert text.count("four: Four runs of two packings.") == 5


def test_watching_ends_quietly_when_the_user_has_seen_enough(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module.time, "sleep", interrupt)
    assert "missing" in said("status", work, "--watch", "7")


def test_on_a_terminal_the_sum_stays_in_sight(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More rows than lines are cut off at the end."""
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=160, height=14)
    monkeypatch.setattr(module, "_console", lambda: console)
    monkeypatch.setattr(module.time, "sleep", lambda seconds: work.finish("shear", UNKNOWN))
    looks = []

    def look(scenario: Scenario, folder: Path) -> ScenarioStatus:
        looks.append(folder)
        if len(looks) == 3:
            raise KeyboardInterrupt
        return scenario_status(scenario, folder)

    monkeypatch.setattr("softslip.operations.scenario_status.scenario_status", look)
    said("status", work, "--watch", "7")
    shown = screen.getvalue()
    assert len(looks) == 3
    assert "four: Four runs of two packings." in shown
    assert "0 checkpoints, 0 bytes" in shown
    assert "…" in shown or "..." in shown


def test_json_is_not_watched(scenario: Scenario, work: Work) -> None:
    result = call("status", work, "--json", "--watch", "7")
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "watch: 7.0 is given with --json" in result.stderr


def names(work: Work) -> set[str]:
    return {path.name for path in work.results.rglob("*") if path.is_file()}


def test_cleaning_removes_what_is_stale_and_says_so(mixed: list[str], work: Work) -> None:
    done, stopped, *_ = mixed
    foreign, _ = work.stop("ageing", UNKNOWN)
    (stale,) = work.folder("shear").glob(f"{done}*")
    size = stale.stat().st_size + foreign.stat().st_size
    before = names(work)
    text = said("clean", work)
    assert before - names(work) == {stale.name, foreign.name}
    assert not names(work) - before, "the locks that it took are gone again"
    assert f"removed shear/checkpoints/{stale.name} (" in text
    assert "its run is finished" in text
    assert text.splitlines()[-1].startswith("removed 2 files, ")
    assert f"({size} bytes)" in text.splitlines()[-1]
    assert len(list(work.folder("shear").glob(f"{stopped}*"))) == 2
    assert said("clean", work) == "removed 0 files, 0 bytes (0 bytes)\n"


def test_a_dry_run_says_the_same_and_removes_nothing(mixed: list[str], work: Work) -> None:
    before = names(work)
    text = said("clean", work, "--all", "--dry-run")
    assert names(work) == before
    assert text.count("would remove ") == 4
    assert said("clean", work, "--all") == text.replace("would remove", "removed")


def test_all_removes_what_stopped_runs_would_go_on_from(mixed: list[str], work: Work) -> None:
    lock_path(work.folder("shear"), mixed[1]).touch()
    said("clean", work)
    assert lock_path(work.folder("shear"), mixed[1]).exists()
    said("clean", work, "--all")
    assert names(work) == {f"{mixed[0]}.nc"}


def test_what_dead_processes_left_is_removed(scenario: Scenario, work: Work) -> None:
    run, folder = runs(scenario)[0], work.folder("shear")
    folder.mkdir(parents=True)
    lock_path(folder, run).touch()
    holder_path(folder, run).write_text("{}")
    for old in (folder / f".{run}.x.checkpoint.y.part", work.results / ".fits.nc.z.part"):
        old.touch()
        os.utime(old, (0, 0))
    said("clean", work)
    assert not names(work)


def test_a_run_at_work_keeps_everything(mixed: list[str], work: Work) -> None:
    for run in mixed[:2]:
        before = names(work)
        with run_lock(work.folder("shear"), run):
            during = names(work)
            result = call("clean", work, "--all")
            assert {name for name in during if run in name} <= names(work)
        assert result.exit_code == 0
        assert {name for name in before if run in name} <= names(work)


def test_a_run_that_starts_while_others_are_removed_keeps_everything(
    mixed: list[str], work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody has left word when it is looked at, but it is taken when it is its turn."""
    before = names(work)
    with claim(work.folder("shear"), mixed[0]), claim(work.folder("shear"), mixed[1]):
        result = call("clean", work, "--all")
    assert result.exit_code == 0
    assert before <= names(work)
    assert result.stdout == "removed 0 files, 0 bytes (0 bytes)\n"
    for run in mixed[:2]:
        (line,) = [line for line in result.stderr.splitlines() if run in line]
        assert line.startswith("kept ")
        assert "is being worked on" in line


def test_a_finished_run_that_begins_anew_meanwhile_keeps_its_checkpoint(
    mixed: list[str], work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    def look(scenario: Scenario, folder: Path) -> ScenarioStatus:
        found = scenario_status(scenario, folder)
        (folder / "shear" / f"{mixed[0]}.nc").unlink()
        return found

    monkeypatch.setattr("softslip.operations.scenario_status.scenario_status", look)
    before = names(work) - {f"{mixed[0]}.nc"}
    assert said("clean", work).startswith("removed 0 files")
    assert names(work) == before


def test_what_cannot_be_removed_ends_in_one_line(
    mixed: list[str], work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = Path.unlink

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path.suffix == ".checkpoint":
            raise PermissionError(13, "Permission denied")
        real(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    result = call("clean", work)
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert "cannot be removed (Permission denied)" in line


@pytest.mark.parametrize("command", ["status", "clean"])
def test_a_scenario_that_is_not_there_ends_in_one_line(command: str, work: Work) -> None:
    result = CliRunner().invoke(app, [command, "nowhere"])
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "nowhere" in result.stderr


def test_results_are_looked_for_under_the_name_of_the_scenario(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = Work(tmp_path / "results" / "four", monkeypatch)
    work.stop("shear", UNKNOWN)
    monkeypatch.chdir(tmp_path)
    text = CliRunner().invoke(app, ["status", "four.yaml"], catch_exceptions=False).stdout
    assert "to remove them: softslip clean four.yaml\n" in text
    CliRunner().invoke(app, ["clean", "four.yaml"], catch_exceptions=False)
    assert not names(work)
