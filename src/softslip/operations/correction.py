"""How finished runs of a stage correct what a model says of others: nearby conditions most."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softslip.config.parameters import Parameters

FEWEST_RUNS = 3
"""Finished runs from which on the scatter is theirs, not that of the model."""

SURE = 2.0
"""Standard deviations of the logarithm that the stated factor of uncertainty spans."""

STRESS_REACH, ROUGHNESS_REACH = 0.5, 0.3
"""Differences in the logarithm of what drives the flow, and in roughness, at which a finished run
counts for exp(−1/2) of one at the same condition."""

MEAN_WEIGHT = 0.5
"""Runs at the same condition that the mean over all conditions counts for."""

Condition = tuple[str, float, float]
"""What drives the flow, the logarithm of how much, and the walls' roughness."""


@dataclass(frozen=True)
class FinishedRun:
    """How a finished run compares with what the model says of it.

    Attributes
    ----------
    condition
        See `condition_of`.
    time, size
        Logarithms of measured over estimated.
    """

    condition: Condition
    time: float
    size: float


@dataclass(frozen=True)
class Correction:
    """How finished runs of a stage compare with the model.

    Attributes
    ----------
    core_seconds, size
        Measured over estimated: for times where the run is that `at` was asked for, or else the
        geometric mean over all runs; for sizes always that.
    factor
        Of uncertainty of the estimated time of one run, upwards and downwards.
    finished
        The runs.
    """

    core_seconds: float
    size: float
    factor: float
    finished: tuple[FinishedRun, ...] = ()

    @property
    def runs(self) -> int:
        """How many finished runs there are."""
        return len(self.finished)

    def at(self, parameters: Parameters) -> "Correction":
        """Return the correction for one run, by its likes.

        The logarithms of measured over estimated are averaged with Gaussian weights in the
        logarithm of the stress or the shear rate and in the roughness, and with the mean over all
        runs at the weight `MEAN_WEIGHT`, which is what counts far from all of them.
        """
        if not self.finished:
            return self
        near = _near(condition_of(parameters), self.finished)
        return replace(self, core_seconds=math.exp(near))


def condition_of(parameters: Parameters) -> Condition:
    """Return the condition of a run; at rest, the smallest drive that there is."""
    rheometer = parameters.rheometer
    drive = rheometer.stress if rheometer.mode == "stress" else rheometer.shear_rate
    least = np.finfo(float).tiny
    return rheometer.mode, math.log(max(drive or 0.0, least)), parameters.wall.roughness


def correction_by(finished: Sequence[FinishedRun], factor: float) -> Correction:
    """Return how finished runs correct the model.

    Parameters
    ----------
    finished
        Runs of one stage.
    factor
        The model's own uncertainty, which is kept with fewer than `FEWEST_RUNS` runs. From as many
        on it follows from how well the others tell each of them.
    """
    if not finished:
        return Correction(1.0, 1.0, factor)
    if len(finished) >= FEWEST_RUNS:
        misses = [run.time for run in finished] - by_others(finished)
        factor = math.exp(SURE * math.sqrt(float(np.mean(np.square(misses)))))
    means = np.mean([(run.time, run.size) for run in finished], axis=0)
    time, size = map(math.exp, means.tolist())
    return Correction(time, size, factor, tuple(finished))


def by_others(finished: Sequence[FinishedRun]) -> NDArray[np.float64]:
    """Return the logarithm of measured over estimated time of each run, as the others tell it.

    Parameters
    ----------
    finished
        Two runs of one stage or more.
    """
    return np.array(
        [
            _near(run.condition, [*finished[:number], *finished[number + 1 :]])
            for number, run in enumerate(finished)
        ]
    )


def _near(condition: Condition, finished: Sequence[FinishedRun]) -> float:
    """Return the mean logarithm of measured over estimated time, of nearby runs most."""
    mode, *place = condition
    times = np.array([run.time for run in finished])
    alike = np.array([run.condition[0] == mode for run in finished])
    places = np.array([run.condition[1:] for run in finished])
    apart = (places - place) / (STRESS_REACH, ROUGHNESS_REACH)
    weights = alike * np.exp(-0.5 * (apart**2).sum(axis=1))
    total = float(weights @ times) + MEAN_WEIGHT * float(times.mean())
    return total / (float(weights.sum()) + MEAN_WEIGHT)
