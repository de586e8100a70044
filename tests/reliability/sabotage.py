"""What is done to a child before it works, and work that only these tests want done."""

import json
import os
import resource
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr

from softslip.errors import CheckpointError, DatasetError
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST, read_dataset
from softslip.simulation import packing
from softslip.simulation.checkpoint import SUFFIX, read_header
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.simulation.checkpointer import Checkpointer

NOBODY = 65534

SOUND, REFUSED, DIFFERENT, RUDE = 0, 3, 4, 5
"""What a reader makes of a file that was tampered with: exit statuses of `read_*`."""


def tell_steps(path: str) -> None:
    """Append the time and the step whenever a stage could be kept; this survives any death."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    save = Checkpointer.save_if_due

    def telling(self: Any, state: Any, *others: Any) -> None:
        os.write(file, f"{time.monotonic():.6f} {state.step}\n".encode())
        save(self, state, *others)

    Checkpointer.save_if_due = telling


def limit_size(size: int, packed: bool = False) -> None:
    """Let no file grow beyond a size, as a full disk would.

    MPI, which LAMMPS starts, dies by itself where it cannot make files in memory: where discs are
    ``packed``, the limit holds from then on.
    """
    limit = (size, size)
    if not packed:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        return
    pack = packing.pack

    def packing_first(*arguments: Any) -> xr.Dataset:
        discs = pack(*arguments)
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        return discs

    packing.pack = packing_first


def become_nobody() -> None:
    """Lose the rights of root."""
    os.setgroups([])
    os.setgid(NOBODY)
    os.setuid(NOBODY)


def slow_down(seconds: float) -> None:
    """Wait at each step, so that others find the stage at work."""
    save = Checkpointer.save_if_due

    def waiting(self: Any, *others: Any) -> None:
        time.sleep(seconds)
        save(self, *others)

    Checkpointer.save_if_due = waiting


def die_with_checkpoints(folder: str, number: int) -> None:
    """Die at the step that leaves so many checkpoints in a folder."""
    save = Checkpointer.save_if_due

    def saving(self: Any, *others: Any) -> None:
        save(self, *others)
        if len(list(Path(folder).rglob(f"*{SUFFIX}"))) == number:
            os.kill(os.getpid(), signal.SIGKILL)

    Checkpointer.save_if_due = saving


BOUNDARIES = {
    "open": (os, "open"),
    "mkdir": (os, "mkdir"),
    "fsync": (os, "fsync"),
    "replace": (os, "replace"),
    "rename": (os, "rename"),
    "unlink": (os, "unlink"),
    "write_bytes": (Path, "write_bytes"),
    "write_text": (Path, "write_text"),
    "to_netcdf": (xr.Dataset, "to_netcdf"),
}
"""Where a file begins, grows, is made to last, gets its name or goes."""

WRITERS = ("write_bytes", "write_text", "to_netcdf")


def at_boundaries(log: str | None = None, number: int = -1, when: str = "before") -> None:
    """Count the calls that change files, and die at one of them.

    Parameters
    ----------
    log
        File that the name of each call is appended to, with the size of what it wrote.
    number
        Of the call to die at.
    when
        "before" it, "after" it, or "within" it, where it writes: when half is written.
    """
    count = 0
    pristine = os.open
    calls = pristine(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND) if log else None

    def wrap(name: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def wrapped(*args: Any, **others: Any) -> Any:
            nonlocal count
            if name == "open" and not args[1] & os.O_CREAT:
                return original(*args, **others)
            place, count = count, count + 1
            if place == number and when == "before":
                os.kill(os.getpid(), signal.SIGKILL)
            if place == number and when.startswith("within"):
                # The kernel kills whoever writes beyond the limit, if they let it.
                signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
                resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
                limit_size(int(when.removeprefix("within ")))
            try:
                return original(*args, **others)
            finally:
                if calls is not None:
                    size = written_by(name, args)
                    os.write(calls, f"{json.dumps([name, size])}\n".encode())
                if place == number:
                    os.kill(os.getpid(), signal.SIGKILL)

        return wrapped

    for name, (owner, attribute) in BOUNDARIES.items():
        setattr(owner, attribute, wrap(name, getattr(owner, attribute)))


def written_by(name: str, args: tuple[Any, ...]) -> int:
    """Return the size of the file that a writer has just written."""
    if name not in WRITERS:
        return 0
    path = args[0] if isinstance(args[0], Path) else args[1]
    return Path(path).stat().st_size


def read_damaged_dataset(path: str, pristine: str, stage: str) -> int:
    """Read a dataset that was tampered with, and say what became of it."""
    whole = read_dataset(Path(pristine), stage=stage)
    try:
        found = read_dataset(Path(path), stage=stage, run=whole.attrs["run"])
    except DatasetError as error:
        print(error)
        return RUDE if "\n" in str(error) else REFUSED
    same = found.identical(whole) and all(
        found[name].dtype == whole[name].dtype for name in whole.variables
    )
    return SOUND if same else DIFFERENT


def check_dataset(path: str, stage: str, digest: str) -> int:
    """Make sure that a dataset under a final name is whole and has the right content."""
    found = read_dataset(Path(path), stage=stage)
    assert RECORD_DIGEST in found.attrs
    assert found.attrs[CONTENT_DIGEST] == digest, f"{path}: {found.attrs[CONTENT_DIGEST]}"
    return 0


def read_damaged_checkpoint(path: str, pristine: str) -> int:
    """Load a checkpoint that was tampered with, and say what became of it."""
    whole = loaded(Path(pristine))
    try:
        found = loaded(Path(path), like=Path(pristine))
    except CheckpointError as error:
        print(error)
        return RUDE if "\n" in str(error) else REFUSED
    same = whole.keys() == found.keys() and all(
        whole[name].dtype == found[name].dtype
        and whole[name].shape == found[name].shape
        and whole[name].tobytes() == found[name].tobytes()
        for name in whole
    )
    return SOUND if same else DIFFERENT


def loaded(path: Path, like: Path | None = None) -> Any:
    """Return what `Checkpoints.load` makes of a single file, refusing what it removes."""
    identity = read_header(like or path).identity
    said: list[str] = []
    with tempfile.TemporaryDirectory(prefix="softslip-reliability-") as folder:
        checkpoints = Checkpoints(Path(folder), identity, said.append)
        shutil.copyfile(path, checkpoints.newest)
        arrays = checkpoints.load()
    if arrays is None:
        raise CheckpointError(said[0])
    return arrays


def check_checkpoint(path: str) -> int:
    """Make sure that a checkpoint under a final name is whole."""
    assert loaded(Path(path))
    return 0


def signal_again(seconds: float) -> None:
    """Send a second SIGTERM after some time, while the first is still being obeyed."""
    parent = os.getpid()
    if not os.fork():
        time.sleep(seconds)
        os.kill(parent, signal.SIGTERM)
        os._exit(0)
