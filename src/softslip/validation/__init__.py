"""Flows with known solutions that anyone can run the solver on, at any parameters."""

from softslip.validation.capsule import Capsule
from softslip.validation.case import Case, Outcome
from softslip.validation.couette import Couette
from softslip.validation.cylinders import Cylinders
from softslip.validation.ellipse import Ellipse
from softslip.validation.film import Film
from softslip.validation.friction import Friction
from softslip.validation.manufactured import Manufactured
from softslip.validation.order import Order
from softslip.validation.quadrature import Quadrature
from softslip.validation.sweeps import sweep

CASES: dict[str, type[Case]] = {
    Couette.name: Couette,
    Film.name: Film,
    Manufactured.name: Manufactured,
    Cylinders.name: Cylinders,
    Capsule.name: Capsule,
    Ellipse.name: Ellipse,
    Order.name: Order,
    Quadrature.name: Quadrature,
    Friction.name: Friction,
}
"""All cases by name."""

__all__ = ["CASES", "Case", "Outcome", "sweep"]
