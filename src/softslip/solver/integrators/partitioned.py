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
from dataclasses import replace
from functools import partial

from softslip.solver.integrators.partitioned_stages import partitioned_scheme, partitioned_stages
from softslip.solver.integrators.recurrence import MOST_STAGES
from softslip.solver.integrators.spectral import with_radius
from softslip.solver.integrators.step_control import (
    MOST_REJECTIONS,
    RADIUS_AGE,
    RADIUS_SAFETY,
    Counted,
    attempted,
    check_advances,
    exhausted,
    next_wish,
    shrinking,
)
from softslip.solver.integrators.stepping import (
    Accuracy,
    Rate,
    Response,
    Step,
    StepStart,
    explicit_only,
    landing,
)
from softslip.solver.stepper_memory import Memory, Vector

FEWEST_STAGES = 5
"""Stages of a step at least. At equal error, steps of 4 to 8 stages take the same work per time, of
3 a tenth more; more stages let rejections be fewer."""

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
        trial = attempted(
            origin,
            partial(
                partitioned_stages,
                counted,
                origin,
                dt,
                end,
                stages,
                accuracy,
                memory.drift,
                response,
            ),
        )
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
    shift = dt * partitioned_scheme(FEWEST_STAGES).shift
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
    shift = dt * partitioned_scheme(FEWEST_STAGES).shift
    solve = response(origin.vector, shift)

    def answered(vector: Vector, time: float) -> Vector:
        return solve(rate(vector, time))

    start = replace(origin, rate=solve(origin.rate))
    return replace(with_radius(answered, start, memory, scale), shift=shift)


def _longest_stable(radius: float) -> float:
    """Longest step that `MOST_STAGES` stages keep stable."""
    scheme = partitioned_scheme(MOST_STAGES)
    stiffness = RADIUS_SAFETY * radius * scheme.shift
    return scheme.reach / stiffness if radius > 0.0 else math.inf


def _stages(stiffness: float) -> int:
    """Fewest stages that are stable at Δt times the spectral radius of P_g J."""
    for stages in range(FEWEST_STAGES, MOST_STAGES):
        scheme = partitioned_scheme(stages)
        if RADIUS_SAFETY * stiffness * scheme.shift <= scheme.reach:
            return stages
    return MOST_STAGES
