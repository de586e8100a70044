"""Exact flows in the doubly periodic box, which the Stokes solvers are tested on."""

from dataclasses import dataclass

import numpy as np

from softslip.solver.geometry import FloatArray


@dataclass(frozen=True)
class ShearWave:
    """Force density f_x = F sin(2π n y/L_y): a flow along x that depends on y alone.

    Attributes
    ----------
    length, period
        L_x and L_y of the doubly periodic box [length unit].
    viscosity
        η.
    waves
        n.
    amplitude
        F [force / area].
    """

    length: float
    period: float
    viscosity: float = 1.7
    waves: int = 2
    amplitude: float = 3.0

    def force(self, points: FloatArray) -> FloatArray:
        """Return the force density at points, shape (points, 2)."""
        wavenumber = 2 * np.pi * self.waves / self.period
        along = self.amplitude * np.sin(wavenumber * points[:, 1])
        return np.column_stack((along, np.zeros_like(along)))

    def velocity(self, points: FloatArray) -> FloatArray:
        """Return the velocity at points, shape (points, 2)."""
        wavenumber = 2 * np.pi * self.waves / self.period
        return self.force(points) / (self.viscosity * wavenumber**2)


@dataclass(frozen=True)
class Vortices:
    """Streamfunction ψ = sin(p x + 0.3) cos(q y - 0.7), pressure P cos(p x) sin(q y).

    The force density is -η ∇²u + ∇p of that flow, with a gradient part that must do nothing.

    Attributes
    ----------
    length, period
        L_x and L_y of the doubly periodic box, p = 4π/L_x and q = 2π/L_y [length unit].
    viscosity
        η.
    pressure
        P.
    """

    length: float
    period: float
    viscosity: float = 0.6
    pressure: float = 5.0

    def _phase(self, points: FloatArray) -> tuple[float, float, FloatArray, FloatArray]:
        p, q = 2 * np.pi * 2 / self.length, 2 * np.pi / self.period
        return p, q, p * points[:, 0] + 0.3, q * points[:, 1] - 0.7

    def velocity(self, points: FloatArray) -> FloatArray:
        """Return the velocity at points, shape (points, 2)."""
        p, q, a, b = self._phase(points)
        return np.column_stack((-q * np.sin(a) * np.sin(b), -p * np.cos(a) * np.cos(b)))

    def force(self, points: FloatArray) -> FloatArray:
        """Return the force density at points, shape (points, 2)."""
        p, q, a, b = self._phase(points)
        viscous = self.viscosity * (p * p + q * q) * self.velocity(points)
        gradient = np.column_stack(
            (-p * np.sin(a - 0.3) * np.sin(b + 0.7), q * np.cos(a - 0.3) * np.cos(b + 0.7))
        )
        return viscous + self.pressure * gradient
