"""The runs of a plan: what becomes of each, in which order, and how long all of them take."""

import heapq
import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any

from softslip.config.scenario import StageRun
from softslip.config.stages import STAGES


class Action(StrEnum):
    """What becomes of a run of a stage."""

    BEGIN = "begin"
    RESUME = "resume"
    """From a checkpoint."""
    RUNNING = "running"
    """A process works on it."""
    REUSE = "reuse"
    """Its dataset is used as it is."""
    SKIP = "skip"
    """Its dataset is missing, and no other run needs it."""


OPEN = (Action.BEGIN, Action.RESUME, Action.RUNNING)
"""Where something is left to do."""


class Reason(StrEnum):
    """Why a run of a stage is to be done; `NONE`, which is empty, where it is not."""

    NONE = ""
    MISSING = "missing"
    CHANGED = "code changed"
    PARENT = "parent rerun"
    REPLACED = "parent changed"
    DAMAGED = "unreadable"


Key = tuple[str, str]
"""Stage and run."""


@dataclass(frozen=True)
class PlannedRun:
    """One stage of one or more runs of a scenario, and what becomes of it.

    Attributes
    ----------
    stage, run, parent
        Which it is, and the run of the stage before, None for a packing.
    coordinates
        The swept values that all the runs have which share it, by the label of their axis.
    action
        What becomes of it.
    reason
        Why it is to be done, if it is.
    fraction
        Part of the stage's time that has passed, where there is a checkpoint to resume from.
    new
        Whether it was never done, or is not in the scenario that is compared with.
    core_seconds, size
        Estimates of the processor time that is left [s], and of the bytes that its dataset will
        take; 0 where there is nothing to do.
    priority
        See `config.sweep_order.priorities`.
    """

    stage: str
    run: str
    parent: str | None
    coordinates: Mapping[str, Any]
    action: Action
    reason: Reason
    fraction: float
    new: bool
    core_seconds: float
    size: float
    priority: int = 0

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
        How many there are by action, in the order of `Action`.
    reasons
        How many are to be done by reason, those that there are.
    core_seconds, size
        Sums of what is left.
    factor
        By which the time of one run may be off, upwards or downwards.
    finished
        Finished runs of the scenario that the estimate was corrected by.
    """

    counts: Mapping[Action, int]
    reasons: Mapping[Reason, int]
    core_seconds: float
    size: float
    factor: float
    finished: int


@dataclass(frozen=True)
class Plan:
    """What there is to do for a scenario.

    Attributes
    ----------
    runs
        Every run of every stage, in the order of stages and of the scenario.
    stages
        Sums by stage.
    gone
        Runs by stage that only the scenario has that is compared with, None without one.
    """

    runs: tuple[PlannedRun, ...]
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
        logs = (part.core_seconds * math.log(part.factor) for part in self.stages.values())
        return math.exp(sum(logs) / total) if total else 1.0

    @cached_property
    def chain(self) -> tuple[PlannedRun, ...]:
        """The runs from a packing to a shear, one after another, that take longest together.

        However many cores there are, it does not go faster.
        """
        ends: dict[Key | None, float] = {None: 0.0}
        chains: dict[Key | None, tuple[PlannedRun, ...]] = {None: ()}
        for run in self.runs:
            key, before = (run.stage, run.run), run_before(run)
            ends[key] = ends[before] + run.core_seconds
            chains[key] = (*chains[before], run)
        longest = chains[max(ends, key=lambda key: ends[key])]
        return tuple(run for run in longest if run.is_open)

    def wall_seconds(self, cores: int) -> float:
        """Return the time until all is done, each run on one core as soon as one is free.

        Runs that can start are taken by their priority and in the order of the plan, as Snakemake
        does, which does not know how long they take; those that are being worked on come first.

        Parameters
        ----------
        cores
            How many run at a time, at least 1.
        """
        runs = [run for run in self.runs if run.is_open]
        places: dict[Key | None, int] = {
            (run.stage, run.run): place for place, run in enumerate(runs)
        }
        children: defaultdict[int | None, list[int]] = defaultdict(list)
        for place, run in enumerate(runs):
            children[places.get(run_before(run))].append(place)
        waits = [
            (run.action != Action.RUNNING, -run.priority, place) for place, run in enumerate(runs)
        ]
        ready = [waits[place] for place in children[None]]
        heapq.heapify(ready)
        now, working = 0.0, list[tuple[float, int]]()
        while ready or working:
            while ready and len(working) < cores:
                place = heapq.heappop(ready)[-1]
                heapq.heappush(working, (now + runs[place].core_seconds, place))
            now, done = heapq.heappop(working)
            for place in children[done]:
                heapq.heappush(ready, waits[place])
        return now


def run_before(run: "PlannedRun | StageRun") -> Key | None:
    """Return the stage and run before a run, None before a packing."""
    return None if run.parent is None else (STAGES[STAGES.index(run.stage) - 1], run.parent)
