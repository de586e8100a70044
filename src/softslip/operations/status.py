"""How far the runs of a scenario have come, told from their files and locks alone.

A run of a stage is done where its dataset is there, running where its lock is held, failed where
its log ends in an error, stopped where a checkpoint is there that it would go on from, and missing
otherwise. Nothing here writes.
"""

import os
import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.errors import CheckpointError, DatasetError, Interrupted
from softslip.files.layout import CHECKPOINTS, LOGS
from softslip.operations.lock import HOLDER_SUFFIX, LOCK_SUFFIX, Holder, holder_of
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.checkpoint import SUFFIX, Header, read_header

STATES = ("done", "running", "failed", "stopped", "missing")
"""What a run of a stage can be."""

FINISHED = "its run is finished"
FOREIGN = "its run is not in the scenario"
OUTDATED = "the code of its stage has changed"
"""Why a checkpoint is stale."""

UNWANTED = "all are to be removed"
UNHELD = "nobody holds it"
UNCOMPLETED = "was begun and never completed"
"""Why other files are left over."""

PART_AGE = 86400.0
"""Seconds after which a file that was begun and never completed is left over."""

LEAST_STRETCH = 10.0
"""Seconds of work between two checkpoints below which their difference says too little: one is
written the moment a signal comes."""

_CHECKPOINT = re.compile(rf"([0-9a-f]+)\.([0-9a-f]+)(?:\.previous)?{re.escape(SUFFIX)}")
_LOCK = re.compile(rf"([0-9a-f]+)(?:{re.escape(LOCK_SUFFIX)}|{re.escape(HOLDER_SUFFIX)})")
_PART = re.compile(r"\.(?:([0-9a-f]{16})\.)?.+\.part")
_ENDING = re.compile(r"(?:\w+\.)*(?:[A-Z]\w*(?:Error|Exception)|Interrupted)(?:: .*)?")

_TAIL = 8192
"""Bytes at the end of a log in which the error is looked for that ended the run."""


@dataclass(frozen=True)
class Checkpoint:
    """A file with a checkpoint.

    Attributes
    ----------
    path, size
        Where it is, and its bytes.
    stage, run, fingerprint
        What it is of, by its name.
    stale
        Why it is of no use any more, empty if it may be.
    header
        What it says of itself; None if it is damaged, or stale and was not looked at. Its arrays
        are never looked at: whether they are sound is found out when the run goes on.
    """

    path: Path
    size: int
    stage: str
    run: str
    fingerprint: str
    stale: str
    header: Header | None

    @property
    def verdict(self) -> str:
        """``valid``, ``damaged`` or ``stale``."""
        if self.stale:
            return "stale"
        return "damaged" if self.header is None else "valid"


@dataclass(frozen=True)
class Progress:
    """How far a run has come, by its newest checkpoint.

    Attributes
    ----------
    time, end
        Time reached, and that at which the stage ends [time unit].
    step
        Steps since the stage began.
    restarts
        How often it had been taken up again.
    written
        POSIX time of the checkpoint.
    rate
        Steps a second of work lately, None where it cannot be known.
    remaining
        Seconds of work that are left if it goes on as it did lately, None where that cannot be
        known. What a running one has probably done since its checkpoint is taken off.
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


@dataclass(frozen=True)
class RunStatus:
    """One stage of one or more runs of a scenario.

    Attributes
    ----------
    stage, run
        Which it is.
    coordinates
        The swept values that all the runs have which share it, by the label of their axis.
    state
        One of `STATES`.
    holder
        Who works on it, None if nobody does.
    progress
        Of one that is not done and has a checkpoint to go on from.
    damaged
        Number of its checkpoints that cannot be used.
    error
        The line that a failed one ended with, empty for others.
    """

    stage: str
    run: str
    coordinates: Mapping[str, Any]
    state: str
    holder: Holder | None
    progress: Progress | None
    damaged: int
    error: str = ""


@dataclass(frozen=True)
class Dataset:
    """The result of one stage of a run, which is not looked into.

    Attributes
    ----------
    path, size
        Where it is, and its bytes.
    changed
        POSIX time of writing.
    """

    path: Path
    size: int
    changed: float


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


@dataclass(frozen=True)
class _File:
    path: Path
    size: int
    changed: float


@dataclass(frozen=True)
class _Listing:
    """The files of one stage; datasets and logs by their runs."""

    datasets: Mapping[str, _File]
    beside: tuple[_File, ...]
    parts: tuple[_File, ...]
    logs: Mapping[str, _File]


@dataclass(frozen=True)
class Survey:
    """What the results of a scenario hold.

    Attributes
    ----------
    runs
        Every run of every stage, in the order of stages and of the scenario.
    checkpoints
        Every checkpoint, those of runs that are not in the scenario included.
    others
        Lock files that nobody holds, and files that were begun more than `PART_AGE` ago and
        never completed; none of a run that is being worked on.
    datasets
        Every dataset by its stage and run, those of runs that are not in the scenario included.
    """

    runs: tuple[RunStatus, ...]
    checkpoints: tuple[Checkpoint, ...]
    others: tuple[Leftover, ...]
    datasets: Mapping[tuple[str, str], Dataset]

    def counts(self, stage: str) -> dict[str, int]:
        """Return how many runs of a stage are in each of `STATES`."""
        found = [run.state for run in self.runs if run.stage == stage]
        return {state: found.count(state) for state in STATES}

    @property
    def stale(self) -> tuple[Checkpoint, ...]:
        """The checkpoints that are of no use any more."""
        return tuple(file for file in self.checkpoints if file.stale)

    def leftovers(self, everything: bool = False) -> tuple[Leftover, ...]:
        """Return the files that nobody needs any more, none of a run that is being worked on.

        They are stale checkpoints, and `others`; what a stopped or failed run goes on from is left
        alone, its lock included.

        Parameters
        ----------
        everything
            Whether these runs shall begin anew: their checkpoints and locks count too.
        """
        states = {(run.stage, run.run): run.state for run in self.runs}
        found = []
        for file in self.checkpoints:
            unwanted = everything and states.get((file.stage, file.run)) != "running"
            reason = file.stale or (UNWANTED if unwanted else "")
            if reason:
                found.append(Leftover(file.path, file.size, file.stage, file.run, reason))
        waiting = {(run.stage, run.run) for run in self.runs if run.progress is not None}
        for other in self.others:
            waits = (other.stage, other.run) in waiting
            if everything or not (waits and other.reason == UNHELD):
                found.append(other)
        # In the order in which they are removed, one lock after another.
        return tuple(sorted(found, key=lambda file: (file.stage, file.run, file.path)))


def status(scenario: Scenario, results: Path) -> list[RunStatus]:
    """Return how far every run of every stage of a scenario has come.

    Parameters
    ----------
    scenario
        Which runs there are.
    results
        Folder of the scenario's results.

    Raises
    ------
    DatasetError
        When a folder of results cannot be read.
    """
    return list(survey(scenario, results).runs)


def survey(scenario: Scenario, results: Path) -> Survey:
    """Return what the results of a scenario hold; see `status`."""
    runs: list[RunStatus] = []
    checkpoints: list[Checkpoint] = []
    datasets: dict[tuple[str, str], Dataset] = {}
    others = [_leftover(file, "", "", UNCOMPLETED) for file in _files(results) if _is_old(file)]
    for stage in STAGES:
        folder = results / stage / CHECKPOINTS
        listing = _list(results, stage)
        holders = _holders(folder, listing)
        coordinates = _shared_coordinates(scenario, stage)
        done = frozenset(listing.datasets)
        classify = partial(_checkpoint, stage, frozenset(coordinates), done, holders)
        found = [each for each in map(classify, listing.beside) if each is not None]
        checkpoints += found
        usable = _by_run(found)
        for run, values in coordinates.items():
            runs.append(
                _run_status(stage, run, values, listing, holders.get(run), usable.get(run, []))
            )
        for run, file in listing.datasets.items():
            datasets[stage, run] = Dataset(file.path, file.size, file.changed)
        others += [each for each in _others(stage, listing) if each.run not in holders]
    return Survey(tuple(runs), tuple(checkpoints), tuple(others), datasets)


def _files(folder: Path) -> Iterator[_File]:
    """Yield the files of a folder, which need not be there; files may vanish meanwhile."""
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                try:
                    if entry.is_file():
                        found = entry.stat()
                        yield _File(Path(entry.path), found.st_size, found.st_mtime)
                except FileNotFoundError:
                    continue
    except FileNotFoundError:
        return
    except OSError as error:
        raise DatasetError(f"{folder}: cannot be read ({error.strerror})") from error


def _list(results: Path, stage: str) -> _Listing:
    # A run that ends meanwhile writes its dataset and then removes its checkpoints: seen in this
    # order it is never missing.
    beside = tuple(_files(results / stage / CHECKPOINTS))
    files = tuple(_files(results / stage))
    return _Listing(
        {file.path.stem: file for file in files if file.path.suffix == ".nc"},
        beside,
        tuple(file for file in files + beside if _is_old(file)),
        {file.path.stem: file for file in _files(results / LOGS / stage)},
    )


def _is_old(file: _File) -> bool:
    return bool(_PART.fullmatch(file.path.name)) and time.time() - file.changed > PART_AGE


def _holders(folder: Path, listing: _Listing) -> dict[str, Holder]:
    """Return who works on runs, by run; only those are looked at that left word of themselves."""
    found: dict[str, Holder] = {}
    for file in listing.beside:
        name = _LOCK.fullmatch(file.path.name)
        if name and file.path.name.endswith(HOLDER_SUFFIX):
            holder = holder_of(folder, name[1])
            if holder is not None:
                found[name[1]] = holder
    return found


def _shared_coordinates(scenario: Scenario, stage: str) -> dict[str, dict[str, Any]]:
    """Return the swept values that are common to all runs that share a run of a stage."""
    found: dict[str, dict[str, Any]] = {}
    for run in scenario.runs():
        values = found.setdefault(run.ids[stage], dict(run.coordinates))
        for label in [label for label, value in values.items() if run.coordinates[label] != value]:
            del values[label]
    return found


def _checkpoint(
    stage: str,
    known: frozenset[str],
    done: frozenset[str],
    holders: Mapping[str, Holder],
    file: _File,
) -> Checkpoint | None:
    """Return what is known of a file that may be a checkpoint, None where it is none."""
    name = _CHECKPOINT.fullmatch(file.path.name)
    if name is None:
        return None
    run, code = name[1], name[2]
    if run in holders:
        stale = ""
    elif run not in known:
        stale = FOREIGN
    elif run in done:
        stale = FINISHED
    else:
        stale = OUTDATED if code != fingerprint(stage) else ""
    header = None if stale else _header(file.path, (stage, run, code))
    if header is None and not file.path.exists():
        return None  # Its run went on meanwhile.
    return Checkpoint(file.path, file.size, stage, run, code, stale, header)


def _header(path: Path, named: tuple[str, str, str]) -> Header | None:
    """Return a checkpoint's header, None where it is damaged or not what its name says."""
    try:
        header = read_header(path)
    except CheckpointError:
        return None
    return header if (header.stage, header.run, header.fingerprint) == named else None


def _by_run(checkpoints: list[Checkpoint]) -> dict[str, list[Checkpoint]]:
    found: dict[str, list[Checkpoint]] = {}
    for file in checkpoints:
        if not file.stale:
            found.setdefault(file.run, []).append(file)
    return found


def _run_status(
    stage: str,
    run: str,
    coordinates: Mapping[str, Any],
    listing: _Listing,
    holder: Holder | None,
    files: list[Checkpoint],
) -> RunStatus:
    headers = [file.header for file in files if file.header is not None]
    error = ""
    if holder is not None:
        state = "running"
    elif run in listing.datasets:
        state = "done"
    else:
        error = _error(listing.logs.get(run), headers)
        state = "failed" if error else "stopped" if headers else "missing"
    progress = _progress(headers, holder is not None) if headers else None
    damaged = len(files) - len(headers)
    return RunStatus(stage, run, coordinates, state, holder, progress, damaged, error)


def _error(log: _File | None, headers: list[Header]) -> str:
    """Return the line with which a run says that it failed, empty where it did not.

    One that a signal stopped says so and did not fail, and one that was killed says nothing. An
    error that is older than a checkpoint is that of an earlier attempt.
    """
    written = max((header.written for header in headers), default=0.0)
    if log is None or not log.size or log.changed < written:
        return ""
    try:
        with log.path.open("rb") as file:
            file.seek(max(log.size - _TAIL, 0))
            tail = file.read().decode(errors="replace")
    except FileNotFoundError:
        return ""  # Its run has begun again meanwhile.
    except OSError as error:
        raise DatasetError(f"{log.path}: cannot be read ({error.strerror})") from error
    lines = [line.strip() for line in tail.splitlines() if line.strip()]
    # Some errors quote what another program said, on the lines after the first.
    ending = next(filter(_ENDING.fullmatch, reversed(lines)), "")
    return "" if ending.startswith(Interrupted.__name__) else ending


def _progress(headers: list[Header], running: bool) -> Progress:
    """Return the progress that a run's generations of checkpoints tell of."""
    ordered = sorted(headers, key=lambda header: header.written)
    newest = ordered[-1]
    seconds, steps, span = newest.seconds, newest.step, newest.time
    if len(ordered) > 1 and ordered[-2].fingerprint == newest.fingerprint:
        # The start is no measure of what comes: films thin, and steps adapt.
        before = ordered[-2]
        if newest.seconds >= before.seconds + LEAST_STRETCH and newest.time > before.time:
            seconds, steps = seconds - before.seconds, steps - before.step
            span -= before.time
    rate = steps / seconds if seconds > 0 and steps > 0 else None
    remaining = None
    if seconds > 0 and span > 0:
        remaining = max(newest.end - newest.time, 0.0) * seconds / span
        if running:
            remaining = max(remaining - max(time.time() - newest.written, 0.0), 0.0)
    return Progress(
        newest.time, newest.end, newest.step, newest.restarts, newest.written, rate, remaining
    )


def _others(stage: str, listing: _Listing) -> Iterator[Leftover]:
    """Yield a stage's leftovers besides checkpoints, those of runs at work included."""
    for file in listing.beside:
        name = _LOCK.fullmatch(file.path.name)
        if name:
            yield _leftover(file, stage, name[1], UNHELD)
    for file in listing.parts:
        name = _PART.fullmatch(file.path.name)
        yield _leftover(file, stage, (name and name[1]) or "", UNCOMPLETED)


def _leftover(file: _File, stage: str, run: str, reason: str) -> Leftover:
    return Leftover(file.path, file.size, stage if run else "", run, reason)
