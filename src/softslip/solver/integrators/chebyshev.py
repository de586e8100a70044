"""Runge-Kutta-Chebyshev of second order, with as many stages as the stiffness asks for.

Sommeijer, Shampine & Verwer 1998, J. Comput. Appl. Math. 88, 315: explicit, with a number of
stages s that follows the stiffness, because its stable step grows as s² while its cost grows as s.
It suits rates whose Jacobian has eigenvalues close to the negative real axis.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.integrators.spectral import with_radius
from softslip.solver.integrators.step_control import (
    MOST_REJECTIONS,
    RADIUS_AGE,
    RADIUS_SAFETY,
    Counted,
    Trial,
    check_advances,
    exhausted,
    local_error,
    next_wish,
    shrinking,
)
from softslip.solver.integrators.stepping import (
    Accuracy,
    Rate,
    Response,
    Step,
    StepStart,
    compiled,
    explicit_only,
    landing,
)
from softslip.solver.stepper_memory import Memory, Vector

DAMPING = 2.0 / 13.0
"""ε: all modes but the slow ones lose at least about ε/3 a step, for 2 % of the stable step."""

MOST_STAGES = 200
"""Stages of a step at most; beyond, rounding errors grow, and the step is shortened instead."""


def rkc2(
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
    """Runge-Kutta-Chebyshev, second order, as `Integrator` describes.

    The step follows the embedded estimate of its local error. That is measured by the largest
    component over its scale, not by a mean, so that an event that touches few components counts in
    full. The number of stages follows the spectral radius of the Jacobian, which a power iteration
    estimates every `RADIUS_AGE` steps and after a rejected trial.

    Raises
    ------
    NumericalError
        If the rate is not finite at the point or next to it, if `MOST_REJECTIONS` trials in a row
        were rejected, or if the step became too short to advance the time.
    """
    counted = Counted(rate)
    origin = StepStart(vector, time, first_rate)
    wish, fresh = memory.step_size, False
    if memory.direction.size == 0 or memory.radius_age >= RADIUS_AGE:
        memory, fresh = with_radius(counted, origin, memory, accuracy.scale), True
    for rejections in range(MOST_REJECTIONS):
        dt, end = landing(time, until, min(wish, largest, _longest_stable(memory.spectral_radius)))
        check_advances(time, end, dt)
        stages = _stages(dt * memory.spectral_radius)
        trial = _attempt(counted, origin, dt, end, stages, accuracy)
        if trial.error <= 1.0:
            wanted = next_wish(dt, wish, trial.error)
            step = min(wanted, wish) if rejections else wanted
            return Step(
                vector=trial.vector,
                time=end,
                rate=trial.rate,
                memory=replace(memory, step_size=step).older(),
                error=trial.error,
                stages=stages,
                evaluations=counted.evaluations,
                rejections=rejections,
            )
        wish = dt * shrinking(trial.error)
        if not fresh:
            if trial.error < math.inf:  # the mode that grew tells best where to look
                memory = replace(memory, direction=trial.estimate)
            memory, fresh = with_radius(counted, origin, memory, accuracy.scale), True
    raise exhausted(time, dt, trial, accuracy.scale) from trial.cause


def reach(stages: int) -> float:
    """Return the stable Δt times spectral radius of a number of stages.

    The asymptotic form for many stages, at most the exact (1 + w₀)/w₁ for any number.
    """
    return 2.0 / 3.0 * (stages**2 - 1) * (1.0 - 2.0 / 15.0 * DAMPING)


def _longest_stable(radius: float) -> float:
    """Longest step that `MOST_STAGES` stages keep stable."""
    return reach(MOST_STAGES) / (RADIUS_SAFETY * radius) if radius > 0.0 else math.inf


def _stages(stiffness: float) -> int:
    """Fewest stages that are stable at Δt times the spectral radius."""
    square = 1.0 + RADIUS_SAFETY * stiffness * 3.0 / reach(2)
    # At the longest stable step rounding may ask for one stage more than there is.
    return min(max(2, math.ceil(math.sqrt(square))), MOST_STAGES)


@dataclass(frozen=True)
class _Stage:
    """Coefficients of Y_j = base Y_0 + last Y_{j-1} + older Y_{j-2} + Δt (rate F_{j-1} + ...)."""

    node: float  # c_j, the time of the stage in units of Δt
    base: float
    last: float
    older: float
    rate: float
    first_rate: float


@lru_cache(maxsize=MOST_STAGES)
def _scheme(stages: int) -> tuple[_Stage, ...]:
    """Coefficients of all stages, from the recurrence of the Chebyshev polynomials at w₀ > 1.

    The amplification of a mode is a_s + b_s T_s(w₀ + w₁ z), a_s = 1 - b_s T_s(w₀), with w₁ and b_s
    such that its first three Taylor coefficients are those of e^z.
    """
    w0 = 1.0 + DAMPING / stages**2
    T, dT, ddT = [1.0, w0], [0.0, 1.0], [0.0, 0.0]
    for j in range(2, stages + 1):
        T.append(2.0 * w0 * T[j - 1] - T[j - 2])
        dT.append(2.0 * w0 * dT[j - 1] - dT[j - 2] + 2.0 * T[j - 1])
        ddT.append(2.0 * w0 * ddT[j - 1] - ddT[j - 2] + 4.0 * dT[j - 1])
    w1 = dT[stages] / ddT[stages]
    b = [ddT[j] / dT[j] ** 2 for j in range(2, stages + 1)]
    b = [b[0], b[0], *b]
    # The last node is 1 by construction, but not to the last bit.
    c = [w1 * ddT[j] / dT[j] for j in range(2, stages)] + [1.0]
    c = [0.0, b[1] * w1, *c]
    scheme = [_Stage(c[1], 1.0, 0.0, 0.0, 0.0, b[1] * w1)]
    for j in range(2, stages + 1):
        last, older = 2.0 * w0 * b[j] / b[j - 1], -b[j] / b[j - 2]
        share = 2.0 * w1 * b[j] / b[j - 1]
        first = -(1.0 - b[j - 1] * T[j - 1]) * share
        scheme.append(_Stage(c[j], 1.0 - last - older, last, older, share, first))
    return tuple(scheme)


@compiled
def _combine(
    out: Vector,
    base: Vector,
    last: Vector,
    older: Vector,
    first_rate: Vector,
    rate: Vector,
    weights: tuple[float, float, float, float, float],
) -> bool:
    """Fill ``out`` with the weighted sum of the five others; return whether it is finite."""
    a, b, c, d, e = weights
    spoilt = 0.0
    for i in range(out.size):
        value = a * base[i] + b * last[i] + c * older[i] + d * first_rate[i] + e * rate[i]
        out[i] = value
        spoilt += 0.0 * value  # stays 0 unless a value is NaN or infinite; no branch
    return spoilt == 0.0


def fixed_step(rate: Rate, vector: Vector, time: float, dt: float, stages: int) -> Vector:
    """Return what one step of a given length and number of stages leads to, whatever its error.

    It has nothing of `rkc2` but the scheme: no control of steps, no choice of stages. What is not
    finite is left for the caller to see.

    Raises
    ------
    NumericalError
        If the rate does.
    """
    origin = StepStart(vector, time, rate(vector, time))
    anything = Accuracy(math.inf, np.ones_like(vector))
    return _chebyshev(rate, origin, dt, time + dt, stages, anything).vector


def _attempt(
    rate: Rate, origin: StepStart, dt: float, end: float, stages: int, accuracy: Accuracy
) -> Trial:
    """Try a step; the last call of ``rate`` is at its end."""
    try:
        return _chebyshev(rate, origin, dt, end, stages, accuracy)
    except NumericalError as cause:
        return Trial(origin.vector, origin.rate, origin.rate, math.inf, cause)


def _chebyshev(
    rate: Rate, origin: StepStart, dt: float, end: float, stages: int, accuracy: Accuracy
) -> Trial:
    """Go through the stages; stop at one that is not finite before the rate sees it."""
    y0, f0 = origin.vector, origin.rate
    last, older, f = y0, y0, f0
    free = [np.empty_like(y0) for _ in range(3)]
    for stage in _scheme(stages):
        out = free.pop()
        weights = (stage.base, stage.last, stage.older, dt * stage.first_rate, dt * stage.rate)
        if not _combine(out, y0, last, older, f0, f, weights):
            return Trial(out, f, f, math.inf)
        if older is not y0:
            free.append(older)
        last, older = out, last
        f = rate(out, end if stage.node == 1.0 else origin.time + stage.node * dt)
    estimate = older if older is not y0 else np.empty_like(y0)
    error = local_error(estimate, dt, y0, last, f0, f, accuracy.scale) / accuracy.tolerance
    return Trial(last, f, estimate, error)
