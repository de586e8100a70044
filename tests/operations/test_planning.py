"""What a plan says is to be done follows from what is there; times follow from chains and cores."""

import os
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import netCDF4
import pytest
import runs_synthetic
from plans_synthetic import SECONDS, leave
from runs_synthetic import Work

from softslip.config.scenario import Scenario, load_scenario
from softslip.config.stages import STAGES, trajectory_id
from softslip.errors import NumericalError
from softslip.operations import planning as module
from softslip.operations.costs import shipped
from softslip.operations.failures import failure_recorded
from softslip.operations.lock import run_lock
from softslip.operations.planning import make_plan
from softslip.operations.schedule import Plan, PlannedRun, StagePlan
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.end_state import end_state_path

OLD = "0" * 16


def of(scenario: Scenario, stage: str, number: int = 0) -> str:
    return list(scenario.stage_table(stage))[number]


def leave_all(scenario: Scenario, work: Work) -> None:
    """Leave every dataset, those of earlier stages before those of later ones."""
    began = time.time() - 100
    for place, stage in enumerate(STAGES):
        for run in scenario.stage_table(stage):
            os.utime(leave(work.results, stage, run), (began + place,) * 2)


def renew(path: Path, *words: str, **options: str) -> None:
    """Leave another dataset in the place of one, as old as it was."""
    changed = path.stat().st_mtime
    leave(path.parents[1], path.parent.name, path.stem, **options)  # type: ignore[arg-type]
    os.utime(path, (changed,) * 2)


def path_of(scenario: Scenario, work: Work, stage: str, number: int = 0) -> Path:
    return work.results / stage / f"{of(scenario, stage, number)}.nc"


def actions(scenario: Scenario, work: Work, stage: str) -> list[tuple[str, str]]:
    """Return the action and reason of each run of a stage."""
    tasks = make_plan(scenario, work.results).runs
    return [(task.action, task.reason) for task in tasks if task.stage == stage]


BEGIN, REUSE, SKIP = ("begin", "missing"), ("reuse", ""), ("skip", "")
RERUN = ("begin", "parent rerun")


def test_everything_is_begun_where_there_is_nothing(scenario: Scenario, work: Work) -> None:
    made = make_plan(scenario, work.results)
    assert [(task.stage, task.run) for task in made.runs] == [
        (stage, run) for stage in STAGES for run in scenario.stage_table(stage)
    ]
    assert {(task.action, task.reason, task.new) for task in made.runs} == {(*BEGIN, True)}
    assert made.stages["shear"].counts["begin"] == 4
    assert made.stages["shear"].reasons == {"missing": 4}
    assert not work.results.exists(), "looking must make nothing"


def test_estimates_are_those_of_the_table_where_nothing_is_finished(
    scenario: Scenario, work: Work
) -> None:
    made = make_plan(scenario, work.results)
    for task in made.runs:
        row = scenario.stage_table(task.stage)[task.run]
        expected = shipped().estimate(task.stage, row.parameters)
        assert (task.core_seconds, task.size) == (expected.core_seconds, expected.size)
    for name, stage in made.stages.items():
        own = [task for task in made.runs if task.stage == name]
        assert stage.core_seconds == pytest.approx(sum(task.core_seconds for task in own))
        assert (stage.factor, stage.finished) == (shipped().factors[name], 0)
    assert made.core_seconds == pytest.approx(sum(task.core_seconds for task in made.runs))
    assert made.size == pytest.approx(sum(task.size for task in made.runs))
    assert min(shipped().factors.values()) < made.factor < max(shipped().factors.values())


def test_nothing_is_left_where_all_is_there(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    made = make_plan(scenario, work.results)
    assert {(task.action, task.reason, task.new) for task in made.runs} == {(*REUSE, False)}
    assert (made.core_seconds, made.size, made.factor) == (0, 0, 1)
    assert made.chain == ()
    assert made.wall_seconds(2) == 0


def test_only_what_a_missing_run_needs_is_made(scenario: Scenario, work: Work) -> None:
    """Both shears of a packing lie under one ageing: what is made anew is sheared anew."""
    leave_all(scenario, work)
    path_of(scenario, work, "ageing", 0).unlink()
    assert actions(scenario, work, "ageing") == [SKIP, REUSE]
    assert actions(scenario, work, "shear") == [REUSE] * 4
    path_of(scenario, work, "shear", 1).unlink()
    assert actions(scenario, work, "expansion") == [REUSE, REUSE]
    assert actions(scenario, work, "ageing") == [BEGIN, REUSE]
    assert actions(scenario, work, "shear") == [RERUN, BEGIN, REUSE, REUSE]


def test_a_need_goes_back_to_the_packing(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    for stage in STAGES:
        path_of(scenario, work, stage).unlink()
    for stage in STAGES[:-1]:
        assert actions(scenario, work, stage) == [BEGIN, REUSE]
    assert actions(scenario, work, "shear") == [BEGIN, RERUN, REUSE, REUSE]


def test_other_code_makes_all_that_follows_run_again(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    renew(path_of(scenario, work, "expansion", 1), code=OLD)
    assert actions(scenario, work, "packing") == [REUSE, REUSE]
    assert actions(scenario, work, "expansion") == [REUSE, ("begin", "code changed")]
    assert actions(scenario, work, "ageing") == [REUSE, RERUN]
    assert actions(scenario, work, "shear") == [REUSE, REUSE, RERUN, RERUN]
    made = make_plan(scenario, work.results)
    assert made.stages["expansion"].reasons == {"code changed": 1}
    assert not any(task.new for task in made.runs)


def test_a_dataset_that_does_not_say_its_code_is_by_other_code(
    scenario: Scenario, work: Work
) -> None:
    leave_all(scenario, work)
    path = path_of(scenario, work, "shear")
    with netCDF4.Dataset(path, "a") as file:
        file.delncattr("provenance")
    assert actions(scenario, work, "shear")[0] == ("begin", "code changed")


def leave_with_digests(scenario: Scenario, work: Work, replaced: str = "") -> None:
    """Leave every dataset with digests, children first; a stage may have been replaced since."""
    for stage in reversed(STAGES):
        for run, row in scenario.stage_table(stage).items():
            content = f"{run} replaced" if stage == replaced else run
            leave(work.results, stage, run, content=content, parent=row.parent)


def test_times_in_any_order_rerun_nothing_where_digests_are_known(
    scenario: Scenario, work: Work
) -> None:
    leave_with_digests(scenario, work)
    assert not any(task.is_open for task in make_plan(scenario, work.results).runs)


def test_a_parent_that_was_replaced_is_noticed_whatever_its_time(
    scenario: Scenario, work: Work
) -> None:
    leave_with_digests(scenario, work, replaced="expansion")
    os.utime(path_of(scenario, work, "expansion"), (0, 0))
    assert actions(scenario, work, "expansion") == [REUSE, REUSE]
    assert actions(scenario, work, "ageing") == [("begin", "parent changed")] * 2
    assert actions(scenario, work, "shear") == [RERUN] * 4


def test_a_newer_parent_makes_what_follows_run_again(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    os.utime(path_of(scenario, work, "ageing"))
    assert actions(scenario, work, "ageing") == [REUSE, REUSE]
    newer = ("begin", "parent changed")
    assert actions(scenario, work, "shear") == [newer, newer, REUSE, REUSE]


def damage_none(path: Path) -> None:
    path.write_bytes(b"no dataset")


def damage_name(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("run", OLD)


def damage_stage(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("stage", "packing")


def damage_words(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("provenance", "[not JSON")


def damage_kind(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("provenance", "[1, 2]")


@pytest.mark.parametrize(
    "damage", [damage_none, damage_name, damage_stage, damage_words, damage_kind]
)
def test_a_dataset_that_no_stage_would_take_is_reported(
    scenario: Scenario, work: Work, damage: Any
) -> None:
    leave_all(scenario, work)
    damage(path_of(scenario, work, "shear"))
    os.utime(path_of(scenario, work, "shear"))
    assert actions(scenario, work, "shear")[0] == ("begin", "unreadable")


@pytest.mark.parametrize("failed", [False, True])
def test_a_sound_checkpoint_is_gone_on_from(scenario: Scenario, work: Work, failed: bool) -> None:
    """From 40 s to 60 s it did 1 of 10 time units; 7 are left."""
    leave_all(scenario, work)
    run = of(scenario, "shear")
    path_of(scenario, work, "shear").unlink()
    work.stop("shear", run, [(40.0, 2.0, 100), (60.0, 3.0, 200)], written=time.time() - 50)
    if failed:
        with suppress(NumericalError), failure_recorded(work.folder("shear"), run):
            raise NumericalError("tether", 0, 201, "is not finite")
    made = make_plan(scenario, work.results)
    (task,) = [task for task in made.runs if task.is_open]
    assert (task.stage, task.run, task.action, task.reason) == ("shear", run, "resume", "missing")
    assert (task.fraction, task.core_seconds) == (0.3, 140.0)
    assert made.chain == (task,)


def test_a_checkpoint_that_tells_no_rate_leaves_its_part_of_the_estimate(
    scenario: Scenario, work: Work
) -> None:
    leave_all(scenario, work)
    for number in range(4):
        path_of(scenario, work, "shear", number).unlink()
    work.stop("shear", of(scenario, "shear"), [(0.0, 4.0, 100)])
    tasks = [task for task in make_plan(scenario, work.results).runs if task.stage == "shear"]
    assert tasks[0].fraction == 0.4
    row = scenario.stage_table("shear")[tasks[0].run]
    whole = shipped().estimate("shear", row.parameters).core_seconds
    assert tasks[0].core_seconds == pytest.approx(0.6 * whole)


def test_a_checkpoint_is_passed_over_where_the_parent_is_made_anew(
    scenario: Scenario, work: Work
) -> None:
    leave_all(scenario, work)
    renew(path_of(scenario, work, "ageing"), code=OLD)
    path_of(scenario, work, "shear").unlink()
    work.stop("shear", of(scenario, "shear"))
    assert actions(scenario, work, "shear")[:2] == [BEGIN, RERUN]


def test_what_somebody_works_on_is_running(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    path_of(scenario, work, "shear").unlink()
    with run_lock(work.folder("shear"), of(scenario, "shear")):
        (task,) = [task for task in make_plan(scenario, work.results).runs if task.is_open]
    assert (task.action, task.run) == ("running", of(scenario, "shear"))
    assert task.core_seconds > 0


def test_finished_runs_correct_the_estimates(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    path_of(scenario, work, "shear").unlink()
    made = make_plan(scenario, work.results)
    table = scenario.stage_table("shear")
    found = [shipped().estimate("shear", row.parameters).core_seconds for row in table.values()]
    mean = (found[1] * found[2] * found[3]) ** (1 / 3)
    (task,) = [task for task in made.runs if task.is_open]
    assert task.core_seconds == pytest.approx(found[0] * SECONDS / mean)
    assert made.stages["shear"].finished == 3
    assert made.factor == made.stages["shear"].factor


def test_runs_by_other_code_correct_them_only_where_there_are_no_others(
    scenario: Scenario, work: Work
) -> None:
    for number, (code, seconds) in enumerate(((OLD, 10.0), (None, 1000.0), (None, 0.0))):
        run = of(scenario, "shear", number)
        leave(work.results, "shear", run, code=code, seconds=seconds)
    assert make_plan(scenario, work.results).stages["shear"].finished == 1
    path_of(scenario, work, "shear", 1).unlink()
    made = make_plan(scenario, work.results)
    assert made.stages["shear"].finished == 1
    assert made.runs[-4].core_seconds == pytest.approx(10.0)


def test_of_many_finished_runs_some_are_taken_from_everywhere(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_all(scenario, work)
    monkeypatch.setattr(module, "ENOUGH", 2)
    assert make_plan(scenario, work.results).stages["shear"].finished == 2
    monkeypatch.setattr(module, "ENOUGH", 3)
    assert make_plan(scenario, work.results).stages["shear"].finished == 2
    monkeypatch.setattr(module, "ENOUGH", 4)
    assert make_plan(scenario, work.results).stages["shear"].finished == 4


def test_new_is_what_another_scenario_does_not_have(
    scenario: Scenario, work: Work, tmp_path: Path
) -> None:
    leave_all(scenario, work)
    path = tmp_path / "other.yaml"
    path.write_text(runs_synthetic.SCENARIO.replace("[0.1, 0.5]", "[0.1, 0.3]"))
    other = load_scenario(str(path))
    made = make_plan(scenario, work.results, other)
    new = [(task.stage, task.run) for task in made.runs if task.new]
    assert new == [("shear", of(scenario, "shear", number)) for number in (1, 3)]
    gone = {of(other, "shear", number) for number in (1, 3)}
    assert made.gone == {
        "packing": (),
        "expansion": (),
        "ageing": (),
        "shear": tuple(sorted(gone)),
    }
    assert make_plan(scenario, work.results).gone is None


def test_a_run_that_continues_a_shorter_one_takes_the_rest(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    run, row = next(iter(scenario.stage_table("shear").items()))
    path_of(scenario, work, "shear").unlink()
    (whole,) = (task for task in make_plan(scenario, work.results).runs if task.run == run)
    assert (whole.action, whole.fraction) == ("begin", 0.0)
    reached = 0.25 * row.parameters.time_stepping.shear_time
    newest, _ = work.stop("shear", run, [(40.0, reached, 100)])
    trajectory, code = trajectory_id(row.parameters), fingerprint("shear")
    newest.rename(end_state_path(newest.parent, trajectory, code))
    (rest,) = (task for task in make_plan(scenario, work.results).runs if task.run == run)
    assert (rest.action, rest.fraction) == ("resume", 0.25)
    assert rest.core_seconds == pytest.approx(0.75 * whole.core_seconds)


def task(stage: str, run: str, parent: str | None, seconds: float, **others: Any) -> PlannedRun:
    words: Mapping[str, Any] = {
        "coordinates": {},
        "action": "begin",
        "reason": "missing",
        "fraction": 0.0,
        "new": True,
        "size": 0.0,
        **others,
    }
    return PlannedRun(stage, run, parent, core_seconds=seconds, **words)


def plan_of(*runs: PlannedRun) -> Plan:
    return Plan(runs, dict[str, StagePlan](), None)


BRANCHES = plan_of(
    task("packing", "a", None, 1.0),
    task("packing", "b", None, 2.0),
    task("expansion", "a", "a", 1.0),
    task("expansion", "b", "b", 2.0),
    task("ageing", "a", "a", 10.0),
    task("ageing", "b", "b", 3.0),
    task("shear", "a1", "a", 5.0),
    task("shear", "b1", "b", 4.0),
    task("shear", "b2", "b", 6.0),
)


def test_the_longest_chain_is_the_sum_of_its_links() -> None:
    """By a: 1 + 1 + 10 + 5 = 17, by b at most 2 + 2 + 3 + 6 = 13."""
    assert [(link.stage, link.run) for link in BRANCHES.chain] == [
        ("packing", "a"),
        ("expansion", "a"),
        ("ageing", "a"),
        ("shear", "a1"),
    ]


def test_a_chain_begins_where_something_is_left_to_do() -> None:
    tasks = [
        task(each.stage, each.run, each.parent, 0.0, action="reuse")
        if each.stage in ("packing", "expansion")
        else each
        for each in BRANCHES.runs
    ]
    assert [link.stage for link in plan_of(*tasks).chain] == ["ageing", "shear"]


@pytest.mark.parametrize("cores", [1, 2])
def test_the_wall_time_is_that_of_a_schedule(cores: int) -> None:
    """On 2 cores, by hand: a's ageing runs from 2 to 12 and its shear to 17.

    Beside it, b's expansion and ageing run from 2 to 7, b1 to 11 and b2 to 17. With b2 half as
    long again, which nobody knows before, it is the last, at 20.
    """
    longer = [*BRANCHES.runs[:-1], task("shear", "b2", "b", 9.0)]
    assert BRANCHES.wall_seconds(cores) == {1: 34.0, 2: 17.0}[cores]
    assert plan_of(*longer).wall_seconds(cores) == {1: 37.0, 2: 20.0}[cores]


def test_one_core_does_all_of_it_and_many_the_longest_chain() -> None:
    total = sum(each.core_seconds for each in BRANCHES.runs)
    longest = sum(link.core_seconds for link in BRANCHES.chain)
    assert BRANCHES.wall_seconds(1) == pytest.approx(total)
    assert BRANCHES.wall_seconds(100) == pytest.approx(longest)


def test_tasks_start_in_their_order_but_for_those_that_run_already() -> None:
    """A long one that starts last leaves a core idle."""
    tasks = [task("packing", name, None, 1.0) for name in "abcd"]
    long = task("packing", "e", None, 4.0)
    assert plan_of(*tasks, long).wall_seconds(2) == 6.0
    running = task("packing", "e", None, 4.0, action="running")
    assert plan_of(*tasks, running).wall_seconds(2) == 4.0


def test_tasks_of_higher_priority_start_first() -> None:
    tasks = [task("packing", name, None, 1.0) for name in "abcd"]
    long = task("packing", "e", None, 4.0, priority=1)
    assert plan_of(*tasks, long).wall_seconds(2) == 4.0


def test_no_tasks_take_no_time() -> None:
    assert plan_of().wall_seconds(3) == 0.0
    assert plan_of().chain == ()


def test_looking_changes_nothing(scenario: Scenario, work: Work) -> None:
    leave_all(scenario, work)
    renew(path_of(scenario, work, "ageing"), code=OLD)
    work.stop("shear", of(scenario, "shear"))

    def state() -> list[tuple[str, int, int]]:
        files = sorted(work.results.rglob("*"))
        return [(str(path), path.stat().st_mtime_ns, path.stat().st_ino) for path in files]

    before = state()
    make_plan(scenario, work.results)
    assert state() == before
