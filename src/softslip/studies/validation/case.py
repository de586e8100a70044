"""What a validation case is: parameters of its own, a result, and the exact solution beside it."""

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from softslip.config.fields import quantity
from softslip.config.sections import Standalone
from softslip.errors import NumericalError

Fidelity = Literal["literal", "preview", "standard", "paper", "converged"]
"""Levels that a case can be solved at; 'literal' is the paper's own scheme."""


@dataclass(frozen=True)
class Outcome:
    """What came out of a case, next to what should have.

    Attributes
    ----------
    case
        Name of the case.
    parameters
        The case's own, all of them.
    result, reference
        The same quantities by name, from the solver and from the exact solution; a result may
        have more than there is a reference for.
    errors
        By name; the first is the one that the case is judged by.
    tolerances
        Largest acceptable value of each error.
    """

    case: str
    parameters: Mapping[str, Any]
    result: Mapping[str, float]
    reference: Mapping[str, float]
    errors: Mapping[str, float]
    tolerances: Mapping[str, float]

    @property
    def error(self) -> float:
        """The first of the errors."""
        return next(iter(self.errors.values()))

    @property
    def passed(self) -> bool:
        """Whether every error is a number within its tolerance."""
        return all(
            math.isfinite(error) and error <= self.tolerances[name]
            for name, error in self.errors.items()
        )

    def as_mapping(self) -> dict[str, Any]:
        """Return everything as plain numbers and words, for JSON."""
        return {
            "case": self.case,
            "parameters": dict(self.parameters),
            "result": dict(self.result),
            "reference": dict(self.reference),
            "error": self.error,
            "errors": dict(self.errors),
            "tolerances": dict(self.tolerances),
            "passed": self.passed,
        }


class Case(Standalone):
    """A flow with a known solution, and the settings of the solver that is tried on it.

    Subclasses add their parameters as fields, so that bounds, units and meanings are in one place.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One line on what is solved."""

    units: ClassVar[Mapping[str, tuple[str, str]]]
    """Unit and meaning of every result and error, by name."""

    fidelity: Fidelity = quantity(
        "paper",
        symbol="fidelity",
        unit="1",
        description="Level of the numerical settings; 'literal' is the paper's own scheme.",
    )
    tolerance: float | None = quantity(
        None,
        symbol="tol",
        unit="1",
        gt=0,
        description="Largest acceptable error; null takes the case's own.",
    )

    @abstractmethod
    def solve(self) -> Outcome:
        """Solve the case and compare.

        Raises
        ------
        SoftslipError
            When the solver stops, or the settings make no scene.
        """

    def outcome(
        self,
        result: Mapping[str, float],
        reference: Mapping[str, float],
        errors: Mapping[str, float],
        tolerances: Mapping[str, float],
    ) -> Outcome:
        """Return an outcome of this case; its ``tolerance`` replaces that of the first error.

        Raises
        ------
        NumericalError
            When a result is not a number.
        """
        for name, value in result.items():
            if not math.isfinite(value):
                raise NumericalError(name, 0, 0, "is not finite; use a higher fidelity")
        limits = dict(tolerances)
        if self.tolerance is not None:
            limits[next(iter(errors))] = self.tolerance
        parameters = self.model_dump(exclude={"tolerance"})
        return Outcome(self.name, parameters, result, reference, errors, limits)
