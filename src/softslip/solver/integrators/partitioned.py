"""Partitioned implicit-explicit Runge-Kutta-Chebyshev of second order.

Verwer & Sommeijer 2004, SIAM J. Sci. Comput. 25, 1824: stages of the Chebyshev recurrence whose
stiff linear part is implicit, with one and the same g = μ̃₁ Δt in all of them. Here that part is

    F_I(t, y) = L_g (y - y_n - (t - t_n) v),    L_g = (1 - P_g⁻¹)/g,

with P_g ≈ (1 - g L)⁻¹ given as a multiplication, so that a stage needs nothing but P_g, and v
the mean velocity of the step before. The order is two whatever L and v are, as the explicit part
is the rest of the rate. But L may be off by its own size where stiff neighbours push each other,
and then g L acts on what the stages do not know of each other: taken about y_n alone (v = 0), the
error is of first order in g until g L is small; about the path that the solution was just on, it
is of second order.

After the stages, stiff modes are brought nearer to where the slow ones want them, by

    y_{n+1} += w g P_g [f_n + f_{n+1} - 2 (y_{n+1} - y_n)/Δt],

which is of third order in Δt where all is smooth, and costs one evaluation. The stages alone leave
a third to all of what stiff modes are away; in forces and velocities, that would count.

In a mode whose rate is -λ, of which P_g knows -l, the recurrence sees g λ/(1 + g l): steps are
stable while the spectral radius of g P_g J is at most 1 + 1/w₀. Where l ≥ λ/2 they are stable
whatever their length, and it takes stages only for what L does not know at all.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.integrators.chebyshev import DAMPING, MOST_STAGES
from softslip.solver.integrators.spectral import with_radius
from softslip.solver.integrators.step_control import (
    MOST_REJECTIONS,
    RADIUS_AGE,
    RADIUS_SAFETY,
    Counted,
    Trial,
    check_advances,
    exhausted,
    largest_over,
    local_error,
    next_wish,
    shrinking,
)
from softslip.solver.integrators.stepping import (
    Accuracy,
    Rate,
    Response,
    Solve,
    Step,
    StepStart,
    compiled,
    explicit_only,
    landing,
)
from softslip.solver.stepper_memory import Memory, Vector

FEWEST_STAGES = 5
"""Stages of a step at least. At equal error, steps of 4 to 8 stages take the same work per time, of
3 a tenth more; more stages let rejections be fewer."""

SMOOTHING = 0.5
"""Weight of the smoothing after the stages, the largest that is stable as far as the stages are: of
what a stiff mode is away from where the slow ones want it, R of which the stages leave, it leaves
R - g λ/(1 + g l) (1 + R)/2, from -1/3 to 0 where all of the rate is known."""

SHIFT_CHANGE = 1.5
"""Ratio of g to that of the last estimate of the spectral radius from which it is estimated anew:
the radius of P_g J falls as g grows."""


def imex_rkc2(
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
    """Partitioned Runge-Kutta-Chebyshev, second order, as `Integrator` describes.

    Steps follow the embedded estimate of the local error as those of `rkc2` do. Stiff modes that
    are slaved to slow ones have a rate that is far larger than their change: P_g, applied to the
    estimate twice, leaves of them what counts.

    Raises
    ------
    NumericalError
        If the rate is not finite at the point or next to it, if `MOST_REJECTIONS` trials in a row
        were rejected, or if the step became too short to advance the time.
    """
    counted = Counted(rate)
    origin = StepStart(vector, time, first_rate)
    wish, fresh = memory.step_size, False
    for rejections in range(MOST_REJECTIONS):
        if not fresh and (rejections or _is_old(memory, min(wish, largest, until - time))):
            dt, _ = landing(time, until, min(wish, largest))
            memory = _with_radius(counted, origin, memory, accuracy.scale, dt, response)
            fresh = True
        dt, end = landing(time, until, min(wish, largest, _longest_stable(memory.spectral_radius)))
        check_advances(time, end, dt)
        stages = _stages(dt * memory.spectral_radius)
        trial = _attempt(counted, origin, dt, end, stages, accuracy, memory.drift, response)
        if trial.error <= 1.0:
            wanted = next_wish(dt, wish, trial.error)
            step = min(wanted, wish) if rejections else wanted
            drift = (trial.vector - vector) / dt
            return Step(
                vector=trial.vector,
                time=end,
                rate=trial.rate,
                memory=replace(memory, step_size=step, drift=drift).older(),
                error=trial.error,
                stages=stages,
                evaluations=counted.evaluations,
                rejections=rejections,
            )
        wish = dt * shrinking(trial.error)
        if not fresh and trial.error < math.inf:  # the mode that grew tells best where to look
            memory = replace(memory, direction=trial.estimate)
    raise exhausted(time, dt, trial, accuracy.scale) from trial.cause


def _is_old(memory: Memory, dt: float) -> bool:
    """Whether the spectral radius has to be estimated before a step Δt."""
    shift = dt * _scheme(FEWEST_STAGES).shift
    return (
        memory.direction.size == 0
        or memory.radius_age >= RADIUS_AGE
        or shift > SHIFT_CHANGE * memory.shift
    )


def _with_radius(
    rate: Rate, origin: StepStart, memory: Memory, scale: Vector, dt: float, response: Response
) -> Memory:
    """Return the memory with the spectral radius of P_g J, at the g of the fewest stages.

    More stages have a smaller g. They are wanted where g ρ is too large, which modes make that L
    does not know; of those the radius hardly depends on g.
    """
    shift = dt * _scheme(FEWEST_STAGES).shift
    solve = response(origin.vector, shift)

    def answered(vector: Vector, time: float) -> Vector:
        return solve(rate(vector, time))

    start = replace(origin, rate=solve(origin.rate))
    return replace(with_radius(answered, start, memory, scale), shift=shift)


def _longest_stable(radius: float) -> float:
    """Longest step that `MOST_STAGES` stages keep stable."""
    scheme = _scheme(MOST_STAGES)
    stiffness = RADIUS_SAFETY * radius * scheme.shift
    return scheme.reach / stiffness if radius > 0.0 else math.inf


def _stages(stiffness: float) -> int:
    """Fewest stages that are stable at Δt times the spectral radius of P_g J."""
    for stages in range(FEWEST_STAGES, MOST_STAGES):
        scheme = _scheme(stages)
        if RADIUS_SAFETY * stiffness * scheme.shift <= scheme.reach:
            return stages
    return MOST_STAGES


@dataclass(frozen=True)
class _Stage:
    """Coefficients of a stage, with u = Y - Y_0, of the residual r that P_g is applied to.

    r_j = last u_{j-1} + older u_{j-2} + Δt [rate (F_{j-1} - I_{j-1}) + first_rate F_0
    - implicit I_{j-2} - c_j v], and then u_j = c_j Δt v + P r_j, I_j = (P r_j - r_j)/g.
    """

    node: float  # c_j, the time of the stage in units of Δt
    last: float
    older: float
    rate: float
    first_rate: float
    implicit: float


@dataclass(frozen=True)
class _Scheme:
    """Stages from the second, μ̃₁ = g/Δt, and the largest stable g ρ(P_g J)."""

    stages: tuple[_Stage, ...]
    shift: float
    reach: float


@lru_cache(maxsize=MOST_STAGES)
def _scheme(stages: int) -> _Scheme:
    """Coefficients from the recurrence of the Chebyshev polynomials, with b₀ = 1 and b₁ = 1/w₀."""
    w0 = 1.0 + DAMPING / stages**2
    T, dT, ddT = [1.0, w0], [0.0, 1.0], [0.0, 0.0]
    for j in range(2, stages + 1):
        T.append(2.0 * w0 * T[j - 1] - T[j - 2])
        dT.append(2.0 * w0 * dT[j - 1] - dT[j - 2] + 2.0 * T[j - 1])
        ddT.append(2.0 * w0 * ddT[j - 1] - ddT[j - 2] + 4.0 * dT[j - 1])
    w1 = dT[stages] / ddT[stages]
    b = [1.0, 1.0 / w0, *(ddT[j] / dT[j] ** 2 for j in range(2, stages + 1))]
    shift = w1 / w0
    # The last node is 1 by construction, but not to the last bit.
    c = [0.0, shift, *(w1 * ddT[j] / dT[j] for j in range(2, stages)), 1.0]
    rows = [_Stage(shift, 0.0, 0.0, 0.0, shift, 0.0)]
    for j in range(2, stages + 1):
        last, older = 2.0 * w0 * b[j] / b[j - 1], -b[j] / b[j - 2]
        share = 2.0 * w1 * b[j] / b[j - 1]
        first = -(1.0 - b[j - 1] * T[j - 1]) * share
        rows.append(_Stage(c[j], last, older, share, first, older * shift))
    return _Scheme(tuple(rows), shift, 1.0 + 1.0 / w0)


@compiled
def _residual(
    out: Vector,
    last: Vector,
    older: Vector,
    rate: Vector,
    implicit: Vector,
    first_rate: Vector,
    before: Vector,
    drift: Vector,
    weights: tuple[float, float, float, float, float, float],
) -> None:
    """Fill the residual of a stage; see `_Stage`."""
    a, b, c, d, e, f = weights
    for i in range(out.size):
        value = a * last[i] + b * older[i] + c * (rate[i] - implicit[i])
        out[i] = value + d * first_rate[i] - e * before[i] - f * drift[i]


@compiled
def _finish(
    vector: Vector,
    change: Vector,
    implicit: Vector,
    residual: Vector,
    solved: Vector,
    origin: Vector,
    drift: Vector,
    passed: float,
    per_shift: float,
) -> bool:
    """Fill a stage's vector, its change, and its implicit rate; return whether it is finite."""
    spoilt = 0.0
    for i in range(vector.size):
        value = passed * drift[i] + solved[i]
        change[i] = value
        implicit[i] = per_shift * (solved[i] - residual[i])
        vector[i] = origin[i] + value
        spoilt += 0.0 * vector[i]  # stays 0 unless a value is NaN or infinite; no branch
    return spoilt == 0.0


def fixed_imex_step(
    rate: Rate,
    vector: Vector,
    time: float,
    dt: float,
    stages: int,
    response: Response,
    drift: Vector,
) -> Vector:
    """Return what one step of a given length and number of stages leads to, whatever its error.

    It has nothing of `imex_rkc2` but the scheme: no control of steps, no choice of stages. What is
    not finite is left for the caller to see.

    Raises
    ------
    NumericalError
        If the rate does.
    """
    origin = StepStart(vector, time, rate(vector, time))
    anything = Accuracy(math.inf, np.ones_like(vector))
    return _partitioned(rate, origin, dt, time + dt, stages, anything, drift, response).vector


def _attempt(
    rate: Rate,
    origin: StepStart,
    dt: float,
    end: float,
    stages: int,
    accuracy: Accuracy,
    drift: Vector,
    response: Response,
) -> Trial:
    """Try a step; the last call of ``rate`` is at its end."""
    try:
        return _partitioned(rate, origin, dt, end, stages, accuracy, drift, response)
    except NumericalError as cause:
        return Trial(origin.vector, origin.rate, origin.rate, math.inf, cause)


def _partitioned(
    rate: Rate,
    origin: StepStart,
    dt: float,
    end: float,
    stages: int,
    accuracy: Accuracy,
    drift: Vector,
    response: Response,
) -> Trial:
    """Go through the stages; stop at one that is not finite before the rate sees it."""
    y0, f0 = origin.vector, origin.rate
    scheme = _scheme(stages)
    shift = scheme.shift * dt
    solve: Solve = response(y0, shift)
    if drift.size == 0:
        drift = solve(f0)
    f, nothing = f0, np.zeros_like(y0)
    last = older = implicit = before = nothing
    for stage in scheme.stages:
        residual = np.empty_like(y0)
        weights = (
            stage.last,
            stage.older,
            dt * stage.rate,
            dt * stage.first_rate,
            dt * stage.implicit,
            dt * stage.node,
        )
        _residual(residual, last, older, f, implicit, f0, before, drift, weights)
        solved = solve(residual)
        vector, change, answer = np.empty_like(y0), np.empty_like(y0), np.empty_like(y0)
        passed = dt * stage.node
        if not _finish(vector, change, answer, residual, solved, y0, drift, passed, 1.0 / shift):
            return Trial(vector, f, f, math.inf)
        last, older, implicit, before = change, last, answer, implicit
        f = rate(vector, end if stage.node == 1.0 else origin.time + stage.node * dt)
    estimate = residual
    if local_error(estimate, dt, y0, vector, f0, f, accuracy.scale) == math.inf:
        return Trial(vector, f, estimate, math.inf)
    # The estimate is 0.4 Δt [f_n + f_{n+1} - 2 (y_{n+1} - y_n)/Δt].
    smoothed = vector + (SMOOTHING * shift / (0.4 * dt)) * solve(estimate)
    if not np.isfinite(smoothed).all():
        return Trial(smoothed, f, estimate, math.inf)
    vector, f = smoothed, rate(smoothed, end)
    if local_error(estimate, dt, y0, vector, f0, f, accuracy.scale) == math.inf:
        return Trial(vector, f, estimate, math.inf)
    estimate = solve(solve(estimate))
    error = largest_over(estimate, accuracy.scale) / accuracy.tolerance
    return Trial(vector, f, estimate, error)
