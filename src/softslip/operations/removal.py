"""Removing what nobody needs any more, never from under the hands of somebody at work."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from softslip.errors import LockedError, StorageError
from softslip.files.layout import CHECKPOINTS
from softslip.operations.lock import claim, lock_path
from softslip.operations.status import FINISHED, Leftover


def removed(
    results: Path, leftovers: Iterable[Leftover], say: Callable[[str], None]
) -> Iterator[Leftover]:
    """Remove files, each under the lock of the run that it is of, and yield those that were there.

    Parameters
    ----------
    results
        Folder of the scenario's results.
    leftovers
        What is to be removed; see `operations.status.Survey.leftovers`.
    say
        Told, in a sentence, what is kept because somebody works on it.

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
            yield from _removed_of(results / stage, run, files)
        except LockedError as error:
            count = "1 file" if len(files) == 1 else f"{len(files)} files"
            say(f"kept {count} of {stage}: {error}")


def _removed_of(folder: Path, run: str, files: list[Leftover]) -> Iterator[Leftover]:
    """Remove files of one run, whose lock is taken first and whose lock file goes last."""
    with claim(folder / CHECKPOINTS, run):
        if not (folder / f"{run}.nc").exists():
            # It is being made anew since it was looked at.
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
