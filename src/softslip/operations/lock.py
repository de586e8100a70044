"""One process a run: a lock that the kernel frees when its holder dies, and the holder's name.

The lock is an advisory lock of the kernel (flock) on ``RUN.lock``, taken with the library filelock,
so that a file left by a killed process locks nothing. The holder's name is in ``RUN.holder.json``,
because the content of the lock file belongs to the library. Where flock holds only within one host
(a file system mounted with local locks), so does this.
"""

import errno
import json
import os
import shlex
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from fcntl import LOCK_NB, LOCK_SH, flock
from pathlib import Path

import psutil
from filelock import Timeout, UnixFileLock

from softslip.errors import LockedError, StorageError
from softslip.files.storage import replacing

LOCK_SUFFIX, HOLDER_SUFFIX = ".lock", ".holder.json"

GRACE = 0.25
"""Seconds for which a lock that is held is asked for again.

Looking whether it is held takes it for microseconds, and cleaning up for as long as a few files
take to delete; a run that starts just then must not fail.
"""

_POLL = 0.01
"""Seconds between two attempts."""

_ATTEMPTS = 10
"""How often a lock file that was replaced is opened again: more is no accident."""

_CLOCK_SLACK = 2.0
"""Seconds by which a clock may have been set: the start of a process is reckoned from the boot."""

_STAMP = "%Y-%m-%dT%H:%M:%SZ"


@dataclass(frozen=True)
class Holder:
    """Who holds a lock; all None where its file cannot be read.

    Attributes
    ----------
    process
        Process ID.
    host
        Where it runs.
    started
        When it took the lock.
    command
        What was called.
    """

    process: int | None = None
    host: str | None = None
    started: datetime | None = None
    command: str | None = None

    def __str__(self) -> str:
        """Return a description of the process."""
        if self.process is None or self.started is None:
            return "a process that left no readable name"
        return f"process {self.process} on {self.host} (since {self.started:{_STAMP}})"


def lock_path(folder: Path, run: str) -> Path:
    """Return the file that a run's lock is on."""
    return folder / f"{run}{LOCK_SUFFIX}"


def holder_path(folder: Path, run: str) -> Path:
    """Return the file that says who holds a run's lock."""
    return folder / f"{run}{HOLDER_SUFFIX}"


@contextmanager
def run_lock(folder: Path, run: str) -> Iterator[None]:
    """Hold a run's lock while the block runs, under this process's name.

    The name of a dead process is replaced, with a line on standard error.

    Parameters
    ----------
    folder
        Where the lock is; made where it is missing.
    run
        Name of the run.

    Raises
    ------
    LockedError
        When another process works on the run, or this one does already; also when the folder
        cannot hold a lock.
    """
    with claim(folder, run):
        path = holder_path(folder, run)
        if path.exists():
            dead = read_holder(path)
            print(f"{run}: taking over from {dead}, which was killed", file=sys.stderr)
        _write_holder(path)
        try:
            yield
        finally:
            # A name that cannot be removed is taken for that of a dead process.
            with suppress(OSError):
                path.unlink()


@contextmanager
def claim(folder: Path, run: str) -> Iterator[None]:
    """Hold a run's lock without leaving a name, for what takes a moment.

    Raises
    ------
    LockedError
        See `run_lock`.
    """
    path = lock_path(folder, run)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = _acquired(path)
    except Timeout:
        raise _refusal(folder, run) from None
    except OSError as error:
        # Any system that cannot lock ends here: a run that nothing protects is never started.
        raise LockedError(
            f"{path}: cannot be locked ({error.strerror or error}); put the results where files "
            "can be written and locked"
        ) from error
    try:
        yield
    finally:
        lock.release()


class _ReplacedError(Exception):
    """The file that was locked is not the one of that name any more."""


def _acquired(path: Path) -> UnixFileLock:
    """Return the lock of a file, held."""

    def check_name(descriptor: int) -> None:
        # `softslip clean` removes lock files. Where a file system keeps a removed file for those
        # who have it open (NFS), its lock can be had and protects nothing.
        try:
            named = os.path.samestat(os.fstat(descriptor), path.stat())
        except FileNotFoundError:
            named = False
        if not named:
            raise _ReplacedError

    # By name, because `FileLock` is a lock by presence where flock is missing; and without its
    # change to such a lock on file systems that do not know flock.
    lock = UnixFileLock(
        path,
        thread_local=False,
        fallback_to_soft=False,
        preserve_lock_file=True,
        on_acquired=check_name,
    )
    for _ in range(_ATTEMPTS):
        with suppress(_ReplacedError):
            lock.acquire(timeout=GRACE, poll_interval=_POLL)
            return lock
    raise OSError(errno.ESTALE, "another file has taken its place whenever it was locked")


def _refusal(folder: Path, run: str) -> LockedError:
    """Return the error that says who works on a run, and what to do."""
    holder = read_holder(holder_path(folder, run))
    remedy = f"wait for it to end, or stop it there with: kill {holder.process}"
    if holder.process is None:
        path = shlex.quote(str(lock_path(folder, run)))
        remedy = f"wait for it to end, or find it on its host with: fuser {path}"
    return LockedError(f"run {run} is being worked on by {holder}; {remedy}")


def _write_holder(path: Path) -> None:
    words = {
        "process": os.getpid(),
        "host": socket.gethostname(),
        "started": f"{datetime.now(UTC):{_STAMP}}",
        "command": shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]),
    }
    try:
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(words) + "\n")
    except StorageError as error:
        raise LockedError(f"{error}; the run was not started") from error


def read_holder(path: Path) -> Holder:
    """Return who a file says holds a lock, whatever state the file is in."""
    try:
        words = json.loads(path.read_bytes())
        process, host, started = words["process"], words["host"], words["started"]
        moment = datetime.strptime(started, _STAMP).replace(tzinfo=UTC)
        # Numbers that name no process would end up in a command that kills.
        if not (type(process) is int and process > 0 and isinstance(host, str)):
            return Holder()
        return Holder(process, host, moment, str(words.get("command", "")))
    except (OSError, ValueError, TypeError, LookupError, AttributeError):
        return Holder()


def holder_of(folder: Path, run: str) -> Holder | None:
    """Return which process works on a run, None where none does; nothing is disturbed.

    A live process of this host that is old enough to be the named one is believed to hold the
    lock. Otherwise (another host, a process that is gone or whose number was reused, a file that
    cannot be read) the kernel is asked, by a shared lock that is released at once: two who look do
    not see each other, and one who starts asks again for `GRACE` seconds. Without a name, nothing
    is asked.
    """
    path = holder_path(folder, run)
    if not path.exists():
        return None
    holder = read_holder(path)
    return holder if _lives(holder) or _is_held(lock_path(folder, run)) else None


def _lives(holder: Holder) -> bool:
    """Whether a holder is a process of this host, and not another that got its number later."""
    if holder.process is None or holder.started is None or holder.host != socket.gethostname():
        return False
    try:
        process = psutil.Process(holder.process)
        age_fits = process.create_time() <= holder.started.timestamp() + _CLOCK_SLACK
        # A process that has ended and was not yet waited for has lost its locks.
        return bool(age_fits and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False


def _is_held(path: Path) -> bool:
    """Whether the kernel refuses a lock, which leaves the file as it is."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    except OSError:
        return True  # Not ours to open: the name that was left stands.
    try:
        flock(descriptor, LOCK_SH | LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(descriptor)
    return False
