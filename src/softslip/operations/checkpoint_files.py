"""The checkpoints beside a stage's datasets: which are of use, and how far their runs are."""

import re
import time
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from softslip.errors import CheckpointError
from softslip.files.layout import CHECKPOINTS
from softslip.operations.leftovers import FINISHED, FOREIGN, OUTDATED
from softslip.operations.listing import ListedFile
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.checkpoint import SUFFIX, Header, read_header

LEAST_STRETCH = 10.0
"""Seconds of work between two checkpoints below which their difference says too little: one is
written the moment a signal comes."""

_CHECKPOINT = re.compile(rf"([0-9a-f]+)\.([0-9a-f]+)(?:\.previous)?{re.escape(SUFFIX)}")


@dataclass(frozen=True)
class CheckpointFile:
    """A file with a checkpoint.

    Attributes
    ----------
    path, size
        Where it is, and its bytes.
    stage, run
        What it is of, by its name.
    stale
        Why it is of no use any more, empty if it may be.
    header
        What it says of itself; None if it is damaged, or stale and was not opened. Its arrays are
        never read: whether they are intact is found out when the run resumes.
    """

    path: Path
    size: int
    stage: str
    run: str
    stale: str
    header: Header | None

    @property
    def verdict(self) -> str:
        """``valid``, ``damaged`` or ``stale``."""
        if self.stale:
            return "stale"
        return "damaged" if self.header is None else "valid"


@dataclass(frozen=True)
class RunProgress:
    """How far a run is, by its newest checkpoint.

    Attributes
    ----------
    time, end
        Time reached, and that at which the stage ends [time unit].
    step
        Steps since the stage began.
    restarts
        How often it was resumed.
    written
        POSIX time of the checkpoint.
    rate
        Steps a second of work lately, None where it is not known.
    remaining
        Seconds of work that are left at the latest rate, None where that is not known. For a
        running one, the time since its checkpoint is taken off.
    """

    time: float
    end: float
    step: int
    restarts: int
    written: float
    rate: float | None
    remaining: float | None

    @property
    def fraction(self) -> float:
        """Part of the stage's time that has passed, from 0 to 1."""
        return min(max(self.time / self.end, 0.0), 1.0) if self.end > 0 else 1.0


def checkpoint_file(
    stage: str,
    file: ListedFile,
    runs: Collection[str],
    done: Collection[str],
    running: Collection[str],
) -> CheckpointFile | None:
    """Return what is known of a file that may be a checkpoint, None where it is none.

    Parameters
    ----------
    stage, file
        The stage, and a file beside its datasets.
    runs, done, running
        Which runs are in the scenario, which have datasets, and which are being worked on.
    """
    name = _CHECKPOINT.fullmatch(file.path.name)
    if name is None:
        return None
    run, code, stale = name[1], name[2], ""
    if run in running:
        pass
    elif run not in runs:
        stale = FOREIGN
    elif run in done:
        stale = FINISHED
    elif code != fingerprint(stage):
        stale = OUTDATED
    header = None
    if not stale:
        with suppress(CheckpointError):
            header = read_header(file.path)
        named = header.identity if header else None
        if named and (named.stage, named.run, named.fingerprint) != (stage, run, code):
            header = None
    if header is None and not file.path.exists():
        return None  # Its run has replaced it meanwhile.
    return CheckpointFile(file.path, file.size, stage, run, stale, header)


def run_progress(headers: Sequence[Header], running: bool) -> RunProgress:
    """Return the progress that a run's generations of checkpoints show.

    Parameters
    ----------
    headers
        Of the run's checkpoints, at least one.
    running
        Whether the run is being worked on.
    """
    *earlier, newest = sorted(headers, key=lambda header: header.written)
    seconds, steps, span = newest.seconds, newest.step, newest.time
    before = earlier[-1] if earlier else None
    if (
        before is not None
        and before.identity.fingerprint == newest.identity.fingerprint
        and newest.seconds >= before.seconds + LEAST_STRETCH
        and newest.time > before.time
    ):
        # The start is no measure of what comes: films thin, and steps adapt.
        seconds, steps, span = seconds - before.seconds, steps - before.step, span - before.time
    rate = steps / seconds if seconds > 0 and steps > 0 else None
    remaining = None
    if seconds > 0 and span > 0:
        remaining = max(newest.end - newest.time, 0.0) * seconds / span
        if running:
            remaining = max(remaining - max(time.time() - newest.written, 0.0), 0.0)
    return RunProgress(
        newest.time, newest.end, newest.step, newest.restarts, newest.written, rate, remaining
    )


def checkpointed_progress(results: Path, stage: str, run: str) -> RunProgress | None:
    """Return the progress of a run that its checkpoints by the present code show.

    Parameters
    ----------
    results
        Folder of the scenario's results.
    stage, run
        Which run it is; nothing else in the folder is looked at.

    Returns
    -------
    RunProgress or None
        As if nobody was working on the run; None where no checkpoint can be read.
    """
    folder, headers = results / stage / CHECKPOINTS, []
    for suffix in (SUFFIX, f".previous{SUFFIX}"):
        with suppress(CheckpointError):
            headers.append(read_header(folder / f"{run}.{fingerprint(stage)}{suffix}"))
    return run_progress(headers, running=False) if headers else None
