"""What Snakemake would do for a scenario, and what that will take.

What there is to do follows from the datasets, by the rules that Snakemake has (`tests/workflow`
compares it with dry runs): a run of a stage is done if its dataset is missing and somebody needs
it, if other code made it, or if its parent is rerun or is not what it was made from. Snakemake
compares with its own records in ``.snakemake`` and with times, which `provenance.timestamps` puts
in order for it; here the datasets themselves are asked, so that results that were copied without
these records and times count too, and thousands of runs take a second. Nothing here writes.
"""

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from softslip.config.scenario import Scenario, StageRun
from softslip.config.stages import STAGES, trajectory_id
from softslip.config.sweep_order import priorities
from softslip.errors import CheckpointError, DatasetError
from softslip.files.labels import text_attributes
from softslip.files.layout import CHECKPOINTS
from softslip.files.storage import CONTENT_DIGEST
from softslip.operations.correction import Correction
from softslip.operations.costs import Costs, Estimate, Measured, shipped
from softslip.operations.listing import ListedFile
from softslip.operations.scenario_status import RunStatus, ScenarioStatus, scenario_status
from softslip.operations.schedule import (
    OPEN,
    Action,
    Key,
    Plan,
    PlannedRun,
    Reason,
    StagePlan,
    run_before,
)
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.checkpoint import read_header
from softslip.simulation.end_state import end_state_path

ENOUGH = 100
"""Finished runs of a stage that an estimate is corrected by: more do not make it better."""

ORIGIN = ("provenance", "stage", "run", "parents")
"""Labels that say which run a dataset is, and what it was made from."""

Tables = Mapping[str, Mapping[str, StageRun]]
"""Runs by their names, by stage."""


class _Dataset(NamedTuple):
    """A dataset and how it was made; ``code`` is None where no stage could read it.

    The digests of what it holds and of what it was made from are empty where it does not say them.
    """

    file: ListedFile
    code: str | None
    core_seconds: float
    content: str = ""
    parent: str = ""

    def is_outdated_by(self, parent: "_Dataset") -> bool:
        """Whether its parent is not what it was made from; times tell where digests do not."""
        if self.parent and parent.content:
            return self.parent != parent.content
        return parent.file.changed > self.file.changed


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
    status = scenario_status(scenario, results)
    tables = {stage: scenario.stage_table(stage) for stage in STAGES}
    datasets = _datasets(status, tables)
    reasons = _reasons(tables, datasets)
    others = None
    if against is not None:
        others = {stage: frozenset(against.stage_table(stage)) for stage in STAGES}
    costs, planned, stages = costs or shipped(), list[PlannedRun](), dict[str, StagePlan]()
    ranks = priorities(scenario)
    corrected = {
        stage: costs.correction(stage, _finished(stage, table, datasets))
        for stage, table in tables.items()
    }
    for stage, table in tables.items():
        own = []
        for run in (each for each in status.runs if each.stage == stage):
            row, reason = table[run.run], reasons.get((stage, run.run), Reason.NONE)
            action = _action(run, reason, (stage, run.run) in datasets, run_before(row) in reasons)
            estimate = Estimate(0.0, 0.0)
            if action in OPEN:
                estimate = costs.corrected(stage, row.parameters, corrected[stage])
            new = run.run not in others[stage] if others else reason == Reason.MISSING
            done = continued_part(results, row) if action == Action.BEGIN else 0.0
            if done and run_before(row) not in reasons:
                action = Action.RESUME
            planned_run = _planned(run, row.parent, action, reason, new, estimate, done)
            own.append(replace(planned_run, priority=ranks[stage][run.run]))
        planned += own
        stages[stage] = _stage_plan(own, corrected[stage])
    gone = None
    if others:
        gone = {stage: tuple(sorted(others[stage] - set(tables[stage]))) for stage in STAGES}
    return Plan(tuple(planned), stages, gone)


def corrections(
    scenario: Scenario, results: Path, costs: Costs | None = None
) -> dict[str, Correction]:
    """Return by stage how the finished runs of a scenario compare with the estimates.

    Parameters
    ----------
    scenario, results, costs
        As of `make_plan`.

    Raises
    ------
    DatasetError
        When a folder of results cannot be read.
    """
    model = costs or shipped()
    finished = finished_runs(scenario, results)
    return {stage: model.correction(stage, runs) for stage, runs in finished.items()}


def finished_runs(scenario: Scenario, results: Path) -> dict[str, list[Measured]]:
    """Return by stage the finished runs of a scenario that correct estimates, and what they took.

    Parameters
    ----------
    scenario, results
        As of `make_plan`.

    Raises
    ------
    DatasetError
        When a folder of results cannot be read.
    """
    tables = {stage: scenario.stage_table(stage) for stage in STAGES}
    datasets = _datasets(scenario_status(scenario, results), tables)
    return {stage: _finished(stage, table, datasets) for stage, table in tables.items()}


def _datasets(status: ScenarioStatus, tables: Tables) -> dict[Key | None, _Dataset]:
    return {
        (stage, run): _dataset(status.datasets[stage, run], stage, run)
        for stage, table in tables.items()
        for run in table
        if (stage, run) in status.datasets
    }


def _dataset(file: ListedFile, stage: str, run: str) -> _Dataset:
    """Return how a dataset was made, without code where no stage could read it."""
    try:
        labels = text_attributes(file.path, (*ORIGIN, CONTENT_DIGEST))
        parents = [str(each[CONTENT_DIGEST]) for each in json.loads(labels.get("parents", "[]"))]
        origin = json.loads(labels.get("provenance", "{}"))
        code, seconds = str(origin.get("fingerprint", "")), float(origin.get("core_seconds", 0.0))
    except (DatasetError, ValueError, TypeError, AttributeError, LookupError):
        return _Dataset(file, None, 0.0)
    if (labels.get("stage"), labels.get("run")) != (stage, run):
        return _Dataset(file, None, 0.0)
    content, parent = labels.get(CONTENT_DIGEST, ""), parents[0] if parents else ""
    return _Dataset(file, code, seconds, content, parent)


def _reasons(tables: Tables, datasets: Mapping[Key | None, _Dataset]) -> dict[Key, Reason]:
    """Return why runs are to be done, by stage and run.

    From the shears back, what is to be done needs its parent; from the packings on, what is to be
    done causes its children to be rerun.
    """
    reasons: dict[Key, Reason] = {}
    for stage in reversed(STAGES):
        for run, row in tables[stage].items():
            key, before = (stage, run), run_before(row)
            if key not in datasets:
                # Of the other stages only what is needed is made.
                if stage == STAGES[-1]:
                    reasons[key] = Reason.MISSING
            elif datasets[key].code is None:
                reasons[key] = Reason.DAMAGED
            elif datasets[key].code != fingerprint(stage):
                reasons[key] = Reason.CHANGED
            elif before in datasets and datasets[key].is_outdated_by(datasets[before]):
                reasons[key] = Reason.REPLACED
            if key in reasons and before is not None and before not in datasets:
                reasons[before] = Reason.MISSING
    for stage in STAGES:
        for run, row in tables[stage].items():
            if run_before(row) in reasons and (stage, run) in datasets:
                reasons.setdefault((stage, run), Reason.PARENT)
    return reasons


def _action(run: RunStatus, reason: Reason, has_dataset: bool, parent_rerun: bool) -> Action:
    if run.state == "running":
        return Action.RUNNING
    if not reason:
        return Action.REUSE if has_dataset else Action.SKIP
    # A checkpoint that began with another parent is passed over, and a finished run has none.
    return Action.RESUME if run.progress is not None and not parent_rerun else Action.BEGIN


def continued_part(results: Path, row: StageRun) -> float:
    """Return the part of a run's time that a shorter run of its trajectory has done before.

    Parameters
    ----------
    results
        Folder of the scenario's results.
    row
        A run of any stage; only shears continue others.
    """
    if row.stage != STAGES[-1]:
        return 0.0
    folder, trajectory = results / row.stage / CHECKPOINTS, trajectory_id(row.parameters)
    path = end_state_path(folder, trajectory, fingerprint(row.stage))
    if not path.exists():
        return 0.0
    try:
        time = read_header(path).time
    except CheckpointError:
        return 0.0
    end = row.parameters.time_stepping.shear_time
    return time / end if time <= end else 0.0


def _planned(
    run: RunStatus,
    parent: str | None,
    action: Action,
    reason: Reason,
    new: bool,
    estimate: Estimate,
    done: float,
) -> PlannedRun:
    fraction, seconds, progress = 0.0, estimate.core_seconds, run.progress
    if action == Action.RESUME and progress is None:
        fraction, seconds = done, seconds * (1 - done)
    elif action in (Action.RESUME, Action.RUNNING) and progress is not None:
        fraction = progress.fraction
        # What the run itself has shown is worth more than what others have.
        own = progress.remaining
        seconds = seconds * (1 - fraction) if own is None else own
    which = run.stage, run.run, parent, run.coordinates
    return PlannedRun(*which, action, reason, fraction, new, seconds, estimate.size)


def _finished(
    stage: str, table: Mapping[str, StageRun], datasets: Mapping[Key | None, _Dataset]
) -> list[Measured]:
    """Return finished runs of a stage, by the present code if there are such, `ENOUGH` at most."""
    timed = [
        (made.code, Measured(stage, row.parameters, made.core_seconds, made.file.size))
        for run, row in table.items()
        if (made := datasets.get((stage, run))) is not None and made.core_seconds > 0
    ]
    present = [run for code, run in timed if code == fingerprint(stage)]
    runs = present or [run for _, run in timed]
    # Neighbours in a sweep are alike: these are spread over all of it.
    return runs[:: max(math.ceil(len(runs) / ENOUGH), 1)]


def _stage_plan(runs: Sequence[PlannedRun], correction: Correction) -> StagePlan:
    actions = Counter(run.action for run in runs)
    reasons = Counter(run.reason for run in runs if run.reason)
    return StagePlan(
        {action: actions[action] for action in Action},
        {reason: reasons[reason] for reason in Reason if reasons[reason]},
        math.fsum(run.core_seconds for run in runs),
        math.fsum(run.size for run in runs),
        correction.factor,
        correction.runs,
    )
