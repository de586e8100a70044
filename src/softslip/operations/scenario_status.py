"""How far the runs of a scenario are, by their files and locks alone.

A run of a stage is done where its dataset is there, running where its lock is held, failed where
it left a record of its failure, interrupted where it left a checkpoint to resume from, and missing
otherwise. Nothing here writes.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.operations.checkpoint_files import (
    CheckpointFile,
    RunProgress,
    checkpoint_file,
    run_progress,
)
from softslip.operations.failures import FAILURE_SUFFIX, Failure, failure_path, read_failure
from softslip.operations.leftovers import (
    FINISHED,
    FOREIGN,
    INCOMPLETE,
    OUTDATED,
    UNHELD,
    UNWANTED,
    Leftover,
)
from softslip.operations.listing import ListedFile, StageFiles, list_files, stage_files
from softslip.operations.lock import (
    HOLDER_SUFFIX,
    LOCK_SUFFIX,
    Holder,
    holder_of,
    holder_path,
    read_holder,
)
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.checkpoint import END_SUFFIX

STATES = ("done", "running", "failed", "interrupted", "missing")
"""What a run of a stage can be."""


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
        The process that works on it, None if there is none.
    killed
        The process that died at work without recording a failure, None if none did.
    progress
        Of one that is not done and has a checkpoint to resume from.
    damaged
        Number of its checkpoints that cannot be used.
    failure
        Why it failed, None for others.
    """

    stage: str
    run: str
    coordinates: Mapping[str, Any]
    state: str
    holder: Holder | None
    killed: Holder | None
    progress: RunProgress | None
    damaged: int
    failure: Failure | None


@dataclass(frozen=True)
class ScenarioStatus:
    """What the results of a scenario hold.

    Attributes
    ----------
    runs
        Every run of every stage, in the order of stages and of the scenario.
    checkpoints
        Every checkpoint, those of runs that are not in the scenario included.
    others
        Lock files that nobody holds, records of failures, and incomplete files that were abandoned;
        none of a run that is being worked on.
    datasets
        Every dataset by its stage and run, those of runs that are not in the scenario included.
    """

    runs: tuple[RunStatus, ...]
    checkpoints: tuple[CheckpointFile, ...]
    others: tuple[Leftover, ...]
    datasets: Mapping[tuple[str, str], ListedFile]

    def counts(self, stage: str) -> dict[str, int]:
        """Return how many runs of a stage are in each of `STATES`."""
        states = [run.state for run in self.runs if run.stage == stage]
        return {state: states.count(state) for state in STATES}

    @property
    def stale(self) -> tuple[CheckpointFile, ...]:
        """The checkpoints that are of no use any more."""
        return tuple(file for file in self.checkpoints if file.stale)

    def leftovers(self, everything: bool = False) -> tuple[Leftover, ...]:
        """Return the files that nobody needs any more, none of a run that is being worked on.

        They are stale checkpoints, and `others`; what an interrupted or failed run resumes from is
        left alone, its lock and the record of its failure included.

        Parameters
        ----------
        everything
            Whether these runs shall start from the beginning: their files count too.
        """
        runs = {(run.stage, run.run): run for run in self.runs}
        running = {key for key, run in runs.items() if run.state == "running"}
        resumable = {key for key, run in runs.items() if run.progress is not None}
        unneeded = []
        for file in self.checkpoints:
            unwanted = everything and (file.stage, file.run) not in running
            reason = file.stale or (UNWANTED if unwanted else "")
            if reason:
                unneeded.append(Leftover(file.path, file.size, file.stage, file.run, reason))
        for other in self.others:
            waits = (other.stage, other.run) in resumable and other.reason == UNHELD
            if everything or not (waits or other.reason == UNWANTED):
                unneeded.append(other)
        # In the order in which they are removed, one lock after another.
        return tuple(sorted(unneeded, key=lambda file: (file.stage, file.run, file.path)))


def scenario_status(scenario: Scenario, results: Path) -> ScenarioStatus:
    """Return how far every run of every stage of a scenario is, and what lies about.

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
    runs: list[RunStatus] = []
    checkpoints: list[CheckpointFile] = []
    datasets: dict[tuple[str, str], ListedFile] = {}
    abandoned = [file for file in list_files(results) if file.is_abandoned]
    others = [_leftover(file, "", "", INCOMPLETE) for file in abandoned]
    for stage in STAGES:
        files = stage_files(results, stage)
        holders, killed = _holders(files)
        coordinates = _shared_coordinates(scenario, stage)
        usable = defaultdict(list)
        for file in files.beside:
            checkpoint = checkpoint_file(stage, file, coordinates, files.datasets, holders)
            if checkpoint is not None:
                checkpoints.append(checkpoint)
                if not checkpoint.stale:
                    usable[checkpoint.run].append(checkpoint)
        for run, values in coordinates.items():
            process = holders.get(run), killed.get(run)
            runs.append(_run_status(stage, run, values, files, usable[run], *process))
        datasets |= {(stage, run): file for run, file in files.datasets.items()}
        others += [each for each in _others(stage, files, coordinates) if each.run not in holders]
    return ScenarioStatus(tuple(runs), tuple(checkpoints), tuple(others), datasets)


def _holders(files: StageFiles) -> tuple[dict[str, Holder], dict[str, Holder]]:
    """Return the processes at work and those that died at work, by run.

    Only locks are looked at whose holders left their names.
    """
    holders, killed = dict[str, Holder](), dict[str, Holder]()
    for run in files.with_suffix(HOLDER_SUFFIX):
        holder = holder_of(files.folder, run)
        if holder is not None:
            holders[run] = holder
        elif holder_path(files.folder, run).exists():
            killed[run] = read_holder(holder_path(files.folder, run))
    return holders, killed


def _shared_coordinates(scenario: Scenario, stage: str) -> dict[str, dict[str, Any]]:
    """Return the swept values that are common to all runs that share a run of a stage."""
    shared: dict[str, dict[str, Any]] = {}
    for run in scenario.runs():
        values = shared.setdefault(run.ids[stage], dict(run.coordinates))
        for label in [label for label, value in values.items() if run.coordinates[label] != value]:
            del values[label]
    return shared


def _run_status(
    stage: str,
    run: str,
    coordinates: Mapping[str, Any],
    files: StageFiles,
    usable: Sequence[CheckpointFile],
    holder: Holder | None,
    killed: Holder | None,
) -> RunStatus:
    headers = [file.header for file in usable if file.header is not None]
    failure = None
    if holder is not None:
        state = "running"
    elif run in files.datasets:
        state = "done"
    else:
        failure = read_failure(failure_path(files.folder, run))
        state = "failed" if failure else "interrupted" if headers else "missing"
    if failure is not None or state == "done":
        killed = None
    progress = run_progress(headers, holder is not None) if headers else None
    damaged = len(usable) - len(headers)
    return RunStatus(stage, run, coordinates, state, holder, killed, progress, damaged, failure)


def _others(stage: str, files: StageFiles, runs: Collection[str]) -> Iterator[Leftover]:
    """Yield a stage's leftovers besides checkpoints, those of runs at work included."""
    for suffix in (LOCK_SUFFIX, HOLDER_SUFFIX):
        for run, file in files.with_suffix(suffix).items():
            yield _leftover(file, stage, run, UNHELD)
    for run, file in files.with_suffix(FAILURE_SUFFIX).items():
        reason = FOREIGN if run not in runs else FINISHED if run in files.datasets else UNWANTED
        yield _leftover(file, stage, run, reason)
    for file in files.beside:
        if file.path.name.endswith(END_SUFFIX):
            code = file.path.name.removesuffix(END_SUFFIX).rpartition(".")[2]
            yield _leftover(file, "", "", UNWANTED if code == fingerprint(stage) else OUTDATED)
    for file in files.abandoned:
        yield _leftover(file, stage, file.part_of, INCOMPLETE)


def _leftover(file: ListedFile, stage: str, run: str, reason: str) -> Leftover:
    return Leftover(file.path, file.size, stage if run else "", run, reason)
