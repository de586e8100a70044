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
from softslip.solver.integrators.stepping import Accuracy, Rate, Step, StepStart, compiled, landing
from softslip.solver.stepper_memory import Memory, Vector

DAMPING = 2.0 / 13.0
"""ε: all modes but the slow ones lose at least about ε/3 a step, for 2 % of the stable step."""

MOST_STAGES = 200
"""Stages of a step at most; beyond, rounding errors grow, and the step is shortened instead."""

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


def rkc2(
    rate: Rate,
    vector: Vector,
    time: float,
    first_rate: Vector,
    memory: Memory,
    accuracy: Accuracy,
    until: float,
    largest: float,
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
    counted = _Counted(rate)
    origin = StepStart(vector, time, first_rate)
    wish, fresh = memory.step_size, False
    if memory.direction.size == 0 or memory.radius_age >= RADIUS_AGE:
        memory, fresh = with_radius(counted, origin, memory, accuracy.scale), True
    for rejections in range(MOST_REJECTIONS):
        dt, end = landing(time, until, min(wish, largest, _longest_stable(memory.spectral_radius)))
        _check_advances(time, end, dt)
        stages = _stages(dt * memory.spectral_radius)
        trial = _attempt(counted, origin, dt, end, stages, accuracy)
        if trial.error <= 1.0:
            wanted = _next_wish(dt, wish, trial.error)
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
        wish = dt * _shrinking(trial.error)
        if not fresh:
            if trial.error < math.inf:  # the mode that grew tells best where to look
                memory = replace(memory, direction=trial.estimate)
            memory, fresh = with_radius(counted, origin, memory, accuracy.scale), True
    raise _exhausted(time, dt, trial, accuracy.scale) from trial.cause


class _Counted:
    """A rate that counts its calls."""

    def __init__(self, rate: Rate) -> None:
        self.rate = rate
        self.evaluations = 0

    def __call__(self, vector: Vector, time: float) -> Vector:
        self.evaluations += 1
        return self.rate(vector, time)


@dataclass(frozen=True)
class _Trial:
    """A step not yet accepted; its error is infinite if it left the finite numbers."""

    vector: Vector
    rate: Vector
    estimate: Vector
    error: float
    cause: NumericalError | None = None


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


def _next_wish(dt: float, wish: float, error: float) -> float:
    """Step that the next step would like after Δt was accepted with ``error``.

    The error is taken to grow as Δt³. If it allows less than `MOST_FACTOR` Δt, that is a
    measurement of the step, and it holds even where Δt was cut short of the wish. If it allows
    more, it only says that `MOST_FACTOR` Δt will do, and a longer wish is not given up: the error
    of a step much shortened to land on a time knows nothing of the step that was wanted.
    """
    factor = _asymptotic(error)
    return factor * dt if factor < MOST_FACTOR else max(MOST_FACTOR * dt, wish)


def _shrinking(error: float) -> float:
    """Ratio of the next trial to the one rejected with ``error``."""
    return NON_FINITE_FACTOR if error == math.inf else max(LEAST_FACTOR, _asymptotic(error))


def _asymptotic(error: float) -> float:
    """Ratio of the step that meets the tolerance, with safety, to the one with ``error``."""
    return STEP_SAFETY / math.cbrt(error) if error > 0.0 else math.inf


def _check_advances(time: float, end: float, dt: float) -> None:
    if end <= time:
        raise NumericalError(
            "step_size",
            0,
            0,
            f"the tolerance asks for steps of {dt:.3g}, which no longer advance the time "
            f"{time:.6g}; the solution may blow up there: look at the last records, or set a "
            "larger time_stepping.tolerance",
        )


def _exhausted(time: float, dt: float, trial: _Trial, scale: Vector) -> NumericalError:
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


@compiled
def _estimate(
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
) -> _Trial:
    """Try a step; the last call of ``rate`` is at its end."""
    try:
        return _chebyshev(rate, origin, dt, end, stages, accuracy)
    except NumericalError as cause:
        return _Trial(origin.vector, origin.rate, origin.rate, math.inf, cause)


def _chebyshev(
    rate: Rate, origin: StepStart, dt: float, end: float, stages: int, accuracy: Accuracy
) -> _Trial:
    """Go through the stages; stop at one that is not finite before the rate sees it."""
    y0, f0 = origin.vector, origin.rate
    last, older, f = y0, y0, f0
    free = [np.empty_like(y0) for _ in range(3)]
    for stage in _scheme(stages):
        out = free.pop()
        weights = (stage.base, stage.last, stage.older, dt * stage.first_rate, dt * stage.rate)
        if not _combine(out, y0, last, older, f0, f, weights):
            return _Trial(out, f, f, math.inf)
        if older is not y0:
            free.append(older)
        last, older = out, last
        f = rate(out, end if stage.node == 1.0 else origin.time + stage.node * dt)
    estimate = older if older is not y0 else np.empty_like(y0)
    error = _estimate(estimate, dt, y0, last, f0, f, accuracy.scale) / accuracy.tolerance
    return _Trial(last, f, estimate, error)
