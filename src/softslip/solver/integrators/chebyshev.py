"""Runge-Kutta-Chebyshev of second order, with as many stages as the stiffness asks for.

Sommeijer, Shampine & Verwer 1998, J. Comput. Appl. Math. 88, 315: explicit, with a number of
stages s that follows the stiffness, because its stable step grows as s² while its cost grows as s.
It suits rates whose Jacobian has eigenvalues close to the negative real axis.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from softslip.solver.integrators.recurrence import (
    DAMPING,
    MOST_STAGES,
    ChebyshevRecurrence,
    StageTerms,
)
from softslip.solver.integrators.spectral import with_radius
from softslip.solver.integrators.step_control import (
    MOST_REJECTIONS,
    RADIUS_AGE,
    RADIUS_SAFETY,
    Counted,
    Trial,
    attempted,
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
        stepping = partial(_chebyshev, counted, origin, dt, end, stages, accuracy)
        trial = attempted(origin, stepping)
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

    base: float
    terms: StageTerms


@lru_cache(maxsize=MOST_STAGES)
def _scheme(stages: int) -> tuple[_Stage, ...]:
    """Coefficients of all stages, with b₀ = b₁ = b₂."""
    recurrence = ChebyshevRecurrence(stages)
    b1 = recurrence.b2
    first = b1 * recurrence.w1
    later = (_Stage(1.0 - terms.last - terms.older, terms) for terms in recurrence.stages(b1, b1))
    return _Stage(1.0, StageTerms(first, 0.0, 0.0, 0.0, first)), *later


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


def _chebyshev(
    rate: Rate, origin: StepStart, dt: float, end: float, stages: int, accuracy: Accuracy
) -> Trial:
    """Go through the stages; stop at one that is not finite before the rate sees it."""
    y0, f0 = origin.vector, origin.rate
    last, older, f = y0, y0, f0
    free = [np.empty_like(y0) for _ in range(3)]
    for stage in _scheme(stages):
        out = free.pop()
        terms = stage.terms
        weights = (stage.base, terms.last, terms.older, dt * terms.first_rate, dt * terms.rate)
        if not _combine(out, y0, last, older, f0, f, weights):
            return Trial(out, f, f, math.inf)
        if older is not y0:
            free.append(older)
        last, older = out, last
        f = rate(out, end if terms.node == 1.0 else origin.time + terms.node * dt)
    estimate = older if older is not y0 else np.empty_like(y0)
    error = local_error(estimate, dt, y0, last, f0, f, accuracy.scale) / accuracy.tolerance
    return Trial(last, f, estimate, error)
