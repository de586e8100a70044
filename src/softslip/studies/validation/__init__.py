"""Flows with known solutions that anyone can run the solver on, at any parameters."""

from softslip.studies.validation.capsule import Capsule
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.couette import Couette
from softslip.studies.validation.cylinders import Cylinders
from softslip.studies.validation.ellipse import Ellipse
from softslip.studies.validation.film import Film
from softslip.studies.validation.friction import Friction
from softslip.studies.validation.manufactured import Manufactured
from softslip.studies.validation.order import Order
from softslip.studies.validation.quadrature_case import Quadrature
from softslip.studies.validation.sweeps import sweep

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
