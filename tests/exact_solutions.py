"""Exact solutions as objects; tests run every solver on each of them."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Couette:
    """Pure solvent between flat walls under an imposed shear stress.

    In the periodic box the solvent outside is sheared backwards over L_y - H at the same wall
    speeds, so that the walls bear its stress too.
    """

    stress: float
    viscosity: float
    height: float
    outer_gap: float
    outside: str

    @property
    def relative_speed(self):
        return self.stress * self.height / self.viscosity

    @property
    def traction(self):
        backwards = self.height / self.outer_gap if self.outside == "periodic" else 0.0
        return self.stress * (1 + backwards)

    def velocity(self, heights):
        return self.stress / self.viscosity * (heights - 0.5 * self.height)


@dataclass(frozen=True)
class ShearWave:
    """Force density f_x = F sin(2π n y/L_y): a flow along x that depends on y alone."""

    length: float
    period: float
    viscosity: float = 1.7
    waves: int = 2
    amplitude: float = 3.0

    def force(self, points):
        wavenumber = 2 * np.pi * self.waves / self.period
        along = self.amplitude * np.sin(wavenumber * points[:, 1])
        return np.column_stack((along, np.zeros_like(along)))

    def velocity(self, points):
        wavenumber = 2 * np.pi * self.waves / self.period
        return self.force(points) / (self.viscosity * wavenumber**2)


@dataclass(frozen=True)
class Vortices:
    """Streamfunction ψ = sin(p x + 0.3) cos(q y - 0.7), pressure P cos(p x) sin(q y).

    The force density is -η ∇²u + ∇p of that flow, with a gradient part that must do nothing.
    """

    length: float
    period: float
    viscosity: float = 0.6
    pressure: float = 5.0

    def _phase(self, points):
        p, q = 2 * np.pi * 2 / self.length, 2 * np.pi / self.period
        return p, q, p * points[:, 0] + 0.3, q * points[:, 1] - 0.7

    def velocity(self, points):
        p, q, a, b = self._phase(points)
        return np.column_stack((-q * np.sin(a) * np.sin(b), -p * np.cos(a) * np.cos(b)))

    def force(self, points):
        p, q, a, b = self._phase(points)
        viscous = self.viscosity * (p * p + q * q) * self.velocity(points)
        gradient = np.column_stack(
            (-p * np.sin(a - 0.3) * np.sin(b + 0.7), q * np.cos(a - 0.3) * np.cos(b + 0.7))
        )
        return viscous + self.pressure * gradient
