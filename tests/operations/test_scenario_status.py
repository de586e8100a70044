"""What is said of runs is what their files and locks say, and looking changes none of them."""

import os
import subprocess
import sys
import time
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from runs_synthetic import CHECKPOINT_BYTES, Work

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.errors import (
    CheckpointError,
    DatasetError,
    Interrupted,
    NumericalError,
    PackingError,
)
from softslip.operations import checkpoint_files, listing
from softslip.operations import scenario_status as module
from softslip.operations.checkpoint_files import RunProgress
from softslip.operations.failures import failure_path, failure_recorded
from softslip.operations.lock import holder_path, lock_path, run_lock
from softslip.operations.scenario_status import RunStatus, scenario_status
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.checkpoint import read_header

UNKNOWN = "f" * 16


def of(scenario: Scenario, stage: str, number: int = 0) -> str:
    return list(scenario.stage_table(stage))[number]


def status_of(scenario: Scenario, work: Work, stage: str, number: int = 0) -> RunStatus:
    run = of(scenario, stage, number)
    (one,) = [
        each
        for each in scenario_status(scenario, work.results).runs
        if (each.stage, each.run) == (stage, run)
    ]
    return one


def progress_of(scenario: Scenario, work: Work, stage: str = "shear") -> RunProgress:
    progress = status_of(scenario, work, stage).progress
    assert progress is not None
    return progress


def verdicts(scenario: Scenario, work: Work) -> dict[str, tuple[str, str]]:
    return {
        file.path.name: (file.verdict, file.stale)
        for file in scenario_status(scenario, work.results).checkpoints
    }


def test_all_is_missing_where_there_are_no_results(scenario: Scenario, work: Work) -> None:
    listed = scenario_status(scenario, work.results).runs
    assert [(one.stage, one.run) for one in listed] == [
        (stage, run) for stage in STAGES for run in scenario.stage_table(stage)
    ]
    assert {one.state for one in listed} == {"missing"}
    assert not work.results.exists(), "looking must make nothing"


def test_each_state_is_told_by_its_files(scenario: Scenario, work: Work) -> None:
    work.finish("shear", of(scenario, "shear", 0))
    work.stop("shear", of(scenario, "shear", 1))
    running = of(scenario, "shear", 2)
    with run_lock(work.folder("shear"), running):
        states = [status_of(scenario, work, "shear", number).state for number in range(4)]
        holder = status_of(scenario, work, "shear", 2).holder
        counts = scenario_status(scenario, work.results).counts("shear")
    assert states == ["done", "interrupted", "running", "missing"]
    assert holder is not None
    assert holder.process == os.getpid()
    expected = dict.fromkeys(("done", "running", "interrupted", "missing"), 1) | {"failed": 0}
    assert counts == expected
    assert status_of(scenario, work, "shear", 2).state == "missing", "its holder has let go"


MESSAGE = "is not finite; lower time_stepping.step"
ERROR = f"NumericalError: node_position[3] at step 7: {MESSAGE}"


def fail(scenario: Scenario, work: Work, error: BaseException, number: int = 0) -> None:
    """Begin a shear that ends in an error."""
    folder, run = work.folder("shear"), of(scenario, "shear", number)
    with suppress(type(error)), run_lock(folder, run), failure_recorded(folder, run):
        raise error


def test_a_run_that_recorded_its_error_has_failed(scenario: Scenario, work: Work) -> None:
    fail(scenario, work, NumericalError("node_position", np.int64(3), 7, MESSAGE))  # type: ignore
    one = status_of(scenario, work, "shear")
    assert (one.state, str(one.failure), one.progress) == ("failed", ERROR, None)
    failure = one.failure
    assert failure is not None
    assert (failure.error, failure.field, failure.index, failure.step) == (
        "NumericalError",
        "node_position",
        3,
        7,
    )
    assert failure.failed_at is not None
    age = datetime.now(UTC) - datetime.fromisoformat(failure.failed_at)
    assert abs(age) < timedelta(minutes=1)
    assert scenario_status(scenario, work.results).counts("shear")["failed"] == 1
    assert status_of(scenario, work, "ageing").state == "missing", "the failure is another run's"


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (MemoryError(), "MemoryError"),
        (OSError(28, "No space left on device"), "OSError: [Errno 28] No space left on device"),
        (PackingError("LAMMPS said\n  no"), "PackingError: LAMMPS said no"),
    ],
)
def test_errors_of_other_kinds_count_too(
    scenario: Scenario, work: Work, error: Exception, line: str
) -> None:
    fail(scenario, work, error)
    failure = status_of(scenario, work, "shear").failure
    assert str(failure) == line
    assert (failure.field, failure.index, failure.step) == (None, None, None)


@pytest.mark.parametrize("error", [Interrupted("stopped by SIGTERM"), KeyboardInterrupt()])
def test_an_interrupted_run_has_not_failed(
    scenario: Scenario, work: Work, error: BaseException
) -> None:
    fail(scenario, work, error)
    one = status_of(scenario, work, "shear")
    assert (one.state, one.failure, one.killed) == ("missing", None, None)
    work.stop("shear", of(scenario, "shear"), written=time.time() - 100)
    assert status_of(scenario, work, "shear").state == "interrupted"


def test_a_failure_ends_when_the_run_is_begun_again(scenario: Scenario, work: Work) -> None:
    fail(scenario, work, NumericalError("node_position", 3, 7, MESSAGE))
    folder, run = work.folder("shear"), of(scenario, "shear")
    with run_lock(folder, run), failure_recorded(folder, run):
        assert not failure_path(folder, run).exists()
    assert status_of(scenario, work, "shear").state == "missing"


def test_a_failed_run_keeps_its_checkpoint_and_its_record(scenario: Scenario, work: Work) -> None:
    run = of(scenario, "shear")
    work.stop("shear", run, [(40.0, 2.0, 100), (60.0, 3.0, 200)], written=time.time() - 100)
    lock_path(work.folder("shear"), run).touch()
    fail(scenario, work, NumericalError("node_position", 3, 7, MESSAGE))
    one = status_of(scenario, work, "shear")
    assert (one.state, one.progress and one.progress.step) == ("failed", 200)
    assert not leftovers(scenario, work), "the same command resumes from it"
    everything = leftovers(scenario, work, everything=True)
    assert everything[failure_path(work.folder("shear"), run).name] == "all are to be removed"


def test_a_run_that_is_done_or_at_work_has_not_failed(scenario: Scenario, work: Work) -> None:
    for number in range(2):
        fail(scenario, work, NumericalError("node_position", 3, 7, MESSAGE), number)
    work.finish("shear", of(scenario, "shear", 0))
    with run_lock(work.folder("shear"), of(scenario, "shear", 1)):
        both = [status_of(scenario, work, "shear", number) for number in range(2)]
    assert [(one.state, one.failure) for one in both] == [("done", None), ("running", None)]
    name = failure_path(work.folder("shear"), of(scenario, "shear", 0)).name
    assert leftovers(scenario, work)[name] == "its run is finished"


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"{}", b"\xff"])
def test_a_record_that_cannot_be_read_is_still_a_failure(
    scenario: Scenario, work: Work, content: bytes
) -> None:
    path = failure_path(work.folder("shear"), of(scenario, "shear"))
    path.parent.mkdir(parents=True)
    path.write_bytes(content)
    one = status_of(scenario, work, "shear")
    assert (one.state, str(one.failure)) == ("failed", f"Failure: {path.name} cannot be read")


def test_the_error_is_seen_where_it_cannot_be_recorded(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, run = work.folder("shear"), of(scenario, "shear")
    folder.mkdir(parents=True)

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("softslip.files.storage.unused_name", full)
    with pytest.raises(PackingError, match="too dense"), failure_recorded(folder, run):
        raise PackingError("too dense")
    assert status_of(scenario, work, "shear").state == "missing"


HOLD_AND_DIE = """
import os, signal, sys
from pathlib import Path
from softslip.operations.checkpoint_files import RunProgress
from softslip.operations.failures import failure_recorded
from softslip.operations.checkpoint_files import RunProgress
from softslip.operations.failures import failure_path, failure_recorded
from softslip.operations.lock import run_lock
folder, run = Path(sys.argv[1]), sys.argv[2]
with run_lock(folder, run), failure_recorded(folder, run):
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_run_is_told_from_a_failed_and_an_interrupted_one(
    scenario: Scenario, work: Work
) -> None:
    """A process that dies without a word leaves its name, and no record of a failure."""
    folder, run = work.folder("shear"), of(scenario, "shear")
    call = [sys.executable, "-c", HOLD_AND_DIE, str(folder), run]
    with subprocess.Popen(call) as process:
        process.wait()
    one = status_of(scenario, work, "shear")
    assert (one.state, one.holder, one.failure) == ("missing", None, None)
    assert one.killed is not None
    assert one.killed.process == process.pid
    work.stop("shear", run)
    one = status_of(scenario, work, "shear")
    assert one.state == "interrupted"
    assert one.killed is not None
    work.finish("shear", run)
    assert status_of(scenario, work, "shear").killed is None


def test_datasets_are_told_with_those_that_are_not_in_the_scenario(
    scenario: Scenario, work: Work
) -> None:
    path = work.finish("shear", UNKNOWN)
    path.write_bytes(b"12345")
    (told,) = scenario_status(scenario, work.results).datasets.items()
    assert told[0] == ("shear", UNKNOWN)
    assert (told[1].path, told[1].size, told[1].changed) == (path, 5, path.stat().st_mtime)


def test_a_run_made_anew_is_running_although_its_old_dataset_is_there(
    scenario: Scenario, work: Work
) -> None:
    work.finish("shear", of(scenario, "shear"))
    with run_lock(work.folder("shear"), of(scenario, "shear")):
        assert status_of(scenario, work, "shear").state == "running"


def test_coordinates_are_those_that_sharing_runs_share(scenario: Scenario, work: Work) -> None:
    assert status_of(scenario, work, "shear", 3).coordinates == {"seed": 2, "stress": 0.5}
    assert status_of(scenario, work, "ageing", 1).coordinates == {"seed": 2}
    assert status_of(scenario, work, "packing", 0).coordinates == {"seed": 1}


def test_progress_is_that_of_the_newest_checkpoint(scenario: Scenario, work: Work) -> None:
    ago = time.time() - 100
    work.stop("shear", of(scenario, "shear"), [(40.0, 2.0, 100), (60.0, 3.0, 200)], written=ago)
    progress = progress_of(scenario, work)
    assert (progress.time, progress.end, progress.step) == (3.0, 10.0, 200)
    assert progress.fraction == 0.3
    assert progress.restarts == 0
    assert progress.written == ago


def test_rate_and_rest_follow_from_the_last_stretch(scenario: Scenario, work: Work) -> None:
    """From 40 s to 60 s a stopped run did 100 steps and 1 of 10 time units; 7 are left."""
    work.stop("shear", of(scenario, "shear"), [(40.0, 2.0, 100), (60.0, 3.0, 200)])
    progress = progress_of(scenario, work)
    assert progress.rate == 5.0
    assert progress.remaining == 140.0


def test_rate_and_rest_follow_from_the_whole_where_there_is_one_checkpoint(
    scenario: Scenario, work: Work
) -> None:
    work.stop("shear", of(scenario, "shear"), [(40.0, 2.0, 100)])
    progress = progress_of(scenario, work)
    assert progress.rate == 2.5
    assert progress.remaining == 160.0


@pytest.mark.parametrize("previous", [(39.9, 1.0, 99), (40.0, 2.0, 100), (20.0, 2.0, 99)])
def test_rate_and_rest_follow_from_the_whole_where_the_last_stretch_says_nothing(
    scenario: Scenario, work: Work, previous: tuple[float, float, int]
) -> None:
    work.stop("shear", of(scenario, "shear"), [previous, (40.0, 2.0, 100)])
    progress = progress_of(scenario, work)
    assert progress.rate == 2.5
    assert progress.remaining == 160.0


@pytest.mark.parametrize(("ago", "left"), [(30, 110), (1000, 0), (-1000, 140)])
def test_a_running_one_has_gone_on_since_its_checkpoint(
    scenario: Scenario, work: Work, ago: int, left: int
) -> None:
    run = of(scenario, "shear")
    points = [(40.0, 2.0, 100), (60.0, 3.0, 200)]
    work.stop("shear", run, points, written=time.time() - ago)
    with run_lock(work.folder("shear"), run):
        # Looking takes far less than a second.
        assert progress_of(scenario, work).remaining == pytest.approx(left, abs=1)


def test_rate_and_rest_are_unknown_before_the_first_step(scenario: Scenario, work: Work) -> None:
    work.stop("shear", of(scenario, "shear"), [(0.0, 0.0, 0)])
    progress = progress_of(scenario, work)
    assert (progress.rate, progress.remaining, progress.fraction) == (None, None, 0.0)


def test_restarts_are_counted(scenario: Scenario, work: Work) -> None:
    for _ in range(3):
        work.stop("shear", of(scenario, "shear"), [(40.0, 2.0, 100)])
    assert progress_of(scenario, work).restarts == 2


def test_a_damaged_checkpoint_is_told_and_the_one_before_used(
    scenario: Scenario, work: Work
) -> None:
    run = of(scenario, "shear")
    newest, previous = work.stop("shear", run, [(40.0, 2.0, 100), (60.0, 3.0, 200)])
    newest.write_bytes(newest.read_bytes()[:150])
    one = status_of(scenario, work, "shear")
    assert (one.state, one.damaged, one.progress.step) == ("interrupted", 1, 100)
    assert verdicts(scenario, work) == {newest.name: ("damaged", ""), previous.name: ("valid", "")}
    previous.write_bytes(b"")
    one = status_of(scenario, work, "shear")
    assert (one.state, one.damaged, one.progress) == ("missing", 2, None), "it begins anew"


def test_a_checkpoint_under_the_name_of_another_run_is_damaged(
    scenario: Scenario, work: Work
) -> None:
    newest, _ = work.stop("shear", of(scenario, "shear", 0))
    other = newest.with_name(newest.name.replace(*(of(scenario, "shear", n) for n in (0, 1))))
    newest.rename(other)
    assert verdicts(scenario, work) == {other.name: ("damaged", "")}
    assert status_of(scenario, work, "shear", 1).state == "missing"


def test_stale_checkpoints_are_told_from_those_to_go_on_from(
    scenario: Scenario, work: Work
) -> None:
    finished, outdated, waiting = (of(scenario, "shear", number) for number in range(3))
    code = fingerprint("shear")
    for run, by in ((finished, code), (UNKNOWN, code), (outdated, "0" * 16), (waiting, code)):
        work.stop("shear", run, code=by)
    work.finish("shear", finished)
    assert verdicts(scenario, work) == {
        f"{finished}.{code}.checkpoint": ("stale", "its run is finished"),
        f"{UNKNOWN}.{code}.checkpoint": ("stale", "its run is not in the scenario"),
        f"{outdated}.{'0' * 16}.checkpoint": ("stale", "the code of its stage has changed"),
        f"{waiting}.{code}.checkpoint": ("valid", ""),
    }
    states = [status_of(scenario, work, "shear", number).state for number in range(3)]
    assert states == ["done", "missing", "interrupted"]
    assert len(scenario_status(scenario, work.results).stale) == 3


def test_a_run_of_one_stage_is_foreign_to_the_others(scenario: Scenario, work: Work) -> None:
    newest, _ = work.stop("ageing", of(scenario, "shear"))
    assert verdicts(scenario, work) == {newest.name: ("stale", "its run is not in the scenario")}


@pytest.mark.parametrize("code", ["0" * 16, None])
@pytest.mark.parametrize("foreign", [False, True])
def test_nothing_of_a_run_at_work_is_stale(
    scenario: Scenario, work: Work, code: str | None, foreign: bool
) -> None:
    run = UNKNOWN if foreign else of(scenario, "shear")
    work.finish("shear", run)
    work.stop("shear", run, code=code)
    with run_lock(work.folder("shear"), run):
        looked = scenario_status(scenario, work.results)
        assert [file.verdict for file in looked.checkpoints] == ["valid"]
        assert not any(run in file.path.name for file in looked.leftovers()), looked.leftovers()
        if not foreign:
            assert status_of(scenario, work, "shear").progress is not None
    assert not scenario_status(scenario, work.results).runs[-1].holder
    assert len(scenario_status(scenario, work.results).stale) == 1


def test_other_files_are_no_checkpoints(scenario: Scenario, work: Work) -> None:
    folder = work.folder("shear")
    folder.mkdir(parents=True)
    for name in ("notes.txt", f"{UNKNOWN}.checkpoint", f".{UNKNOWN}.a.checkpoint.x.part"):
        (folder / name).touch()
    (folder / f"{UNKNOWN}.{UNKNOWN}.checkpoint").mkdir()
    looked = scenario_status(scenario, work.results)
    assert not looked.checkpoints
    assert not looked.leftovers(everything=True)


def test_a_checkpoint_that_goes_while_it_is_looked_at_is_not_damaged(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    work.stop("shear", of(scenario, "shear"))

    def gone(path: Path) -> object:
        path.unlink()
        raise CheckpointError("cannot be read")

    monkeypatch.setattr(checkpoint_files, "read_header", gone)
    assert not scenario_status(scenario, work.results).checkpoints


def test_a_run_that_ends_meanwhile_is_never_missing(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = of(scenario, "shear")
    newest, _ = work.stop("shear", run)
    files = listing.list_files

    def end_after_first_look(folder: Path):  # type: ignore[no-untyped-def]
        seen = list(files(folder))
        if folder.is_relative_to(work.results / "shear") and newest.exists():
            work.finish("shear", run)
            newest.unlink()
        return iter(seen)

    monkeypatch.setattr(listing, "list_files", end_after_first_look)
    assert status_of(scenario, work, "shear").state == "done"


def test_a_folder_that_is_a_file_is_refused_in_one_line(scenario: Scenario, work: Work) -> None:
    work.results.mkdir()
    (work.results / "shear").write_text("")
    with pytest.raises(DatasetError, match=r"^[^\n]*shear[^\n]*: cannot be read \([^\n]*\)$"):
        scenario_status(scenario, work.results)


def leftovers(scenario: Scenario, work: Work, everything: bool = False) -> dict[str, str]:
    return {
        file.path.name: file.reason
        for file in scenario_status(scenario, work.results).leftovers(everything)
    }


def test_left_over_is_what_no_run_goes_on_from(scenario: Scenario, work: Work) -> None:
    finished, stopped, missing = (of(scenario, "shear", number) for number in range(3))
    folder = work.folder("shear")
    stale, _ = work.stop("shear", finished)
    kept, _ = work.stop("shear", stopped)
    work.finish("shear", finished)
    for run in (finished, stopped, missing):
        lock_path(folder, run).touch()
        holder_path(folder, run).write_text("{}")
    locks = {
        path(folder, run).name: "nobody holds it"
        for run in (finished, missing)
        for path in (lock_path, holder_path)
    }
    expected = {stale.name: "its run is finished"} | locks
    assert leftovers(scenario, work) == expected
    others = {path(folder, stopped).name: "nobody holds it" for path in (lock_path, holder_path)}
    everything = expected | others | {kept.name: "all are to be removed"}
    assert leftovers(scenario, work, everything=True) == everything


def test_parts_are_left_over_after_a_day(scenario: Scenario, work: Work) -> None:
    run = of(scenario, "shear")
    beside = f"shear/checkpoints/.{run}.checkpoint.x3.part"
    names = [".flow_curve.nc.x1.part", f"shear/.{run}.nc.x2.part", beside]
    for name in names:
        for age, mark in ((86000, "young"), (87000, "old")):
            path = work.results / name.replace(".part", f"{mark}.part")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
            os.utime(path, (time.time() - age,) * 2)
    old = {Path(name).name.replace(".part", "old.part") for name in names}
    reason = "was never completed"
    assert leftovers(scenario, work) == dict.fromkeys(old, reason)
    newest, _ = work.stop("shear", run)
    assert leftovers(scenario, work) == dict.fromkeys(old, reason), "it goes on without them"
    newest.unlink()
    with run_lock(work.folder("shear"), run):
        assert list(leftovers(scenario, work)) == [".flow_curve.nc.x1old.part"]


def test_looking_changes_nothing(scenario: Scenario, work: Work) -> None:
    for number in range(3):
        work.stop("shear", of(scenario, "shear", number), code=None if number else "0" * 16)
    work.finish("shear", of(scenario, "shear", 1))
    holder_path(work.folder("shear"), of(scenario, "shear")).write_text("{")

    def state() -> list[tuple[str, int, int]]:
        files = sorted(work.results.rglob("*"))
        return [(str(path), path.stat().st_mtime_ns, path.stat().st_ino) for path in files]

    before = state()
    scenario_status(scenario, work.results).leftovers(everything=True)
    assert state() == before


def test_sizes_are_those_of_the_files(scenario: Scenario, work: Work) -> None:
    newest, _ = work.stop("shear", of(scenario, "shear"))
    (file,) = scenario_status(scenario, work.results).checkpoints
    assert file.size == newest.stat().st_size > CHECKPOINT_BYTES
    assert file.header == read_header(newest)


def test_arrays_and_code_are_left_alone_where_nobody_needs_them(
    scenario: Scenario, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Thousands of finished runs cost a look into their folders and no more."""
    for number in range(4):
        work.finish("shear", of(scenario, "shear", number))
        work.stop("shear", of(scenario, "shear", number))

    def never(*_: object) -> None:
        pytest.fail("nothing but the names of files was needed")

    monkeypatch.setattr(checkpoint_files, "read_header", never)
    monkeypatch.setattr(checkpoint_files, "fingerprint", never)
    monkeypatch.setattr(module, "holder_of", never)
    assert scenario_status(scenario, work.results).counts("shear")["done"] == 4


def test_the_solver_is_not_loaded() -> None:
    heavy = ["numba", "netCDF4", "matplotlib", "lammps"]
    listed = f"[name for name in {heavy} if name in sys.modules]"
    script = f"import sys, softslip.operations.scenario_status\nprint({listed})"
    call = [sys.executable, "-c", script]
    said = subprocess.run(call, capture_output=True, text=True, check=True).stdout
    assert said == "[]\n"


def test_ends_of_runs_are_kept_until_all_is_to_be_removed_or_the_code_changes(
    scenario: Scenario, work: Work
) -> None:
    folder = work.folder("shear")
    folder.mkdir(parents=True)
    ours = folder / f"{'a' * 16}.{fingerprint('shear')}.end.checkpoint"
    outdated = folder / f"{'a' * 16}.{'0' * 16}.end.checkpoint"
    for path in (ours, outdated):
        path.write_bytes(b"12345")
    status = scenario_status(scenario, work.results)
    assert not status.checkpoints
    assert [file.path for file in status.leftovers()] == [outdated]
    assert {file.path for file in status.leftovers(everything=True)} == {ours, outdated}
    assert {file.run for file in status.leftovers(everything=True)} == {""}
