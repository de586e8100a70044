"""The control of steps by an estimate of their error, which several steppers share."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.integrators.stepping import Rate, StepStart, compiled
from softslip.solver.stepper_memory import Vector

MOST_REJECTIONS = 12
"""Trials of one step; each is at most 0.8 times the one before, a non-finite one a quarter."""

RADIUS_AGE = 25
"""Accepted steps after which the spectral radius is estimated anew."""

RADIUS_SAFETY = 1.2
"""Factor on the estimated spectral radius: a power iteration closes in on it from below."""

STEP_SAFETY = 0.8
"""Factor on the step that would just meet the tolerance, so that few trials are rejected."""

LEAST_FACTOR, MOST_FACTOR = 0.1, 5.0
"""Bounds of the ratio of one step to the step before."""

NON_FINITE_FACTOR = 0.25
"""Ratio of a step to the trial before it that left the finite numbers and has no error."""


class Counted:
    """A rate that counts its calls."""

    def __init__(self, rate: Rate) -> None:
        self.rate = rate
        self.evaluations = 0

    def __call__(self, vector: Vector, time: float) -> Vector:
        """Return the rate and count."""
        self.evaluations += 1
        return self.rate(vector, time)


@dataclass(frozen=True)
class Trial:
    """A step not yet accepted; its error is infinite if it left the finite numbers."""

    vector: Vector
    rate: Vector
    estimate: Vector
    error: float
    cause: NumericalError | None = None


def attempted(origin: StepStart, stepping: Callable[[], Trial]) -> Trial:
    """Return the trial step, of infinite error where the rate has no value on the way."""
    try:
        return stepping()
    except NumericalError as cause:
        return Trial(origin.vector, origin.rate, origin.rate, math.inf, cause)


def next_wish(dt: float, wish: float, error: float) -> float:
    """Step that the next step would like after Δt was accepted with ``error``.

    The error is taken to grow as Δt³. If it allows less than `MOST_FACTOR` Δt, that is a
    measurement of the step, and it holds even where Δt was cut short of the wish. If it allows
    more, it only says that `MOST_FACTOR` Δt will do, and a longer wish is not given up: the error
    of a step much shortened to land on a time knows nothing of the step that was wanted.
    """
    factor = _asymptotic(error)
    return factor * dt if factor < MOST_FACTOR else max(MOST_FACTOR * dt, wish)


def shrinking(error: float) -> float:
    """Ratio of the next trial to the one rejected with ``error``."""
    return NON_FINITE_FACTOR if error == math.inf else max(LEAST_FACTOR, _asymptotic(error))


def _asymptotic(error: float) -> float:
    """Ratio of the step that meets the tolerance, with safety, to the one with ``error``."""
    return STEP_SAFETY / math.cbrt(error) if error > 0.0 else math.inf


def check_advances(time: float, end: float, dt: float) -> None:
    """Raise when a step is too short to change the time.

    Raises
    ------
    NumericalError
        Saying that the solution may blow up.
    """
    if end <= time:
        raise NumericalError(
            "step_size",
            0,
            0,
            f"the tolerance asks for steps of {dt:.3g}, which no longer advance the time "
            f"{time:.6g}; the solution may blow up there: look at the last records, or set a "
            "larger time_stepping.tolerance",
        )


def exhausted(time: float, dt: float, trial: Trial, scale: Vector) -> NumericalError:
    """Say where no trial was accepted, why, and what to change."""
    what = f"no step is found at time {time:.6g}: rejected {MOST_REJECTIONS} trial steps in a row"
    if trial.error < math.inf:
        return NumericalError(
            "state",
            int(np.argmax(np.abs(trial.estimate) / scale)),
            0,
            f"{what}, the last of {dt:.3g} because its local error there is {trial.error:.3g} "
            "times the tolerance: the rate jumps there; set a smaller hydrodynamics.node_spacing "
            "or a larger steric.refinement if a film is thin there, otherwise a larger "
            "time_stepping.tolerance",
        )
    return NumericalError(
        "step_size",
        0,
        0,
        f"{what}, the last of {dt:.3g} because it left the range in which the rate has a value; "
        "start again from an earlier record with a smaller hydrodynamics.node_spacing, as films "
        "between nodes that are too far apart collapse, and then a smaller "
        "time_stepping.tolerance",
    )


@compiled
def local_error(
    out: Vector,
    dt: float,
    before: Vector,
    after: Vector,
    rate_before: Vector,
    rate_after: Vector,
    scale: Vector,
) -> float:
    """Fill the embedded estimate of the local error and return its largest component over scale.

    [12 (y_n - y_{n+1}) + 6 Δt (f_n + f_{n+1})]/15. For short steps it is 1.2 (two stages) to 1.8
    (many) times the true local error of a mode. Infinite if the estimate is not finite somewhere,
    even where the scale is infinite.
    """
    largest, spoilt = 0.0, 0.0
    for i in range(out.size):
        value = 0.8 * (before[i] - after[i]) + 0.4 * dt * (rate_before[i] + rate_after[i])
        out[i] = value
        spoilt += 0.0 * value
        largest = max(largest, abs(value) / scale[i])
    return largest if spoilt == 0.0 else np.inf


@compiled
def largest_over(vector: Vector, scale: Vector) -> float:
    """Return the largest component over its scale; infinite if any is not finite."""
    largest, spoilt = 0.0, 0.0
    for i in range(vector.size):
        spoilt += 0.0 * vector[i]
        largest = max(largest, abs(vector[i]) / scale[i])
    return largest if spoilt == 0.0 else np.inf
