"""Relaxation of a nearly circular membrane in fluid at rest, which linear theory solves exactly.

Nodes X = (a + w) e_r + v e_θ of a circle of radius a whose rest perimeter is 2πa/λ₀, so that it is
under the tension T₀ = K_e(λ₀ - 1); w = W cos nα and v = V sin nα are small. The part of the
membrane force along the membrane's own normal that is constant only changes the pressure inside;
what is left of it, per unit length of the circle, has the components p cos nα and q sin nα with

    p = -[K_e λ₀ (W + nV) + T₀ (n² - 1) W]/a²,    q = -K_e λ₀ n (W + nV)/a².

Forces (p, q) move the circle, with matched viscosities, at

    (P, Q) = a/(4η(n² - 1)) [[n, -1], [-1, n]] (p, q),

as one finds by writing the single layer in z = a e^{iα}, where r̂² is -zz'/a². The product of both
matrices is triangular, and its eigenvalues are

    n T₀/(4ηa)   with V = -W/n, a deformation without stretch (the slow mode),
    n K_e λ₀/(4ηa)   with W = 0, a stretch without deformation (the fast mode).

Without a tension at rest, the slow mode does not decay at all. In the solver forces act on the
fluid over the regularisation length ε: its own linear theory has the integrals of `response`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from scipy.special import jv, jvp

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.simulation import trajectory
from softslip.simulation.assembly import regularisation_of
from softslip.simulation.expansion import membrane_node_counts
from softslip.simulation.sample import wall_contour
from softslip.solver.geometry import FloatArray, Layout, wall_positions
from softslip.studies.scenes import Scene
from softslip.studies.validation.capsule import unbounded
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.lone import RADIUS, lone_parameters, lone_scene, two_sides

DECAY = 1.0
"""Part of the decay time, its inverse rate, over which the rate is measured."""

LOOKS = 32
"""Times at which the amplitude is looked at, where steps end."""

DECAYED = 7.0
"""Argument εk beyond which e^{-ε²k²} counts as zero."""

STEP_ERROR = 2e-4
"""Relative error of a rate that steps of second order make, ended by those times: (r Δt)²/6."""

UNEXPLAINED = 0.01
"""Relative error of a rate that nothing accounts for: levels leave 0.1 %, and the mesh responds to
short waves not quite like a Gaussian of the same second moment."""

SAMPLES_PER_WAVE = 16
"""Points of the integrals of Bessel functions for each of their half-waves."""


@dataclass(frozen=True)
class Ring:
    """Linear theory of a membrane near the circle.

    Attributes
    ----------
    radius, stretch, mode
        a, λ₀ and n ≥ 2.
    regularisation
        ε of the fluid's response; 0 is the theory of a sharp membrane.
    """

    radius: float
    stretch: float
    mode: int
    regularisation: float = 0.0

    def response(self) -> FloatArray:
        """Return the matrix from (p, q) to (P, Q), η = 1, shape (2, 2).

        With ε it is that of the streamfunction ψ_k = e^{-ε²k²} (n p J_n - k a q J_n')/k⁴ of the
        ring of forces, by Hankel transforms, with J_n = J_n(ka).
        """
        n, a = self.mode, self.radius
        if self.regularisation == 0:
            return a / (4 * (n * n - 1)) * np.array([[n, -1.0], [-1.0, n]])
        end = DECAYED * a / self.regularisation
        count = math.ceil(end / math.pi) * SAMPLES_PER_WAVE
        nodes, weights = np.polynomial.legendre.leggauss(SAMPLES_PER_WAVE)
        edges = np.linspace(0.0, end, count // SAMPLES_PER_WAVE + 1)
        half = 0.5 * np.diff(edges)[:, None]
        x = (edges[:-1, None] + half * (1 + nodes)).ravel()
        weight = (half * weights).ravel() * np.exp(-((self.regularisation * x / a) ** 2))
        bessel, slope = jv(n, x), jvp(n, x)
        radial = np.sum(weight * (n * bessel) ** 2 / x**3)
        mixed = -np.sum(weight * n * bessel * slope / x**2)
        along = np.sum(weight * slope**2 / x)
        return a * np.array([[radial, mixed], [mixed, along]])

    def forces(self) -> FloatArray:
        """Return the matrix from (W, V) to (p, q), K_e = 1, shape (2, 2)."""
        n, tension = self.mode, self.stretch - 1
        stretching = self.stretch * np.array([[1.0, n], [n, n * n]])
        straightening = tension * np.array([[n * n - 1.0, 0.0], [0.0, 0.0]])
        return -(stretching + straightening) / self.radius**2

    def modes(self) -> tuple[FloatArray, FloatArray]:
        """Return both decay rates, the slow one first, and (W, V) of both as columns."""
        rates, columns = np.linalg.eig(-self.response() @ self.forces())
        order = np.argsort(rates.real)
        return rates.real[order], columns.real[:, order]


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
        RADIUS,
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
        state = scene.state
        for stop in stops:
            state = trajectory.advance(
                scene.suspension, state, np.array([stop]), parameters, _ignore, _ignore
            ).state
            times.append(float(stop))
            amplitudes.append(float(along @ self._shape(state.node_position)))
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
        outward = np.column_stack((np.cos(angle), np.sin(angle)))
        around = np.column_stack((-np.sin(angle), np.cos(angle)))
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


def _ignore(*_: object) -> None:
    """Show nothing."""
