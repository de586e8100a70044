"""Exact solutions of the Stokes equations as objects, to run any solver on."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from softslip.solver.geometry import FloatArray
from softslip.solver.kernels import SUPPORT, kernel_weights


@dataclass(frozen=True)
class CouetteFlow:
    """Pure solvent between flat walls under an imposed shear stress.

    In the periodic box the solvent outside is sheared backwards over L_y - H at the same wall
    speeds, so that the walls bear its stress too.

    Attributes
    ----------
    stress
        σ [stress unit].
    viscosity
        η.
    height, outer_gap
        H and L_y - H [length unit].
    outside
        Whether the solvent outside is 'still' or sheared backwards ('periodic').
    """

    stress: float
    viscosity: float
    height: float
    outer_gap: float
    outside: Literal["still", "periodic"]

    @property
    def relative_speed(self) -> float:
        """Speed σH/η of the upper wall over the lower one [length unit / time unit]."""
        return self.stress * self.height / self.viscosity

    @property
    def traction(self) -> float:
        """Traction on the upper wall, σ or (1 + H/(L_y - H)) σ [stress unit]."""
        backwards = self.height / self.outer_gap if self.outside == "periodic" else 0.0
        return self.stress * (1 + backwards)

    def velocity(self, heights: FloatArray) -> FloatArray:
        """Return the velocity along x at heights within the channel, same shape."""
        return self.stress / self.viscosity * (heights - 0.5 * self.height)


@dataclass(frozen=True)
class EnclosedVortices:
    """Vortices within a channel, in solvent that is at rest outside.

    Streamfunction ψ = sin(p x + 0.3) B(y) and pressure P cos(p x) B(y) with p = 2π/L_x and the bump
    B = sin⁸(πy/H) for 0 < y < H, nothing outside. The force density -η ∇²u + ∇p has four
    continuous derivatives, so that a sum over a lattice stands for its integral.

    Attributes
    ----------
    length
        Period L_x [length unit].
    height
        H [length unit].
    viscosity
        η.
    pressure
        P.
    """

    length: float
    height: float
    viscosity: float = 1.0
    pressure: float = 5.0

    def _bump(self, heights: FloatArray) -> list[FloatArray]:
        """Return B and its first three derivatives."""
        # sin⁸ t = [35 - 56 cos 2t + 28 cos 4t - 8 cos 6t + cos 8t]/128
        weights = np.array([35.0, -56.0, 28.0, -8.0, 1.0]) / 128
        rates = 2 * np.pi / self.height * np.arange(5)
        phase = rates * heights[:, None]
        inside = (heights > 0) & (heights < self.height)
        waves = (np.cos(phase), -np.sin(phase), -np.cos(phase), np.sin(phase))
        return [np.where(inside, wave @ (weights * rates**n), 0.0) for n, wave in enumerate(waves)]

    def velocity(self, points: FloatArray) -> FloatArray:
        """Return the velocity at points, shape (points, 2)."""
        p = 2 * np.pi / self.length
        angle = p * points[:, 0] + 0.3
        bump, slope, _, _ = self._bump(points[:, 1])
        return np.column_stack((np.sin(angle) * slope, -p * np.cos(angle) * bump))

    def laplacian(self, points: FloatArray) -> FloatArray:
        """Return ∇²u at points, shape (points, 2)."""
        p = 2 * np.pi / self.length
        angle = p * points[:, 0] + 0.3
        bump, slope, bend, third = self._bump(points[:, 1])
        return np.column_stack(
            (np.sin(angle) * (third - p**2 * slope), -p * np.cos(angle) * (bend - p**2 * bump))
        )

    def force(self, points: FloatArray) -> FloatArray:
        """Return the force density at points, shape (points, 2)."""
        p = 2 * np.pi / self.length
        bump, slope, _, _ = self._bump(points[:, 1])
        along, across = -p * np.sin(p * points[:, 0]) * bump, np.cos(p * points[:, 0]) * slope
        gradient = np.column_stack((along, across))
        return -self.viscosity * self.laplacian(points) + self.pressure * gradient


@dataclass(frozen=True)
class RegularisedSheets:
    """Two parallel sheets of regularised forces that slide past each other, still fluid outside.

    Under the tractions ±σ they move at the relative speed (σ/η) h_eff with

        h_eff = E|h + ξ| - E|ξ| = h erf(h/2ε) - (2ε/√π) (1 - e^{-h²/4ε²}),

    ξ being normal with variance 2ε², whose characteristic function is the kernel e^{-ε²k²}:
    the one-dimensional flow of a unit force is -|y|/2η, seen through the kernel. A film that is
    thick compared with ε counts as thinner by E|ξ| = 2ε/√π.

    Attributes
    ----------
    thickness
        h [length unit].
    regularisation
        ε [length unit].
    """

    thickness: float
    regularisation: float

    @property
    def film(self) -> float:
        """Effective film thickness h_eff [length unit]."""
        ratio = 0.5 * self.thickness / self.regularisation
        lag = sheet_lag(self.regularisation)
        return self.thickness * math.erf(ratio) + lag * math.expm1(-(ratio**2))

    @property
    def lag(self) -> float:
        """What the film loses, h - h_eff [length unit]."""
        return self.thickness - self.film


def sheet_lag(regularisation: float) -> float:
    """Return E|ξ| = 2ε/√π, by which a thick film between regularised sheets counts as thinner."""
    return 2 * regularisation / math.sqrt(math.pi)


@dataclass(frozen=True)
class MeshSheets:
    """`RegularisedSheets` on the paper's mesh, with mesh lines along the sheets.

    For forces that do not depend on x the scheme's response is (1/η) cos²(θ/2) dx²/4 sin²(θ/2),
    θ = k dx: that of the compact Laplacian, -|n| dx/2, less dx/4 on the line itself. With w₁ and
    w₂ the kernel's weights of both sheets on the mesh lines and Y₁, Y₂ lines drawn with these,

        h_eff = E|Y₁ - Y₂| - ½ E|Y₁ - Y₁'| - ½ E|Y₂ - Y₂'| - (dx/4) Σ_n (w₁ - w₂)²
              = dx Σ_n [(Σ_{m≤n} (w₁ - w₂))² - ¼ (w₁ - w₂)²].

    Attributes
    ----------
    thickness
        h [length unit].
    mesh_size
        dx [length unit].
    offset
        Height of the lower sheet over a mesh line [length unit].
    """

    thickness: float
    mesh_size: float
    offset: float = 0.0

    @property
    def film(self) -> float:
        """Effective film thickness h_eff [length unit]."""
        above = self.offset + self.thickness
        net = np.zeros(math.ceil(above / self.mesh_size) + 2 * SUPPORT)
        for height, sign in ((above, 1.0), (self.offset, -1.0)):
            weights = np.empty(SUPPORT)
            first = kernel_weights(height / self.mesh_size, weights) + SUPPORT
            net[first : first + SUPPORT] += sign * weights
        carried = np.cumsum(net)
        return self.mesh_size * float(np.sum(carried**2) - 0.25 * np.sum(net**2))

    @property
    def lag(self) -> float:
        """What the film loses, h - h_eff [length unit]."""
        return self.thickness - self.film
