"""The paper's immersed-boundary Stokes solver (Eqs. 7-16 and 28)."""

import math
from typing import Literal

import numpy as np

from softslip.solver.geometry import Box, FloatArray
from softslip.solver.kernels import SECOND_MOMENT
from softslip.solver.mobility.transform import PeriodicTransform
from softslip.solver.transfer import interpolate_curl, spread_curl

Symbol = Literal["compact", "wide"]


def laplacian_symbol(modes: FloatArray, count: int, mesh_size: float, symbol: Symbol) -> FloatArray:
    """Return the symbol of -∂² along one axis of the mesh.

    Parameters
    ----------
    modes
        Integer wavenumbers k.
    count
        Mesh points N along the axis.
    mesh_size
        dx [length unit].
    symbol
        'compact' is 4 sin²(πk/N)/dx² as Eq. 14 prints it; 'wide' is sin²(2πk/N)/dx², the square
        of the central difference of Eq. 9, which vanishes at k = N/2 too.
    """
    angle = np.pi * modes / count
    if symbol == "compact":
        return 4 * np.sin(angle) ** 2 / mesh_size**2
    return np.where(2 * modes % count == 0, 0.0, np.sin(2 * angle) ** 2) / mesh_size**2


def regularisation_length(mesh_size: float, symbol: Symbol) -> float:
    """Return the length ε at which e^{-ε²k²}/k² is the mesh scheme's response up to O(k²).

    The delta function, used twice, contributes its second moment m₂ dx². The difference symbols
    add the mean over directions of their own expansion: 1/8 dx² ('compact', where the
    differences of the curl are wide) or -1/4 dx² ('wide').

    Parameters
    ----------
    mesh_size
        dx [length unit].
    symbol
        See `laplacian_symbol`.
    """
    return mesh_size * math.sqrt(SECOND_MOMENT + (1 / 8 if symbol == "compact" else -1 / 4))


def inverse_or_zero(values: FloatArray) -> FloatArray:
    """Return 1/values, and 0 where a value is zero: modes that carry no flow stay empty."""
    result = np.zeros_like(values)
    np.divide(1.0, values, out=result, where=values != 0)
    return result


class GridMobility:
    """Stokes flow on a doubly periodic mesh by a streamfunction and FFTs.

    Forces are spread with δ_h, Eq. 14 is solved for the streamfunction, and its velocity is
    interpolated back with the same δ_h. The curl and the velocity's differences (Eq. 9) act on
    the kernel, which gives the same numbers with one scalar transform each way.

    Parameters
    ----------
    box
        The periodic box, whose sides the mesh must divide.
    resolution
        Mesh points per unit length, 1/dx.
    viscosity
        η.
    symbol
        Laplacian of Eq. 14, see `laplacian_symbol`.
    """

    def __init__(
        self, box: Box, resolution: int, viscosity: float, symbol: Symbol = "compact"
    ) -> None:
        self.mesh_size = 1.0 / resolution
        self.shape = (round(box.length * resolution), round(box.period * resolution))
        nx, ny = self.shape
        modes_x, modes_y = np.arange(nx, dtype=np.float64), np.arange(ny // 2 + 1, dtype=np.float64)
        along = laplacian_symbol(modes_x, nx, self.mesh_size, symbol)
        across = laplacian_symbol(modes_y, ny, self.mesh_size, symbol)
        squared = viscosity * (along[:, None] + across[None, :]) ** 2
        self._response = inverse_or_zero(squared) / (nx * ny)
        self._transform = PeriodicTransform(nx, ny)

    def streamfunction(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return ψ on the mesh, shape (N_x, N_y), in a workspace that the next call overwrites."""
        mesh, modes = self._transform.field, self._transform.modes
        mesh[:] = 0.0
        spread_curl(positions, forces, self.mesh_size, mesh)
        self._transform.forward()
        np.multiply(modes, self._response, out=modes)
        self._transform.backward()
        return mesh

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        return self.velocities_at(positions, positions, forces)

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the velocity interpolated to any points, shape (points, 2); see `Mobility`."""
        result = np.empty_like(points)
        interpolate_curl(points, self.streamfunction(positions, forces), self.mesh_size, result)
        return result
