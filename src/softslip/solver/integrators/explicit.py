"""The explicit scheme of the paper, with a watch on its stability."""

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.integrators.spectral import with_radius
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

REACH = 2.0
"""Stable Δt times spectral radius of real, negative eigenvalues."""

RADIUS_SAFETY = 1.05
"""Factor on the estimated spectral radius: a power iteration closes in on it from below, and is
5 % short where it stops in dense packings."""

RADIUS_AGE = 200
"""Steps after which the spectral radius is estimated again, at the cost of a few of them."""

ADVISED = 0.7
"""Advised step over the longest stable one: contacts stiffen as films thin."""


def euler(
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
    """Explicit Euler, first order: y + Δt rate(y, t) (Eq. 17), as `Integrator` describes.

    The step is ``memory.step_size``, whatever ``accuracy``, ``largest`` and ``response`` say, and
    what is not finite is left for the caller to see. A step longer than 2/ρ makes the stiffest
    modes flip and grow; forces that stiffen can hold them at a finite size, where the numbers look
    sound and are not.
    So ρ is estimated every `RADIUS_AGE` steps, at first from scratch, and the step compared.

    Raises
    ------
    NumericalError
        If the step is longer than what is stable.
    """
    evaluations = 1

    def counted(point: Vector, moment: float) -> Vector:
        nonlocal evaluations
        evaluations += 1
        return rate(point, moment)

    dt, end = landing(time, until, memory.step_size)
    old = memory.direction.size == 0 or memory.radius_age >= RADIUS_AGE
    if old and np.isfinite(first_rate).all():
        origin = StepStart(vector, time, first_rate)
        memory = with_radius(counted, origin, memory, accuracy.scale, unconverged_safety=1.0)
        _check_stable(dt, memory, accuracy)
    advanced = vector + dt * first_rate
    return Step(
        vector=advanced,
        time=end,
        rate=rate(advanced, end),
        memory=memory.older(),
        error=0.0,
        stages=1,
        evaluations=evaluations,
        rejections=0,
    )


def _check_stable(dt: float, memory: Memory, accuracy: Accuracy) -> None:
    if RADIUS_SAFETY * dt * memory.spectral_radius <= REACH:
        return
    limit = REACH / (RADIUS_SAFETY * memory.spectral_radius)
    raise NumericalError(
        "state",
        int(np.argmax(np.abs(memory.direction) / accuracy.scale)),
        0,
        f"changes fastest where the time_stepping.step {dt:.4g} is longer than the stable "
        f"{limit:.4g}; use a time_stepping.step of at most {ADVISED * limit:.2g}, or "
        "time_stepping.integrator 'imex_rkc2'",
    )
