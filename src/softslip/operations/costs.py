"""What a stage of a run costs: processor time and disk, estimated from measured runs.

For each stage the time is a line, fitted to a table of measured runs (``costs.json``, which
`operations.calibration` writes), and corrected by the finished runs of the scenario itself:

    packing         t = t₀ + c · discs · steps
    expansion       t = t₀ + c · growth nodes · steps
    ageing, shear   t = t₀ + c · nodes^1.05 · E     (Ewald sum)
                    t = t₀ + c · points^1.3 · E     (mesh)

with E evaluations of the equations of motion; see `operations.workload`.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.operations.correction import (
    SURE,
    Correction,
    FinishedRun,
    condition_of,
    correction_by,
)
from softslip.operations.workload import evaluations, load, stored

TABLE = Path(__file__).with_name("costs.json")
"""The measured runs that come with the package."""

LINE_CONSTANTS, FLOW_CONSTANTS = 2, 11
"""Constants fitted for a preparing stage, and for ageing and shear together: two lines, two power
laws of two features, and the steps at the start."""


@dataclass(frozen=True)
class Measured:
    """What a stage of a run took.

    Attributes
    ----------
    stage, parameters
        What was run.
    core_seconds, size
        Processor time [s] and bytes of its dataset.
    steps, evaluations
        Of its time loop; 0 where it has none.
    """

    stage: str
    parameters: Parameters
    core_seconds: float
    size: int
    steps: int = 0
    evaluations: int = 0


@dataclass(frozen=True)
class Estimate:
    """What a stage of a run will take.

    Attributes
    ----------
    core_seconds, size
        Processor time [s] and bytes of its dataset.
    """

    core_seconds: float
    size: float


Line = tuple[float, float]
"""Start and slope."""


def fitted_line(points: Sequence[tuple[float, float]]) -> Line:
    """Return start and slope of the line with the least relative errors, neither negative.

    Parameters
    ----------
    points
        Loads and values.
    """
    loads, values = np.array(points).T
    columns = np.column_stack((1 / values, loads / values))
    line = np.linalg.lstsq(columns, np.ones(len(values)), rcond=None)[0]
    if line.min() < 0:
        other = int(line.argmax())
        line = np.zeros(2)
        line[other] = columns[:, other].sum() / (columns[:, other] ** 2).sum()
    return float(line[0]), float(line[1])


def _cost_of(stage: str, parameters: Parameters) -> str:
    """Return what shares a line: ageing and shear do, but not the two mobilities."""
    return stage if stage in ("packing", "expansion") else parameters.hydrodynamics.mobility


class Costs:
    """Estimates from measured runs.

    Parameters
    ----------
    table
        Runs of every stage, with their evaluations; both mobilities among them.

    Attributes
    ----------
    factors
        By stage, the factor by which estimates of the table's own runs are off, upwards or
        downwards, `SURE` standard deviations.
    """

    def __init__(self, table: Sequence[Measured]) -> None:
        times: dict[str, list[tuple[float, float]]] = {}
        sizes: dict[str, list[tuple[float, float]]] = {}
        for run in table:
            stage, parameters = run.stage, run.parameters
            work = load(stage, parameters, run.evaluations)
            times.setdefault(_cost_of(stage, parameters), []).append((work, run.core_seconds))
            sizes.setdefault(stage, []).append((stored(stage, parameters), run.size))
        self._times = {name: fitted_line(points) for name, points in times.items()}
        self._sizes = {stage: fitted_line(points) for stage, points in sizes.items()}
        self.factors = {stage: self._scatter(table, stage) for stage in sizes}

    def estimate(self, stage: str, parameters: Parameters) -> Estimate:
        """Return what a stage of a run takes by the table alone."""
        start, slope = self._times[_cost_of(stage, parameters)]
        work = load(stage, parameters, evaluations(stage, parameters))
        least, each = self._sizes[stage]
        return Estimate(start + slope * work, least + each * stored(stage, parameters))

    def corrected(self, stage: str, parameters: Parameters, correction: Correction) -> Estimate:
        """Return what a stage of a run takes by the table and by finished runs of that stage."""
        estimate, found = self.estimate(stage, parameters), correction.at(parameters)
        return Estimate(estimate.core_seconds * found.core_seconds, estimate.size * found.size)

    def correction(self, stage: str, finished: Iterable[Measured]) -> Correction:
        """Return how finished runs of a stage, if any, compare with the estimates."""
        return correction_by(self.compared(finished), self.factors[stage])

    def compared(self, finished: Iterable[Measured]) -> list[FinishedRun]:
        """Return how finished runs compare with the estimates of the table alone."""
        found = []
        for run in finished:
            estimate = self.estimate(run.stage, run.parameters)
            ratios = run.core_seconds / estimate.core_seconds, run.size / estimate.size
            found.append(FinishedRun(condition_of(run.parameters), *map(math.log, ratios)))
        return found

    def _scatter(self, table: Sequence[Measured], stage: str) -> float:
        errors = [
            math.log(run.core_seconds / self.estimate(stage, run.parameters).core_seconds)
            for run in table
            if run.stage == stage
        ]
        preparing = stage in ("packing", "expansion")
        rows = len(errors) if preparing else sum(run.evaluations > 0 for run in table)
        # What was fitted to these very runs is closer to them than to others.
        unseen = rows / max(rows - (LINE_CONSTANTS if preparing else FLOW_CONSTANTS), 1)
        mean_square = sum(error**2 for error in errors) / len(errors)
        return math.exp(SURE * math.sqrt(mean_square * unseen))


def read_table(path: Path) -> list[Measured]:
    """Return the runs of a table of measured costs.

    Parameters
    ----------
    path
        As `operations.calibration.calibrate` writes it.
    """
    table: Mapping[str, Any] = json.loads(path.read_text())
    return [
        Measured(stage, parameters, **measured)
        for run in table["runs"]
        for parameters in [Parameters.from_mapping(run["settings"])]
        for stage, measured in run["stages"].items()
    ]


@cache
def shipped() -> Costs:
    """Return the estimates from the table that comes with the package."""
    return Costs(read_table(TABLE))
