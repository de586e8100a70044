"""What Snakemake would do for a scenario, and what that will take.

What there is to do follows from the datasets, as Snakemake's own rules have it: a run of a stage is
done if its dataset is missing and somebody needs it, if other code made it, or if its parent is
made anew or is newer. Snakemake itself compares with the records that it keeps in ``.snakemake``;
here the datasets' own word is taken, so that results that were copied without these records count
too. Nothing here writes.
"""

import heapq
import json
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from softslip.config.scenario import Scenario, StageRun
from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.files.labels import text_attributes
from softslip.operations.costs import Correction, Costs, Estimate, Measured, shipped
from softslip.operations.listing import ListedFile
from softslip.operations.status import RunStatus, ScenarioStatus, scenario_status
from softslip.provenance.fingerprints import fingerprint

RUNNING, CONTINUE, BEGIN, REUSE, SKIP = "running", "continue", "begin", "reuse", "skip"
ACTIONS = (BEGIN, CONTINUE, RUNNING, REUSE, SKIP)
"""What becomes of a run of a stage: it is begun, gone on with from a checkpoint, somebody works on
it, its dataset is used as it is, or it is missing and nobody needs it."""

OPEN = (BEGIN, CONTINUE, RUNNING)
"""Where something is left to do."""

ENOUGH = 100
"""Finished runs of a stage that an estimate is corrected by: more do not make it better."""

MISSING, CHANGED, PARENT, NEWER, DAMAGED = (
    "missing",
    "code changed",
    "parent made anew",
    "parent newer",
    "unreadable",
)
REASONS = (MISSING, CHANGED, PARENT, NEWER, DAMAGED)
"""Why a run of a stage is to be done."""

Key = tuple[str, str]
"""Stage and run."""


@dataclass(frozen=True)
class Origin:
    """What a dataset says of how it was made.

    Attributes
    ----------
    fingerprint
        Of the code that made it, empty where it does not say.
    core_seconds
        Processor time, 0 where it does not say.
    """

    fingerprint: str
    core_seconds: float


@dataclass(frozen=True)
class Task:
    """One stage of one or more runs of a scenario, and what becomes of it.

    Attributes
    ----------
    stage, run, parent
        Which it is, and the run of the stage before, None for a packing.
    coordinates
        The swept values that all the runs have which share it, by the label of their axis.
    action
        One of `ACTIONS`.
    reason
        One of `REASONS` where it is to be done, empty where it is not.
    fraction
        Part of the stage's time that has passed, where there is a checkpoint to go on from.
    new
        Whether it was never done, or is not in the scenario that is compared with.
    core_seconds, size
        Estimates of the processor time that is left [s], and of the bytes that its dataset will
        take; 0 where there is nothing to do.
    """

    stage: str
    run: str
    parent: str | None
    coordinates: Mapping[str, Any]
    action: str
    reason: str
    fraction: float
    new: bool
    core_seconds: float
    size: float

    @property
    def is_open(self) -> bool:
        """Whether there is something left to do."""
        return self.action in OPEN


@dataclass(frozen=True)
class StagePlan:
    """The runs of one stage together.

    Attributes
    ----------
    counts
        How many there are by action, in the order of `ACTIONS`.
    reasons
        How many are to be done by reason, those that there are.
    core_seconds, size
        Sums of what is left.
    factor
        By which the time of one run may be off, upwards or downwards.
    finished
        Finished runs of the scenario that the estimate was corrected by.
    """

    counts: Mapping[str, int]
    reasons: Mapping[str, int]
    core_seconds: float
    size: float
    factor: float
    finished: int


@dataclass(frozen=True)
class Plan:
    """What there is to do for a scenario.

    Attributes
    ----------
    tasks
        Every run of every stage, in the order of stages and of the scenario.
    stages
        Sums by stage.
    gone
        Runs by stage that only the scenario has that is compared with, None without one.
    """

    tasks: tuple[Task, ...]
    stages: Mapping[str, StagePlan]
    gone: Mapping[str, tuple[str, ...]] | None

    @property
    def core_seconds(self) -> float:
        """Processor time that is left [s]."""
        return sum(stage.core_seconds for stage in self.stages.values())

    @property
    def size(self) -> float:
        """Bytes that will be written."""
        return sum(stage.size for stage in self.stages.values())

    @property
    def factor(self) -> float:
        """Factor by which the whole time may be off: that of the stages, as they share in it."""
        total = self.core_seconds
        if not total:
            return 1.0
        logs = (part.core_seconds * math.log(part.factor) for part in self.stages.values())
        return math.exp(sum(logs) / total)

    @cached_property
    def chain(self) -> tuple[Task, ...]:
        """The tasks from a packing to a shear, one after another, that take longest together.

        However many cores there are, it does not go faster.
        """
        index = {(task.stage, task.run): task for task in self.tasks}
        ends: dict[Key | None, float] = {None: 0.0}
        for task in self.tasks:
            ends[task.stage, task.run] = ends[_parent(task)] + task.core_seconds
        last = max(ends, key=lambda key: ends[key])
        found = []
        while last is not None:
            found.append(index[last])
            last = _parent(index[last])
        return tuple(task for task in reversed(found) if task.is_open)

    def wall_seconds(self, cores: int) -> float:
        """Return the time until all is done, each task on one core as soon as one is free.

        Tasks that can start are taken in the order of the plan, since Snakemake does not know which
        of them take long; those that are being worked on come first.

        Parameters
        ----------
        cores
            How many tasks run at a time, at least 1.
        """
        tasks = [task for task in self.tasks if task.is_open]
        places: dict[Key | None, int] = {
            (task.stage, task.run): place for place, task in enumerate(tasks)
        }
        following: defaultdict[int, list[int]] = defaultdict(list)
        ready: list[tuple[bool, int]] = []
        for place, task in enumerate(tasks):
            before = places.get(_parent(task))
            if before is None:
                heapq.heappush(ready, (task.action != RUNNING, place))
            else:
                following[before].append(place)
        now, working = 0.0, list[tuple[float, int]]()
        while ready or working:
            while ready and len(working) < cores:
                place = heapq.heappop(ready)[1]
                heapq.heappush(working, (now + tasks[place].core_seconds, place))
            now, done = heapq.heappop(working)
            for place in following[done]:
                heapq.heappush(ready, (True, place))
        return now


def _parent(task: Task) -> Key | None:
    """Return the stage and run before a task, None before a packing."""
    return None if task.parent is None else _before(task.stage, task.parent)


def _before(stage: str, parent: str) -> Key:
    return STAGES[STAGES.index(stage) - 1], parent


def make_plan(
    scenario: Scenario, results: Path, against: Scenario | None = None, costs: Costs | None = None
) -> Plan:
    """Return what there is to do for a scenario, and what that will take.

    Parameters
    ----------
    scenario
        Which runs there are.
    results
        Folder of the scenario's results.
    against
        Another scenario: runs that it has too are not new.
    costs
        Estimates that the finished runs correct, those of the package by default.

    Raises
    ------
    DatasetError
        When a folder of results cannot be read.
    """
    found = scenario_status(scenario, results)
    tables = {stage: scenario.stage_table(stage) for stage in STAGES}
    origins = {
        (stage, run): _origin(found.datasets[stage, run], stage, run)
        for stage, table in tables.items()
        for run in table
        if (stage, run) in found.datasets
    }
    reasons = _reasons(found, tables, origins)
    known = None
    if against is not None:
        known = {stage: frozenset(against.stage_table(stage)) for stage in STAGES}
    costs, tasks, stages = costs or shipped(), list[Task](), dict[str, StagePlan]()
    for stage, table in tables.items():
        correction = costs.correction(stage, _finished(stage, table, found, origins))
        own = []
        for status in (each for each in found.runs if each.stage == stage):
            row, reason = table[status.run], reasons.get((stage, status.run), "")
            made_anew = row.parent is not None and _before(stage, row.parent) in reasons
            action = _action(status, (stage, status.run) in origins, reason, made_anew)
            new = status.run not in known[stage] if known else reason == MISSING
            estimate = None
            if action in OPEN:
                estimate = _corrected(costs.estimate(stage, row.parameters), correction)
            own.append(_task(status, row.parent, action, reason, new, estimate))
        tasks += own
        stages[stage] = _stage_plan(own, correction)
    gone = None
    if known:
        gone = {stage: tuple(sorted(known[stage] - set(tables[stage]))) for stage in STAGES}
    return Plan(tuple(tasks), stages, gone)


def _origin(dataset: ListedFile, stage: str, run: str) -> Origin | None:
    """Return what a dataset says of how it was made, None where no stage could go on from it."""
    try:
        found = text_attributes(dataset.path, ("provenance", "stage", "run"))
        words = json.loads(found.get("provenance", "{}"))
        origin = Origin(str(words.get("fingerprint", "")), float(words.get("core_seconds", 0.0)))
    except (DatasetError, ValueError, TypeError, AttributeError):
        return None
    return origin if (found.get("stage"), found.get("run")) == (stage, run) else None


def _reasons(
    found: ScenarioStatus,
    tables: Mapping[str, Mapping[str, StageRun]],
    origins: Mapping[Key, Origin | None],
) -> dict[Key, str]:
    """Return why runs are to be done, by stage and run.

    What follows from it that one is done goes both ways: its children are done again, and its
    parent must be there. It ends when nothing follows any more.
    """
    reasons = _own_reasons(found, tables, origins)
    parents = {
        (stage, run): _before(stage, row.parent)
        for stage, table in tables.items()
        for run, row in table.items()
        if row.parent is not None
    }
    before = -1
    while len(reasons) != before:
        before = len(reasons)
        for child, parent in parents.items():
            if child in reasons and parent not in origins:
                reasons.setdefault(parent, MISSING)
            if parent in reasons and child in origins:
                reasons.setdefault(child, PARENT)
    return reasons


def _own_reasons(
    found: ScenarioStatus,
    tables: Mapping[str, Mapping[str, StageRun]],
    origins: Mapping[Key, Origin | None],
) -> dict[Key, str]:
    """Return why runs are to be done whatever becomes of others."""
    reasons: dict[Key, str] = {}
    for stage, table in tables.items():
        for run, row in table.items():
            key = stage, run
            parent = found.datasets.get(_before(stage, row.parent)) if row.parent else None
            if key not in origins:
                # Of the other stages only what is needed is made.
                if stage == STAGES[-1]:
                    reasons[key] = MISSING
                continue
            origin = origins[key]
            if origin is None:
                reasons[key] = DAMAGED
            elif origin.fingerprint != fingerprint(stage):
                reasons[key] = CHANGED
            elif parent is not None and parent.changed > found.datasets[key].changed:
                reasons[key] = NEWER
    return reasons


def _action(status: RunStatus, has_dataset: bool, reason: str, parent_anew: bool) -> str:
    if status.state == "running":
        return RUNNING
    if not reason:
        return REUSE if has_dataset else SKIP
    # A checkpoint that began with another parent is passed over, and a finished run has none.
    return CONTINUE if status.progress is not None and not parent_anew else BEGIN


def _task(
    status: RunStatus,
    parent: str | None,
    action: str,
    reason: str,
    new: bool,
    estimate: Estimate | None,
) -> Task:
    fraction, seconds, size = 0.0, 0.0, 0.0
    if estimate is not None:
        seconds, size = estimate.core_seconds, estimate.size
    progress = status.progress
    if action in (CONTINUE, RUNNING) and progress is not None:
        fraction = progress.fraction
        # What the run itself has shown is worth more than what others have.
        known = progress.remaining
        seconds = seconds * (1 - fraction) if known is None else known
    return Task(
        status.stage,
        status.run,
        parent,
        status.coordinates,
        action,
        reason,
        fraction,
        new,
        seconds,
        size,
    )


def _finished(
    stage: str,
    table: Mapping[str, StageRun],
    found: ScenarioStatus,
    origins: Mapping[Key, Origin | None],
) -> list[Measured]:
    """Return finished runs of a stage, by the present code if there are such, `ENOUGH` at most."""
    timed = [
        (origin.fingerprint, Measured(stage, row.parameters, origin.core_seconds, size))
        for run, row in table.items()
        if (origin := origins.get((stage, run))) is not None and origin.core_seconds > 0
        for size in [found.datasets[stage, run].size]
    ]
    present = [run for code, run in timed if code == fingerprint(stage)] if timed else []
    told = present or [run for _, run in timed]
    # Neighbours in a sweep tell the same: these are spread over all of it.
    return told[:: max(math.ceil(len(told) / ENOUGH), 1)]


def _corrected(plain: Estimate, correction: Correction) -> Estimate:
    return Estimate(
        plain.core_seconds * correction.core_seconds,
        plain.size * correction.size,
    )


def _stage_plan(own: Sequence[Task], correction: Correction) -> StagePlan:
    actions = Counter(task.action for task in own)
    reasons = Counter(task.reason for task in own if task.reason)
    return StagePlan(
        {action: actions[action] for action in ACTIONS},
        {reason: reasons[reason] for reason in REASONS if reasons[reason]},
        _total(task.core_seconds for task in own),
        _total(task.size for task in own),
        correction.factor,
        correction.runs,
    )


def _total(values: Iterable[float]) -> float:
    return math.fsum(values)
