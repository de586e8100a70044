"""What steppers take and give."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numba as nb
import numpy as np

from softslip.solver.stepper_memory import Memory, Vector

Rate = Callable[[Vector, float], Vector]
"""dy/dt of (y, t). It leaves y alone and returns an array that it never writes to again."""

Solve = Callable[[Vector], Vector]
"""Multiplies a change of y by P_g; it leaves its argument alone and returns a new array."""

Response = Callable[[Vector, float], Solve]
"""P_g ≈ (1 - g L)⁻¹ of (y, g), with L a part of the rate's Jacobian at y that is cheap to invert,
its eigenvalues not positive. P_g then has none that are negative."""


def explicit_only(vector: Vector, shift: float) -> Solve:
    """Return P_g = 1: no part of the Jacobian is known."""
    return np.copy


_LANDING = 1e-9  # relative excess over the longest step that is not worth another one

compiled = nb.njit(cache=True, fastmath={"contract", "reassoc", "nsz", "arcp"}, error_model="numpy")
"""How the loops of the steppers are compiled: with the freedoms that hide no NaN or Inf."""


@dataclass(frozen=True)
class Accuracy:
    """How wrong one step may be.

    Parameters
    ----------
    tolerance
        Largest accepted local error of a step, in units of ``scale``.
    scale
        Size of each component that counts as one, positive; infinite for a component whose error
        does not count.
    """

    tolerance: float
    scale: Vector


@dataclass(frozen=True)
class Step:
    """Result of one accepted step.

    Parameters
    ----------
    vector
        The new point.
    time
        Its time.
    rate
        The rate there.
    memory
        For the next step.
    error
        Accepted error estimate over the tolerance; 0 for `euler`.
    stages
        Stages of the accepted trial.
    evaluations
        Calls of the rate, rejected trials and power iterations included.
    rejections
        Trials that were rejected.
    """

    vector: Vector
    time: float
    rate: Vector
    memory: Memory
    error: float
    stages: int
    evaluations: int
    rejections: int


class Integrator(Protocol):
    """One step of dy/dt = rate(y, t) from a known first rate."""

    def __call__(
        self,
        rate: Rate,
        vector: Vector,
        time: float,
        first_rate: Vector,
        memory: Memory,
        accuracy: Accuracy,
        until: float,
        largest: float,
        response: Response = explicit_only,
    ) -> Step:
        """Advance by one step; no argument is modified.

        The last call of ``rate`` before returning is at the returned point.

        Parameters
        ----------
        rate
            dy/dt of (y, t).
        vector
            y, shape (n,).
        time
            t.
        first_rate
            rate(vector, time), already evaluated.
        memory
            From the step before, or `Memory.start`.
        accuracy
            How wrong the step may be.
        until
            Later time that must not be stepped over, infinite for none. The steps up to it are
            shortened evenly so that the last one lands on it exactly.
        largest
            Limit of the step, infinite for none; kept to a relative 1e-9.
        response
            What is known of the Jacobian, for steppers that are partly implicit.
        """
        ...


@dataclass(frozen=True)
class StepStart:
    """Where a step starts."""

    vector: Vector
    time: float
    rate: Vector


def landing(time: float, until: float, longest: float) -> tuple[float, float]:
    """Return Δt, at most about ``longest``, that divides the time up to ``until``, and its end."""
    if until == math.inf:
        return longest, time + longest
    count = math.ceil((until - time) / longest * (1.0 - _LANDING))
    if count <= 1:
        return until - time, until
    dt = (until - time) / count
    return dt, time + dt
