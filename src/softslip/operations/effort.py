"""What the runs of a scenario took, beside what was estimated before: what a campaign teaches."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.files.layout import DATASET
from softslip.files.storage import read_dataset
from softslip.operations.costs import Costs, shipped
from softslip.operations.scenario_status import scenario_status
from softslip.provenance.attribution import read_provenance
from softslip.solver.step_limits import CAUSES

_VARIABLES: Mapping[str, tuple[str, str]] = {
    "runs": ("1", "number of runs of the scenario"),
    "runs_done": ("1", "number of runs done"),
    "runs_failed": ("1", "number of runs that failed"),
    "core_seconds": ("s", "processor time of the runs done"),
    "estimated_core_seconds": ("s", "processor time of the runs done, estimated before"),
    "largest_ratio": ("1", "largest processor time of a run over its estimate"),
    "least_ratio": ("1", "least processor time of a run over its estimate"),
    "restarts": ("1", "number of times that runs were resumed"),
    "ended_early": ("1", "number of runs that ended when their means were known"),
    "steps": ("1", "number of time steps"),
    "evaluations": ("1", "number of evaluations of the equations of motion"),
    "steps_set": ("1", "number of time steps whose length a cause set"),
    "cause": ("1", "what set the length of a time step"),
}
"""Units and meanings."""


@dataclass(frozen=True)
class _Finished:
    """A run that is done: its labels, as a dataset without data, and its estimated time."""

    labels: xr.Dataset
    estimated: float

    @property
    def core_seconds(self) -> float:
        """Processor time of all attempts."""
        return float(read_provenance(self.labels.attrs)["core_seconds"])

    @property
    def restarts(self) -> int:
        """How often it was resumed."""
        return int(read_provenance(self.labels.attrs)["restarts"])

    def count(self, name: str) -> int:
        """Return one of the counts of its time loop, 0 where it has none."""
        return int(self.labels.attrs.get(name, 0))


def measure_effort(
    scenario: Scenario, results: Path, costs: Costs | None = None
) -> tuple[xr.Dataset, list[xr.Dataset]]:
    """Add up what the finished runs of a scenario took.

    Parameters
    ----------
    scenario
        Which runs there are.
    results
        Folder of the scenario's results.
    costs
        What estimates are made from; the table that comes with the package by default.

    Returns
    -------
    effort
        Along ``stage``: ``runs``, ``runs_done``, ``runs_failed``; ``core_seconds`` of those done,
        restarts included, ``estimated_core_seconds`` by the table alone, and the ends of the
        range of their ratio, ``least_ratio`` and ``largest_ratio`` (NaN where none is done);
        ``restarts``, ``ended_early``, ``steps``, ``evaluations``; and, along ``cause`` too,
        ``steps_set``, the number of steps whose length each cause set.
    parents
        The labels of the runs that are done, as datasets without data.

    Raises
    ------
    DatasetError
        When a finished run cannot be read.
    """
    costs, status = costs or shipped(), scenario_status(scenario, results)
    rows: dict[str, list[Any]] = {name: [] for name in _VARIABLES if name != "cause"}
    parents: list[xr.Dataset] = []
    for stage in STAGES:
        counts = status.counts(stage)
        rows["runs"].append(sum(counts.values()))
        rows["runs_failed"].append(counts["failed"])
        runs = list(_finished(scenario, stage, results, costs))
        parents += [run.labels for run in runs]
        for name, value in _added_up(runs).items():
            rows[name].append(value)
    variables = {
        name: (("stage", "cause") if name == "steps_set" else ("stage",), np.array(values))
        for name, values in rows.items()
    }
    dataset = xr.Dataset(variables, {"stage": list(STAGES), "cause": list(CAUSES)})
    for name, (unit, meaning) in _VARIABLES.items():
        dataset[name].attrs = {"units": unit, "long_name": meaning}
    dataset["stage"].attrs = {"units": "1", "long_name": "stage of a run"}
    return dataset, parents


def _finished(scenario: Scenario, stage: str, results: Path, costs: Costs) -> Iterator[_Finished]:
    """Yield the runs of a stage that are done."""
    for run, row in scenario.stage_table(stage).items():
        path = results / stage / f"{run}{DATASET}"
        if path.exists():
            labels = xr.Dataset(attrs=read_dataset(path, stage=stage, run=run).attrs)
            yield _Finished(labels, costs.estimate(stage, row.parameters).core_seconds)


def _added_up(runs: Sequence[_Finished]) -> dict[str, Any]:
    """Return what the runs of a stage took together, by the names of `_VARIABLES`."""
    ratios = [run.core_seconds / run.estimated for run in runs]
    return {
        "runs_done": len(runs),
        "core_seconds": math.fsum(run.core_seconds for run in runs),
        "estimated_core_seconds": math.fsum(run.estimated for run in runs),
        "least_ratio": min(ratios, default=np.nan),
        "largest_ratio": max(ratios, default=np.nan),
        "restarts": sum(run.restarts for run in runs),
        "ended_early": sum(run.labels.attrs.get("ended_by") == "error" for run in runs),
        "steps": sum(run.count("steps") for run in runs),
        "evaluations": sum(run.count("evaluations") for run in runs),
        "steps_set": [sum(run.count(f"steps_set_by_{cause}") for run in runs) for cause in CAUSES],
    }
