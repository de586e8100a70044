"""Two processes never work on one run, whatever has become of the one before."""

import errno
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

import filelock
import psutil
import pytest

from softslip.errors import LockedError
from softslip.operations import lock
from softslip.operations.lock import Holder, claim, holder_of, holder_path, lock_path, run_lock

RUN = "0123456789abcdef"
OWN = socket.gethostname()

HOLD = """
import sys
from pathlib import Path
from softslip.operations.lock import run_lock
with run_lock(Path(sys.argv[1]), sys.argv[2]):
    print("held", flush=True)
    sys.stdin.read()
"""

LOOK = """
import sys, time
from pathlib import Path
from softslip.operations import lock
folder, run = Path(sys.argv[1]), sys.argv[2]
flock, looks = lock.flock, 0

def slow(descriptor, operation):
    flock(descriptor, operation)
    time.sleep(0.003)

lock._lives = lambda holder: False  # So that the kernel is asked every time,
lock.flock = slow  # and that the answer takes long enough to be in the way.
print("looking", flush=True)
while not (folder / "enough").exists():
    lock.holder_of(folder, run)
    time.sleep(0.003)
    looks += 1
print(looks)
"""

RACE = """
import os, sys, time
from contextlib import suppress
from pathlib import Path
from softslip.errors import LockedError
from softslip.operations.lock import run_lock
folder, run, racers, wins = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])

def race():
    won = 0
    while won < wins:
        with suppress(LockedError), run_lock(folder, run):
            os.close(os.open(folder / "inside", os.O_CREAT | os.O_EXCL))
            count = int((folder / "count").read_text())
            time.sleep(0.002)
            (folder / "count").write_text(str(count + 1))
            (folder / "inside").unlink()
            won += 1

children = []
for _ in range(racers):
    child = os.fork()
    if not child:
        status = 1
        try:
            race()
            status = 0
        finally:
            os._exit(status)
    children.append(child)
sys.exit(sum(os.waitpid(child, 0)[1] != 0 for child in children))
"""


def process(script: str, *words: object) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", script, *map(str, words)]
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(command, text=True, **pipes)


@contextmanager
def another(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Hold the lock in another process, until the block ends or somebody kills it."""
    with process(HOLD, folder, RUN) as other:
        try:
            assert other.stdout.readline() == "held\n", other.stderr.read()
            yield other
        finally:
            other.kill()


def refusal(folder: Path) -> str:
    with pytest.raises(LockedError) as caught, run_lock(folder, RUN):
        pytest.fail("the lock was given twice")
    text = str(caught.value)
    assert "\n" not in text, text
    return text


def leave_word(folder: Path, **changed: object) -> None:
    words = {"process": os.getpid(), "host": OWN, "started": "2026-01-02T03:04:05Z", "command": "x"}
    folder.mkdir(parents=True, exist_ok=True)
    holder_path(folder, RUN).write_text(json.dumps(words | changed))


def now() -> str:
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"


def test_who_holds_it_leaves_word_and_takes_it_back(tmp_path: Path) -> None:
    folder = tmp_path / "shear" / "checkpoints"
    before = datetime.now(UTC).replace(microsecond=0)
    with run_lock(folder, RUN):
        words = json.loads(holder_path(folder, RUN).read_text())
        assert (words["process"], words["host"]) == (os.getpid(), OWN)
        assert before <= datetime.fromisoformat(words["started"]) <= datetime.now(UTC)
        assert Path(sys.argv[0]).name in words["command"]
    assert [path.name for path in folder.iterdir()] == [f"{RUN}.lock"]


def test_it_is_free_again_after_an_error_at_work(tmp_path: Path) -> None:
    with pytest.raises(KeyError), run_lock(tmp_path, RUN):
        raise KeyError
    assert not holder_path(tmp_path, RUN).exists()
    with run_lock(tmp_path, RUN):
        pass


def test_a_second_process_is_refused_with_who_where_since_when_and_what_to_do(
    tmp_path: Path,
) -> None:
    with another(tmp_path) as other:
        text = refusal(tmp_path)
        since = json.loads(holder_path(tmp_path, RUN).read_text())["started"]
        for part in (RUN, f"process {other.pid} on {OWN}", since, f"kill {other.pid}"):
            assert part in text, f"{part!r} is not in {text!r}"
        assert other.poll() is None, "the refused one must leave the other at work"
        assert holder_path(tmp_path, RUN).exists(), "and its word where it is"


def test_other_runs_are_free(tmp_path: Path) -> None:
    with another(tmp_path), run_lock(tmp_path, "f" * 16):
        pass


def test_a_second_time_in_one_process_is_refused(tmp_path: Path) -> None:
    with run_lock(tmp_path, RUN):
        assert f"process {os.getpid()} on {OWN}" in refusal(tmp_path)
        assert holder_path(tmp_path, RUN).exists()


def test_what_a_killed_process_leaves_is_taken_over_saying_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with another(tmp_path) as other:
        other.send_signal(signal.SIGKILL)
        other.wait()
    since = json.loads(holder_path(tmp_path, RUN).read_text())["started"]
    with run_lock(tmp_path, RUN):
        said = capsys.readouterr().err
        assert json.loads(holder_path(tmp_path, RUN).read_text())["process"] == os.getpid()
    assert said.count("\n") == 1
    for part in (RUN, f"process {other.pid} on {OWN}", since):
        assert part in said, f"{part!r} is not in {said!r}"


def test_nothing_is_said_where_nothing_was_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):
        with run_lock(tmp_path, RUN):
            pass
    assert capsys.readouterr().err == ""


UNREADABLE = (
    b"",
    b"{",
    b"[]",
    b"null",
    b"\xff\xfe",
    b'{"process": 12}',
    b'{"process": "12; reboot", "host": "a", "started": "2026-01-02T03:04:05Z"}',
    b'{"process": -1, "host": "a", "started": "2026-01-02T03:04:05Z"}',
    b'{"process": 12, "host": "a", "started": "yesterday"}',
)


@pytest.mark.parametrize("content", UNREADABLE)
def test_a_holder_that_cannot_be_read_is_still_refused_clearly(
    tmp_path: Path, content: bytes
) -> None:
    with claim(tmp_path, RUN):
        holder_path(tmp_path, RUN).write_bytes(content)
        text = refusal(tmp_path)
        assert "no readable name" in text
        assert f"fuser {lock_path(tmp_path, RUN)}" in text
        assert holder_of(tmp_path, RUN) == Holder()
    assert holder_of(tmp_path, RUN) is None


def test_a_holder_that_left_no_word_is_still_refused_clearly(tmp_path: Path) -> None:
    with claim(tmp_path, RUN):
        assert "no readable name" in refusal(tmp_path)


@pytest.mark.parametrize("content", UNREADABLE[:3])
def test_a_dead_holder_that_cannot_be_read_is_taken_over(
    tmp_path: Path, content: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    holder_path(tmp_path, RUN).write_bytes(content)
    with run_lock(tmp_path, RUN):
        assert "no readable name" in capsys.readouterr().err


def test_a_folder_that_cannot_be_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        assert re.search("cannot be locked .*where files can be written", refusal(folder))


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS, errno.EIO])
def test_no_run_is_started_where_nothing_can_be_locked(
    tmp_path: Path, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(descriptor: int, operation: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", fail)
    text = refusal(tmp_path)
    assert os.strerror(number) in text
    assert not holder_path(tmp_path, RUN).exists()


def test_no_run_is_started_that_nobody_could_see(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr("softslip.files.storage.unused_name", fail)
        assert os.strerror(errno.ENOSPC) in refusal(tmp_path)
    with run_lock(tmp_path, RUN):
        pass


def test_a_file_that_lost_its_name_while_it_was_locked_protects_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on NFS, where a removed file that is open keeps a name."""
    path, attempts = lock_path(tmp_path, RUN), []
    real = filelock._unix.lock_fd_nonblocking

    def remove_first(descriptor: int) -> bool:
        if not attempts:
            path.rename(tmp_path / ".nfs0001")
        attempts.append(descriptor)
        return bool(real(descriptor))

    monkeypatch.setattr("filelock._unix.lock_fd_nonblocking", remove_first)
    with run_lock(tmp_path, RUN):
        assert len(attempts) == 2
        with path.open() as file, pytest.raises(BlockingIOError):
            lock.flock(file, lock.LOCK_SH | lock.LOCK_NB)
    attempts.clear()

    def remove_always(descriptor: int) -> bool:
        path.rename(tmp_path / ".nfs0001")
        return bool(real(descriptor))

    monkeypatch.setattr("filelock._unix.lock_fd_nonblocking", remove_always)
    assert "whenever it was locked" in refusal(tmp_path)


def test_the_live_holder_is_seen_and_the_dead_one_is_not(tmp_path: Path) -> None:
    assert holder_of(tmp_path, RUN) is None
    with another(tmp_path) as other:
        found = holder_of(tmp_path, RUN)
        assert found is not None
        assert (found.process, found.host) == (other.pid, OWN)
        assert abs(datetime.now(UTC) - found.started) < timedelta(minutes=1)
        other.send_signal(signal.SIGKILL)
        # Not waited for, it becomes a zombie, whose locks are gone with the last of its threads.
        deadline = time.monotonic() + 5
        while holder_of(tmp_path, RUN) is not None:
            assert time.monotonic() < deadline, "a zombie is believed to be at work"
        assert psutil.Process(other.pid).status() == psutil.STATUS_ZOMBIE
    assert holder_of(tmp_path, RUN) is None
    assert holder_path(tmp_path, RUN).exists(), "looking must remove nothing"


def test_a_live_holder_of_this_host_is_believed_without_asking_the_kernel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(lock, "_is_held", asked.append)
    with run_lock(tmp_path, RUN):
        assert holder_of(tmp_path, RUN).process == os.getpid()
    assert not asked


@pytest.mark.parametrize(
    "changed",
    [
        {"host": "elsewhere"},
        {"process": 2**22 + 1},
        {"process": 10**30},
        # The number of a process that began long after the lock was taken.
        {"started": "2001-01-01T00:00:00Z"},
    ],
)
def test_where_the_word_settles_nothing_the_kernel_is_asked(
    tmp_path: Path, changed: dict[str, object]
) -> None:
    leave_word(tmp_path, **({"started": now()} | changed))
    assert holder_of(tmp_path, RUN) is None
    with claim(tmp_path, RUN):
        assert holder_of(tmp_path, RUN) is not None
    assert holder_of(tmp_path, RUN) is None


def test_where_the_kernel_cannot_be_asked_the_word_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_word(tmp_path, host="elsewhere", started=now())
    lock_path(tmp_path, RUN).touch()

    def fail(*_: object) -> None:
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(lock, "flock", fail)
    assert holder_of(tmp_path, RUN).host == "elsewhere"


def test_looking_changes_nothing(tmp_path: Path) -> None:
    leave_word(tmp_path, host="elsewhere", started=now())
    lock_path(tmp_path, RUN).write_text("content")

    def state() -> list[tuple[str, bytes, int, int]]:
        return [
            (path.name, path.read_bytes(), path.stat().st_mtime_ns, path.stat().st_ino)
            for path in sorted(tmp_path.iterdir())
        ]

    before = state()
    for _ in range(10):
        holder_of(tmp_path, RUN)
    assert state() == before


def test_looking_never_makes_a_start_fail(tmp_path: Path) -> None:
    with process(LOOK, tmp_path, RUN) as other:
        try:
            assert other.stdout.readline() == "looking\n", other.stderr.read()
            for _ in range(300):
                with run_lock(tmp_path, RUN):
                    pass
                # What is left by one that was killed is what others look at most closely.
                leave_word(tmp_path, host="elsewhere")
            (tmp_path / "enough").touch()
            said, wrong = other.communicate()
        finally:
            other.kill()
    assert not wrong
    assert int(said) > 20, "hardly anybody looked"


def test_of_twenty_processes_exactly_one_is_inside(tmp_path: Path) -> None:
    """A counter that each reads, waits and writes loses counts if two are ever inside."""
    racers, wins = 20, 3
    (tmp_path / "count").write_text("0")
    with process(RACE, tmp_path, RUN, racers, wins) as race:
        _, wrong = race.communicate(timeout=60)
    assert race.returncode == 0, wrong
    assert int((tmp_path / "count").read_text()) == racers * wins
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{RUN}.lock", "count"]
