"""Relaxation of a nearly circular membrane in fluid at rest, against linear theory."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.simulation.assembly import regularisation_of
from softslip.simulation.expansion import membrane_node_counts
from softslip.simulation.sample import wall_contour
from softslip.solver.geometry import FloatArray, Layout, wall_positions
from softslip.studies.boxes import MEAN_RADIUS
from softslip.studies.scenes import Scene, advance_to
from softslip.studies.validation.capsule import unbounded
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.ring_theory import Ring
from softslip.studies.validation.single_particle import (
    lone_parameters,
    lone_scene,
    two_sides,
    unit_circle,
)

DECAY = 1.0
"""Part of the decay time, its inverse rate, over which the rate is measured."""

LOOKS = 32
"""Times at which the amplitude is looked at, where steps end."""

STEP_ERROR = 2e-4
"""Relative error of a rate that steps of second order make, ended by those times: (r Δt)²/6."""

UNEXPLAINED = 0.01
"""Relative error of a rate that nothing accounts for: levels leave 0.1 %, and the mesh responds to
short waves not quite like a Gaussian of the same second moment."""


@dataclass(frozen=True)
class TautLayout(Layout):
    """A layout whose particles are larger than circles at their rest length.

    Attributes
    ----------
    areas
        Area of each particle [length unit squared], shape (P,).
    """

    areas: FloatArray

    @cached_property
    def reference_area(self) -> FloatArray:
        """Area of each particle, shape (P,)."""
        return self.areas


class Ellipse(Case):
    """A taut membrane that is nearly a circle, at rest in fluid at rest."""

    name: ClassVar[str] = "ellipse"
    summary: ClassVar[str] = "decay of a small deformation of a taut circle, against linear theory"
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "rate": ("1 / time unit", "decay rate of the mode"),
        "rate_regularised": (
            "1 / time unit",
            "decay rate of the mode in a fluid that forces act on over the regularisation length",
        ),
        "amplitude_left": ("1", "amplitude at the end over that at the start, in the larger box"),
        "smaller_box": ("radius", "side of the smaller of the two boxes"),
        "larger_box": ("radius", "side of the larger of the two boxes"),
        "finite_size_correction": (
            "1 / time unit",
            "what the extrapolation to an unbounded fluid changed of the larger box's rate",
        ),
    }

    mode: int = quantity(
        2, symbol="n", unit="1", ge=2, le=8, description="Number of waves around the circle."
    )
    branch: Literal["slow", "fast"] = quantity(
        "slow",
        symbol="branch",
        unit="1",
        description="'slow' deforms the membrane and stretches it nowhere; 'fast' moves its points "
        "along the circle.",
    )
    stretch: float = quantity(
        1.1,
        symbol="λ₀",
        unit="1",
        ge=1.01,
        le=2,
        description="Perimeter of the circle over its rest perimeter.",
    )
    amplitude: float = quantity(
        3e-3,
        symbol="A/a",
        unit="1",
        ge=1e-6,
        le=0.05,
        description="Largest displacement at the start over the radius; the theory is linear.",
    )
    radius: float = quantity(
        MEAN_RADIUS,
        symbol="a",
        unit="length unit",
        ge=0.003,
        le=0.05,
        description="Radius of the circle.",
    )
    box: float = quantity(
        48.0,
        symbol="L/a",
        unit="1",
        ge=12,
        le=100,
        description="Wanted side of the larger box over the radius, period and distance of the "
        "walls; the smaller box has half of it.",
    )

    def solve(self) -> Outcome:
        """Let the deformation decay in two boxes, and remove what the boxes do, of order 1/L².

        The regularisation's own share of the difference from the sharp theory is known, and is
        allowed: judged is what remains.

        Raises
        ------
        ConfigError
            When the settings make no scene.
        NumericalError
            When the solver stops.
        """
        sides = two_sides(self.box, self.radius)
        (small, _), (large, remaining) = (self.decay(side) for side in sides)
        rate = unbounded(sides, [small, large])
        result = {
            "rate": rate,
            "rate_regularised": rate,
            "amplitude_left": remaining,
            "smaller_box": sides[0] / self.radius,
            "larger_box": sides[1] / self.radius,
            "finite_size_correction": rate - large,
        }
        exact = self._rate(0.0)
        regularised = self._rate(regularisation_of(self.parameters(sides[1])))
        reference = {"rate": exact, "rate_regularised": regularised}
        errors = {name: abs(result[name] / value - 1) for name, value in reference.items()}
        left = UNEXPLAINED + self._step_error(regularised, sides[1])
        tolerances = {"rate": left + abs(regularised / exact - 1), "rate_regularised": left}
        return self.outcome(result, reference, errors, tolerances)

    def _step_error(self, rate: float, side: float) -> float:
        """Return by how much, relatively, the time steps may change a rate at most.

        Explicit Euler steps decay by ln(1 - r Δt)/Δt, half of r Δt too fast.
        """
        stepping = self.parameters(side).time_stepping
        if stepping.integrator != "euler":
            return STEP_ERROR
        return 0.5 * min(rate * stepping.step, DECAY / LOOKS)

    def parameters(self, side: float) -> Parameters:
        """Return the solver's parameters in a box of some side [length unit]."""
        rest = {"mode": "stress", "stress": 0.0}
        return lone_parameters(self.fidelity, side, self.radius, rest)

    def decay(self, side: float) -> tuple[float, float]:
        """Return the decay rate in a box [1 / time unit], and the part of the amplitude left."""
        parameters = self.parameters(side)
        epsilon = regularisation_of(parameters)
        rates, columns = Ring(self.radius, self.stretch, self.mode, epsilon).modes()
        branch = 0 if self.branch == "slow" else 1
        direction = columns[:, branch] / np.abs(columns[:, branch]).max()
        scene = self._scene(parameters, direction)
        stops = DECAY / rates[branch] * np.arange(1, LOOKS + 1) / LOOKS
        # The other branch of what is left would spoil the rate: the left eigenvector does not see
        # it.
        along = np.linalg.inv(columns)[branch]
        times, amplitudes = [0.0], [float(along @ self._shape(scene.state.node_position))]
        for stop in stops:
            scene = replace(scene, state=advance_to(scene, np.array([stop])).state)
            times.append(float(stop))
            amplitudes.append(float(along @ self._shape(scene.state.node_position)))
        left = np.abs(amplitudes) / abs(amplitudes[0])
        return -float(np.polyfit(times, np.log(left), 1)[0]), float(left[-1])

    def _rate(self, regularisation: float) -> float:
        rates, _ = Ring(self.radius, self.stretch, self.mode, regularisation).modes()
        return float(rates[0 if self.branch == "slow" else 1])

    def _scene(self, parameters: Parameters, direction: FloatArray) -> Scene:
        """Return the circle displaced along (W, V), whose largest displacement is the amplitude."""
        count = int(membrane_node_counts(parameters)[0])
        angle = 2 * np.pi * np.arange(count) / count
        small = self.amplitude * direction
        # The sum of the squares of w and v would change the area at second order.
        area = 1 + 0.5 * float(small[0] ** 2 + small[1] ** 2) + self.mode * small[0] * small[1]
        radial = 1 / math.sqrt(area) + small[0] * np.cos(self.mode * angle)
        shift = small[1] * np.sin(self.mode * angle)
        outward = unit_circle(count)
        around = np.column_stack((-outward[:, 1], outward[:, 0]))
        shape = self.radius * (radial[:, None] * outward + shift[:, None] * around)
        return lone_scene(parameters, shape, self._layout(parameters, count))

    def _layout(self, parameters: Parameters, count: int) -> TautLayout:
        hydrodynamics, contour = parameters.hydrodynamics, wall_contour(parameters)
        spacing = hydrodynamics.node_spacing / hydrodynamics.resolution
        walls = wall_positions(contour, parameters.channel.height, spacing)
        perimeter = 2 * math.pi * self.radius
        return TautLayout(
            np.array([0, count], dtype=np.int64),
            np.array([perimeter / (self.stretch * count)]),
            walls,
            contour.arc_length / walls.shape[1],
            np.array([math.pi * self.radius**2]),
        )

    def _shape(self, points: FloatArray) -> FloatArray:
        """Return (W, V) of a membrane about its own centre, shape (2,) [length unit]."""
        angle = 2 * np.pi * np.arange(len(points)) / len(points)
        relative = points - points.mean(axis=0)
        radial = relative[:, 0] * np.cos(angle) + relative[:, 1] * np.sin(angle)
        around = relative[:, 1] * np.cos(angle) - relative[:, 0] * np.sin(angle)
        cosine, sine = np.cos(self.mode * angle), np.sin(self.mode * angle)
        return 2 / len(points) * np.array([np.sum(radial * cosine), np.sum(around * sine)])
