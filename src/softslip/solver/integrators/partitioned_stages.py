"""The stages of the partitioned scheme: coefficients, residuals, and a step through all of them."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from softslip.solver.integrators.recurrence import MOST_STAGES, ChebyshevRecurrence, StageTerms
from softslip.solver.integrators.step_control import Trial, largest_over, local_error
from softslip.solver.integrators.stepping import (
    Accuracy,
    Rate,
    Response,
    Solve,
    StepStart,
    compiled,
)
from softslip.solver.stepper_memory import Vector

SMOOTHING = 0.5
"""Weight of the smoothing after the stages, the largest that is stable as far as the stages are: of
what a stiff mode is away from where the slow ones want it, R of which the stages leave, it leaves
R - g λ/(1 + g l) (1 + R)/2, from -1/3 to 0 where all of the rate is known."""


@dataclass(frozen=True)
class PartitionedScheme:
    """Coefficients of the stages for some number of them.

    With u = Y - Y_0, stage j applies P_g to the residual

        r_j = last u_{j-1} + older u_{j-2} + Δt [rate (F_{j-1} - I_{j-1}) + first_rate F_0
              - older μ̃₁ I_{j-2} - c_j v],

    and then u_j = c_j Δt v + P r_j, I_j = (P r_j - r_j)/g.

    Attributes
    ----------
    stages
        Of the residuals.
    shift
        μ̃₁ = g/Δt.
    reach
        Largest stable g ρ(P_g J).
    """

    stages: tuple[StageTerms, ...]
    shift: float
    reach: float


@lru_cache(maxsize=MOST_STAGES)
def partitioned_scheme(stages: int) -> PartitionedScheme:
    """Return the coefficients with b₀ = 1 and b₁ = 1/w₀, which make g the same in all stages."""
    recurrence = ChebyshevRecurrence(stages)
    shift = recurrence.w1 / recurrence.w0
    first = StageTerms(shift, 0.0, 0.0, 0.0, shift)
    later = recurrence.stages(1.0, 1.0 / recurrence.w0)
    return PartitionedScheme((first, *later), shift, 1.0 + 1.0 / recurrence.w0)


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
    """Fill the residual of a stage; see `PartitionedScheme`."""
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
    return partitioned_stages(rate, origin, dt, time + dt, stages, anything, drift, response).vector


def partitioned_stages(
    rate: Rate,
    origin: StepStart,
    dt: float,
    end: float,
    stages: int,
    accuracy: Accuracy,
    drift: Vector,
    response: Response,
) -> Trial:
    """Go through the stages; stop at one that is not finite before the rate sees it.

    Parameters
    ----------
    rate, origin
        What is stepped, and from where.
    dt, end, stages
        Δt, the time after it, and the number of stages.
    accuracy
        How wrong the step may be.
    drift
        v, the mean velocity of the step before; empty for P_g f_n.
    response
        P_g.

    Raises
    ------
    NumericalError
        If the rate does.
    """
    y0, f0 = origin.vector, origin.rate
    scheme = partitioned_scheme(stages)
    shift = scheme.shift * dt
    solve: Solve = response(y0, shift)
    if drift.size == 0:
        drift = solve(f0)
    f, nothing = f0, np.zeros_like(y0)
    last = older = implicit = before = nothing
    for stage in scheme.stages:
        residual = np.empty_like(y0)
        passed = dt * stage.node
        weights = (
            stage.last,
            stage.older,
            dt * stage.rate,
            dt * stage.first_rate,
            dt * (stage.older * scheme.shift),
            passed,
        )
        _residual(residual, last, older, f, implicit, f0, before, drift, weights)
        solved = solve(residual)
        vector, change, answer = np.empty_like(y0), np.empty_like(y0), np.empty_like(y0)
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
