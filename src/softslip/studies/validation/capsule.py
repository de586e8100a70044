"""A capsule in unbounded shear: the whole solver against a boundary integral."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.errors import ConfigError, NumericalError
from softslip.solver.step_limits import LARGEST_MOVE
from softslip.studies.boxes import MEAN_RADIUS
from softslip.studies.scenes import Scene, advance_to
from softslip.studies.validation.boundary_integral import steady_capsule
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.inertia import deformation, moments
from softslip.studies.validation.single_particle import (
    layout_of_circles,
    lone_parameters,
    lone_scene,
    two_sides,
    unit_circle,
)

WINDOW, STEADY = 6, 5e-4
"""A capsule is steady when D has stayed within this relative range while γ̇t grew by the window: a
long capsule swings about its steady state with a longer period than a turn of its membrane."""

MOST_STRAIN = 80
"""Shear γ̇t by which a capsule must be steady."""

EULER_STRAIN = 12
"""Shear γ̇t at which 'literal' is looked at, as it is never steady: Euler steps swell a membrane
that treads with the frequency ω at the rate ω²Δt, which its area correction does not undo."""

TOLERANCES: Mapping[str, float] = {"taylor_deformation": 0.02, "inclination": 1.0}
"""What is left of D at 'paper' is 1.2 % at G = 0.4, where the tips of the capsule are curved with
some ten times the regularisation length, and 0.1 % up to G = 0.125; coarser nodes add little."""


@dataclass(frozen=True)
class Treading:
    """A steady capsule of the solver, in one box.

    Attributes
    ----------
    side
        L_x and H over the radius.
    taylor_deformation, inclination
        D and θ [degrees] of the inertia ellipse.
    area_drift
        Relative change of the area since the start.
    strain
        Shear γ̇t at which it was steady.
    """

    side: float
    taylor_deformation: float
    inclination: float
    area_drift: float
    strain: float


class Capsule(Case):
    """A circular capsule, unstressed at first, in a shear flow of a given capillary number."""

    name: ClassVar[str] = "capsule"
    summary: ClassVar[str] = (
        "steady shape of one capsule in unbounded shear, against a boundary integral"
    )
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "taylor_deformation": ("1", "(L - B)/(L + B) of the inertia ellipse"),
        "inclination": ("degree", "angle of the inertia ellipse to the flow"),
        "area_drift": ("1", "relative change of the area since the start, in the larger box"),
        "strain": ("1", "shear after which the shape no longer changed, in the larger box"),
        "smaller_box": ("radius", "side of the smaller of the two boxes"),
        "larger_box": ("radius", "side of the larger of the two boxes"),
        "finite_size_correction": (
            "1",
            "what the extrapolation to an unbounded fluid changed of the larger box's deformation",
        ),
    }

    capillary: float = quantity(
        0.04,
        symbol="G",
        unit="1",
        ge=0.005,
        le=0.4,
        description="Capillary number ηγ̇a/K_e. Beyond 0.4 parts of a membrane without bending "
        "stiffness are so compressed that it crumples, and there is no steady shape.",
    )
    radius: float = quantity(
        MEAN_RADIUS,
        symbol="a",
        unit="length unit",
        ge=0.003,
        le=0.05,
        description="Radius of the unstressed capsule; the mean radius of the paper's particles "
        "is 69 of its mesh sizes.",
    )
    box: float = quantity(
        32.0,
        symbol="L/a",
        unit="1",
        ge=12,
        le=100,
        description="Wanted side of the larger box over the radius, period and distance of the "
        "walls; the smaller box has half of it.",
    )

    def solve(self) -> Outcome:
        """Shear a capsule in two boxes until it treads steadily, and remove what the boxes do.

        Walls at a distance L and images a period L away change the flow at the capsule, and the
        capsule the mean shear rate, all by 1/L² to leading order.

        Raises
        ------
        ConfigError
            When the settings make no scene, or the paper's steps are too long for this shear.
        NumericalError
            When the solver stops, or the capsule does not become steady.
        """
        sides = two_sides(self.box, self.radius)
        small, large = (self.treading(side) for side in sides)
        result = {
            name: unbounded([small.side, large.side], [getattr(small, name), getattr(large, name)])
            for name in TOLERANCES
        }
        result |= {
            "area_drift": large.area_drift,
            "strain": large.strain,
            "smaller_box": small.side,
            "larger_box": large.side,
            "finite_size_correction": result["taylor_deformation"] - large.taylor_deformation,
        }
        exact = steady_capsule(self.capillary)
        reference = {
            "taylor_deformation": exact.taylor_deformation,
            "inclination": exact.inclination,
        }
        errors = {
            "taylor_deformation": abs(result["taylor_deformation"] / exact.taylor_deformation - 1),
            "inclination": abs(result["inclination"] - exact.inclination),
        }
        return self.outcome(result, reference, errors, TOLERANCES)

    def parameters(self, side: float) -> Parameters:
        """Return the solver's parameters in a box of some side [length unit].

        Raises
        ------
        ConfigError
            When they make no scene, or the paper's steps are too long for this shear.
        """
        # In the solver's units η = K_e = 1.
        rheometer = {"mode": "rate", "stress": None, "shear_rate": self.capillary / self.radius}
        parameters = lone_parameters(self.fidelity, side, self.radius, rheometer)
        stepping = parameters.time_stepping
        fastest = LARGEST_MOVE * parameters.steric.length / stepping.step
        if stepping.integrator == "euler" and self.capillary > fastest:
            raise ConfigError(
                "capillary",
                self.capillary,
                f"moves nodes at about {self.capillary:.3g}, too far in the paper's steps of "
                f"{stepping.step:g}, which allow {fastest:.3g}",
                f"use at most {fastest:.2g} or a fidelity other than 'literal'",
            )
        return parameters

    def treading(self, side: float) -> Treading:
        """Return the steady capsule in a box of some side [length unit]."""
        parameters = self.parameters(side)
        scene = circle(parameters, self.radius)
        rate = self.capillary / self.radius
        euler = parameters.time_stepping.integrator == "euler"
        history: list[tuple[float, float, float]] = []
        for strain in range(1, MOST_STRAIN + 1):
            scene = replace(scene, state=advance_to(scene, np.array([strain / rate])).state)
            area, _, second = moments(scene.state.node_position)
            history.append((*deformation(second), area / (math.pi * self.radius**2) - 1))
            latest = [deformation for deformation, *_ in history[-WINDOW - 1 :]]
            steady = strain > WINDOW and max(latest) - min(latest) < STEADY * latest[-1]
            if steady or (euler and strain == EULER_STRAIN):
                return Treading(side / self.radius, *history[-1], float(strain))
        raise NumericalError(
            "taylor_deformation",
            0,
            scene.state.step,
            f"still changes after a shear of {MOST_STRAIN}; use a higher fidelity",
        )


def circle(parameters: Parameters, radius: float) -> Scene:
    """Return a circular membrane at its rest length in the middle of the channel."""
    layout = layout_of_circles(parameters, radius)
    return lone_scene(parameters, radius * unit_circle(layout.particle_nodes), layout)


def unbounded(sides: Sequence[float], values: Sequence[float]) -> float:
    """Return the limit of a quantity that two boxes of side L give, linear in 1/L²."""
    small, large = (side**-2 for side in sides)
    return values[1] + (values[1] - values[0]) * large / (small - large)
