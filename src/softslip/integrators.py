"""Time steppers: they advance a vector and know nothing of what it means."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Rate = Callable[[Vector, float], Vector]


class Integrator(Protocol):
    """One step of dy/dt = rate(y, t) from a known first rate."""

    def __call__(
        self, rate: Rate, vector: Vector, time: float, step: float, first_rate: Vector
    ) -> Vector:
        """Return y(time + step); ``first_rate`` is rate(vector, time), already evaluated."""
        ...


def euler(rate: Rate, vector: Vector, time: float, step: float, first_rate: Vector) -> Vector:
    """Explicit Euler, first order: y + Δt rate(y, t) (Eq. 17)."""
    return vector + step * first_rate


INTEGRATORS: dict[str, Integrator] = {"euler": euler}
"""Steppers by the name that `time_stepping.integrator` gives them."""
