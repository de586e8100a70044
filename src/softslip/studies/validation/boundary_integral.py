"""A capsule in unbounded shear by a spectral boundary integral, independent of the solver.

The membrane is X(α), α in [0, 2π), unstressed on the circle of radius 1; viscosities match, so
that the flow is a single layer (Pozrikidis 1992, *Boundary Integral and Singularity Methods*),

    u(x) = G y e_x + (1/4π) ∫ (-ln r I + r r/r²) ∂(T τ)/∂α dα,    T = |X_α| - 1,    r = x - X(α),

in units of the radius a, the modulus K_e and the time ηa/K_e: the shear rate is then the capillary
number G = ηγ̇a/K_e. Nothing of the solver is used, only NumPy.

All material points are alike, so that a capsule at rest in shape treads: X(α, t) = Y(α + ωt), with
u(Y) = ω Y_α. Time steps from the circle show that the flow settles to such a state, and Newton's
method then finds it to rounding, so that the reference has no error of time steps.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softslip.errors import SoftslipError
from softslip.studies.validation.inertia import Array, deformation, moments

COARSE_NODES, MORE_NODES = 49, 200
"""Nodes of the time steps, which need only come near the steady state, and how many more for a unit
of G: the tips of long capsules are sharp."""

NODES = 129
"""Nodes of the steady state: D∞ is then good to 2e-7 at G = 0.4 and to 1e-9 at 0.125."""

STRAIN = 20.0
"""Shear γ̇t after which the capsule is near enough to its steady state for Newton's method."""

STABLE = 2.0
"""Largest step of the Runge-Kutta scheme over the time constant of the fastest mode; stable up to
2.78."""

LARGEST_TURN = 0.05
"""Largest step over the time of the shear, G Δt."""

STEADY = 1e-11
"""Largest misfit of the steady state's equations, over G."""

DIFFERENCE = 1e-5
"""Displacement [a] by which Newton's method differentiates."""

MOST_ITERATIONS = 25
"""Newton iterations; from a state that is nearly steady some five do."""


class NotSteadyError(SoftslipError):
    """Newton's method did not find a steady capsule."""


def derivative_matrix(nodes: int) -> Array:
    """Return the matrix of d/dα on an odd number of equally spaced nodes.

    An odd number has no sawtooth mode, whose derivative would be lost.
    """
    if nodes % 2 == 0:
        raise ValueError(f"{nodes} nodes: an odd number is needed")
    apart = np.arange(nodes)[:, None] - np.arange(nodes)[None, :]
    sign = np.where(apart % 2 == 0, 0.5, -0.5)
    half_angle = np.sin(np.pi * apart / nodes)
    return np.divide(sign, half_angle, out=np.zeros((nodes, nodes)), where=apart != 0)


def logarithm_matrix(nodes: int) -> Array:
    """Return the weights of ∫ ln(4 sin²((α - β)/2)) g(β) dβ, exact for resolved g (Kress 1989).

    The integral of the mode e^{imβ} is -2π/|m| times that mode, and 0 for m = 0.
    """
    apart = 2 * np.pi * np.arange(nodes) / nodes
    modes = np.arange(1, (nodes + 1) // 2)
    weights = -4 * np.pi / nodes * np.cos(apart[:, None] * modes) @ (1.0 / modes)
    rows = np.arange(nodes)
    return np.asarray(weights[rows[:, None] - rows[None, :]])


@dataclass(frozen=True)
class BoundaryIntegral:
    """Membrane and flow of one capsule on a number of nodes.

    Attributes
    ----------
    capillary
        G.
    nodes
        Odd number of nodes.
    rest_stretch
        λ₀ of the circle of radius 1: 1 where it is unstressed.
    """

    capillary: float
    nodes: int
    rest_stretch: float = 1.0

    @functools.cached_property
    def _derivative(self) -> Array:
        return derivative_matrix(self.nodes)

    @functools.cached_property
    def _logarithm(self) -> Array:
        return logarithm_matrix(self.nodes)

    @functools.cached_property
    def _chord_squared(self) -> Array:
        """4 sin²((α - β)/2), with 1 on the diagonal, where it is not used."""
        apart = np.arange(self.nodes)[:, None] - np.arange(self.nodes)[None, :]
        squared = 4 * np.sin(np.pi * apart / self.nodes) ** 2
        np.fill_diagonal(squared, 1.0)
        return squared

    def circle(self) -> Array:
        """Return the circle of radius 1, shape (nodes, 2)."""
        angle = 2 * np.pi * np.arange(self.nodes) / self.nodes
        return np.column_stack((np.cos(angle), np.sin(angle)))

    def tangent(self, points: Array) -> Array:
        """Return X_α, shape (nodes, 2)."""
        return self._derivative @ points

    def forces(self, points: Array) -> Array:
        """Return the force on the fluid for unit α, ∂(T τ)/∂α, shape (nodes, 2)."""
        tangent = self.tangent(points)
        length = np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
        tension = self.rest_stretch * length - 1
        along: Array = tension / length * tangent
        return self._derivative @ along

    def velocities(self, points: Array) -> Array:
        """Return the velocity of the membrane, shape (nodes, 2).

        ln r² is split into the logarithm of the circle's chord, integrated exactly, and a smooth
        rest, for which the trapezoidal rule is spectrally accurate, as it is for r r/r².
        """
        forces, tangent = self.forces(points), self.tangent(points)
        x = points[:, 0, None] - points[None, :, 0]
        y = points[:, 1, None] - points[None, :, 1]
        squared = x * x + y * y
        np.fill_diagonal(squared, (tangent**2).sum(axis=1))
        x[np.diag_indices(self.nodes)], y[np.diag_indices(self.nodes)] = tangent.T
        weight = 2 * np.pi / self.nodes
        logarithm = self._logarithm + weight * np.log(squared / self._chord_squared)
        along = (x * forces[:, 0] + y * forces[:, 1]) * (weight / squared)
        layer = -0.5 * logarithm @ forces
        layer[:, 0] += (along * x).sum(axis=1)
        layer[:, 1] += (along * y).sum(axis=1)
        layer /= 4 * np.pi
        layer[:, 0] += self.capillary * points[:, 1]
        return layer

    def moved(self, points: Array, duration: float) -> Array:
        """Return the membrane some time later, by steps of the classical Runge-Kutta scheme."""
        fastest = self.rest_stretch * self.nodes / 8
        longest = min(STABLE / fastest, LARGEST_TURN / max(self.capillary, 1e-300))
        steps = max(math.ceil(duration / longest), 1)
        dt = duration / steps
        for _ in range(steps):
            first = self.velocities(points)
            second = self.velocities(points + 0.5 * dt * first)
            third = self.velocities(points + 0.5 * dt * second)
            last = self.velocities(points + dt * third)
            points = points + dt / 6 * (first + 2 * (second + third) + last)
        return points


def resampled(points: Array, nodes: int) -> Array:
    """Return the trigonometric interpolant of a membrane on at least as many nodes."""
    modes = np.fft.rfft(points, axis=0) * (nodes / len(points))
    return np.fft.irfft(modes, nodes, axis=0)


@dataclass(frozen=True)
class SteadyCapsule:
    """A steady capsule in shear.

    Attributes
    ----------
    taylor_deformation, inclination
        D∞ and θ [degrees] of the inertia ellipse.
    frequency
        ω of the treading membrane [K_e/(ηa)]; 2π/ω is its period.
    points
        The membrane, shape (nodes, 2) [a].
    residual
        Velocity that the nodes leave unresolved, over G a.
    """

    taylor_deformation: float
    inclination: float
    frequency: float
    points: Array
    residual: float


@functools.cache
def steady_capsule(capillary: float, nodes: int = NODES) -> SteadyCapsule:
    """Return the steady state of a capsule in unbounded shear; kept within the process.

    Parameters
    ----------
    capillary
        G, positive.
    nodes
        Odd number of nodes of the steady state.

    Raises
    ------
    NotSteadyError
        When no steady state is found.
    """
    wanted = COARSE_NODES + 2 * round(0.5 * MORE_NODES * capillary)
    coarse = BoundaryIntegral(capillary, min(wanted, nodes))
    start = coarse.moved(coarse.circle(), STRAIN / capillary)
    fine = BoundaryIntegral(capillary, nodes)
    points, frequency, residual = _newton(fine, resampled(start, nodes))
    taylor, inclination = deformation(moments(points)[2])
    return SteadyCapsule(taylor, inclination, frequency, points, residual)


def _newton(capsule: BoundaryIntegral, points: Array) -> tuple[Array, float, float]:
    """Return the treading membrane nearest to a membrane, its ω, and what velocity is left.

    A steady state may be moved, blown up, and begun at any material point, which four more
    equations decide. The unknowns that go with them are ω, a drift and a swelling; the last three
    vanish but for what the nodes do not resolve, and are the velocity that is left.
    """
    first, tangent = points.copy(), capsule.tangent(points)
    slide = tangent / float((tangent**2).sum())

    def misfit(unknowns: Array) -> Array:
        trial, (frequency, *drift, swelling) = unknowns[:-4].reshape(-1, 2), unknowns[-4:]
        area, centre, _ = moments(trial)
        left = capsule.velocities(trial) - frequency * capsule.tangent(trial)
        left -= np.array(drift) + swelling * trial
        decided = [area - math.pi, *centre, float(((trial - first) * slide).sum())]
        return np.concatenate((left.ravel(), decided))

    frequency = float((capsule.velocities(points) * slide).sum())
    unknowns = np.concatenate((points.ravel(), [frequency, 0.0, 0.0, 0.0]))
    for _ in range(MOST_ITERATIONS):
        missed = misfit(unknowns)
        if np.abs(missed).max() < STEADY * capsule.capillary:
            left = float(np.abs(unknowns[-3:]).max()) / capsule.capillary
            return unknowns[:-4].reshape(-1, 2), float(unknowns[-4]), left
        unknowns = unknowns - np.linalg.solve(_jacobian(misfit, unknowns), missed)
    raise NotSteadyError(f"no steady capsule was found at G = {capsule.capillary:g}")


def _jacobian(function: Callable[[Array], Array], at: Array) -> Array:
    """Return central differences of a function; their error only slows the last iterations."""
    columns = []
    for change in DIFFERENCE * np.eye(at.size):
        columns.append((function(at + change) - function(at - change)) / (2 * DIFFERENCE))
    return np.column_stack(columns)
