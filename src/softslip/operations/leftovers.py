"""Files that nobody needs any more, and their removal, never from under a process at work."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from softslip.errors import LockedError, StorageError
from softslip.files.layout import CHECKPOINTS
from softslip.messages import counted
from softslip.operations.lock import claim, lock_path

FINISHED = "its run is finished"
FOREIGN = "its run is not in the scenario"
OUTDATED = "the code of its stage has changed"
"""Why a checkpoint is stale."""

UNWANTED = "all are to be removed"
UNHELD = "nobody holds it"
INCOMPLETE = "was never completed"
"""Why other files are left over."""


@dataclass(frozen=True)
class Leftover:
    """A file that nobody needs any more.

    Attributes
    ----------
    path, size
        Where it is, and its bytes.
    stage, run
        Whose lock must be held to remove it; empty if nobody's.
    reason
        Why it is of no use.
    """

    path: Path
    size: int
    stage: str
    run: str
    reason: str


def remove(
    results: Path, leftovers: Iterable[Leftover], say: Callable[[str], None]
) -> Iterator[Leftover]:
    """Remove files, each under the lock of its run, and yield those that were still there.

    Parameters
    ----------
    results
        Folder of the scenario's results.
    leftovers
        What is to be removed; see `operations.scenario_status.ScenarioStatus.leftovers`.
    say
        Called with a sentence on what is not removed because a process works on it.

    Raises
    ------
    StorageError
        When a file cannot be removed.
    """
    by_run: defaultdict[tuple[str, str], list[Leftover]] = defaultdict(list)
    for file in leftovers:
        by_run[file.stage, file.run].append(file)
    for (stage, run), files in by_run.items():
        if not run:
            yield from filter(_unlinked, files)
            continue
        try:
            yield from _remove_of(results / stage, run, files)
        except LockedError as error:
            say(f"kept {counted(len(files), 'file')} of {stage}: {error}")


def _remove_of(folder: Path, run: str, files: list[Leftover]) -> Iterator[Leftover]:
    """Remove files of one run, whose lock is taken first and whose lock file goes last."""
    with claim(folder / CHECKPOINTS, run):
        if not (folder / f"{run}.nc").exists():
            # A rerun has begun since it was looked at.
            files = [file for file in files if file.reason != FINISHED]
        yield from filter(_unlinked, files)
        lock_path(folder / CHECKPOINTS, run).unlink(missing_ok=True)


def _unlinked(file: Leftover) -> bool:
    """Remove a file, and return whether it was still there."""
    try:
        file.path.unlink()
    except FileNotFoundError:
        return False
    except OSError as error:
        raise StorageError(f"{file.path}: cannot be removed ({error.strerror})") from error
    return True
