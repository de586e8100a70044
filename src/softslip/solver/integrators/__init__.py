"""Time steppers: they advance a vector and know nothing of what it means."""

from softslip.solver.integrators.chebyshev import rkc2
from softslip.solver.integrators.explicit import euler
from softslip.solver.integrators.partitioned import imex_rkc2
from softslip.solver.integrators.stepping import Accuracy, Integrator, Rate, Response, Solve, Step
from softslip.solver.stepper_memory import Memory, Vector

__all__ = [
    "INTEGRATORS",
    "Accuracy",
    "Integrator",
    "Memory",
    "Rate",
    "Response",
    "Solve",
    "Step",
    "Vector",
    "euler",
    "imex_rkc2",
    "rkc2",
]

INTEGRATORS: dict[str, Integrator] = {"euler": euler, "rkc2": rkc2, "imex_rkc2": imex_rkc2}
"""Steppers by the name that `time_stepping.integrator` gives them."""
