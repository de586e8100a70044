"""The spectral radius of a rate's Jacobian, by a nonlinear power iteration."""

import math
from dataclasses import replace

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.integrators.stepping import Rate, StepStart, compiled
from softslip.solver.stepper_memory import Memory, Vector

RADIUS_CHANGE = 0.01
"""Relative change between two power iterations at which the estimate is taken as converged.

The change is far smaller than what is still missing where the spectrum is dense at its end.
"""

MOST_ITERATIONS = 50
"""Power iterations of one estimate at most."""

UNCONVERGED_SAFETY = 1.5
"""Further factor, on the largest value seen, when the power iteration did not settle."""

_SECOND_WEIGHT = 0.5  # of the first rate in the start of a power iteration


def no_rate(time: float) -> NumericalError:
    """Say that no step, however short, can be taken."""
    return NumericalError(
        "step_size",
        0,
        0,
        f"the rate is not finite at time {time:.6g} or right next to it, so that no step is short "
        "enough; start again from an earlier record with a smaller hydrodynamics.node_spacing, "
        "and then a smaller time_stepping.step ('euler') or time_stepping.tolerance (others)",
    )


@compiled
def _norm(vector: Vector, scale: Vector) -> float:
    """Root mean square of the components over their scale."""
    total = 0.0
    for i in range(vector.size):
        total += (vector[i] / scale[i]) ** 2
    return math.sqrt(total / vector.size)


def with_radius(
    rate: Rate,
    origin: StepStart,
    memory: Memory,
    scale: Vector,
    unconverged_safety: float = UNCONVERGED_SAFETY,
) -> Memory:
    """Return the memory with the spectral radius estimated at the origin of the step.

    An estimate that is to bound the radius from above takes the default safety, one that is to
    bound it from below takes 1.

    Raises
    ------
    NumericalError
        If the rate is not finite there or next to it.
    """
    if not np.isfinite(origin.rate).all():
        raise no_rate(origin.time)
    try:
        start = _start(origin, memory, scale)
        radius, direction = _spectral_radius(rate, origin, start, scale, unconverged_safety)
    except NumericalError as cause:
        raise no_rate(origin.time) from cause
    return replace(memory, spectral_radius=radius, radius_age=0, direction=direction)


def _start(origin: StepStart, memory: Memory, scale: Vector) -> Vector:
    """Direction in which a power iteration starts.

    What is remembered, mixed with the first rate: a spot that has become stiff since the last
    estimate is hardly in the old direction, but pushes hard now. The slow modes that come with it
    are gone after one iteration. Their weights differ, so that they cannot cancel.
    """
    remembered = memory.direction if memory.direction.size else _rough(scale)
    return _unit(remembered, scale) + _SECOND_WEIGHT * _unit(origin.rate, scale)


def _unit(vector: Vector, scale: Vector) -> Vector:
    """Return ``vector`` over its norm, or a copy if it has none."""
    norm = _norm(vector, scale)
    return vector / norm if norm > 0.0 else vector.copy()


def _rough(scale: Vector) -> Vector:
    """Return a fixed vector with all wavelengths in like amounts: a chirp, {φ i²} - 1/2."""
    index = np.arange(1.0, scale.size + 1.0)
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    return np.asarray((golden * index**2 % 1.0 - 0.5) * np.where(np.isinf(scale), 0.0, scale))


def _spectral_radius(
    rate: Rate, origin: StepStart, start: Vector, scale: Vector, unconverged_safety: float
) -> tuple[float, Vector]:
    """Estimate the spectral radius of the Jacobian by a nonlinear power iteration.

    The point is displaced along a direction by √u of its size (of the scale if that is larger),
    u being the rounding unit; the change of the rate gives both the estimate and the next
    direction. Sizes are root mean squares in units of the scale, whose convergence is smoother
    than that of a largest component. A component of infinite scale is displaced like the others
    but does not count in them. If the iteration does not settle, as for a pair of complex
    eigenvalues, the largest value seen is taken with ``unconverged_safety``.

    Returns
    -------
    radius, direction
        0 if the rate does not change; the last direction, of unit size.
    """
    size = math.sqrt(np.finfo(np.float64).eps) * max(1.0, _norm(origin.vector, scale))
    direction = _unit(start, scale)
    radius = largest = 0.0
    for _ in range(MOST_ITERATIONS):
        displaced = rate(origin.vector + size * direction, origin.time)
        with np.errstate(invalid="ignore", over="ignore"):  # the norm tells
            change = (displaced - origin.rate) / size
        before, radius = radius, _norm(change, scale)
        if radius == 0.0:
            return 0.0, direction
        if not math.isfinite(radius):
            raise no_rate(origin.time)
        direction = change / radius
        if abs(radius - before) <= RADIUS_CHANGE * radius:
            return radius, direction
        largest = max(largest, radius)
    return unconverged_safety * largest, direction
