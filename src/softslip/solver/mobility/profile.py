"""The x-averaged flow, which is one-dimensional and exact: -η v̄'' = f̄(y)."""

from typing import Literal

import numpy as np

from softslip.solver.geometry import Box, FloatArray
from softslip.solver.mobility.grid import Symbol, inverse_or_zero, laplacian_symbol
from softslip.solver.mobility.outside import outside_stress
from softslip.solver.transfer import spread_across


class MeanFlow:
    """x-averages of the mesh scheme's velocity and stress, from the node forces alone.

    The k_x = 0 modes of `GridMobility` decouple from all others, so that this solves the same
    discrete equations and agrees with the x-average of the two-dimensional field to rounding.

    Parameters
    ----------
    box, resolution, viscosity, symbol
        As for `GridMobility`.
    outside
        Whether the solvent outside the walls is 'still' or sheared backwards ('periodic').
    """

    def __init__(
        self,
        box: Box,
        resolution: int,
        viscosity: float,
        symbol: Symbol = "compact",
        outside: Literal["still", "periodic"] = "still",
    ) -> None:
        self.mesh_size = 1.0 / resolution
        self.viscosity = viscosity
        self._box = box
        self._still = outside == "still"
        self._outside = round((box.height + 0.5 * box.outer_gap) * resolution)
        self._count = ny = round(box.period * resolution)
        modes = np.arange(ny // 2 + 1.0)
        across = laplacian_symbol(modes, ny, self.mesh_size, symbol)
        difference = laplacian_symbol(modes, ny, self.mesh_size, "wide")
        inverse = inverse_or_zero(across)
        self._response = difference * inverse**2 / viscosity
        compact = laplacian_symbol(modes, ny, self.mesh_size, "compact")
        # The scheme smooths the force that the viscous stress between mesh lines balances.
        self._smoothing = compact * difference * inverse**2
        self._smoothing[0] = 1.0

    @property
    def heights(self) -> FloatArray:
        """Heights of the mesh lines in the channel frame, shape (N_y,)."""
        return np.arange(self._count, dtype=np.float64) * self.mesh_size

    def force_density(self, heights: FloatArray, forces_x: FloatArray) -> FloatArray:
        """Return the x-averaged force density f̄ on the mesh lines, shape (N_y,)."""
        density = np.zeros(self._count)
        spread_across(heights, forces_x, self.mesh_size, density)
        return density / self._box.length

    def velocity(self, density: FloatArray) -> FloatArray:
        """Return v̄ on the mesh lines for a force density with zero sum, shape (N_y,).

        Lines above the middle of the outer solvent count as lying below the lower wall.
        """
        periodic = np.fft.irfft(np.fft.rfft(density) * self._response, self._count)
        if not self._still:
            return periodic
        heights = self.heights - 0.5 * self._box.height
        heights[self._outside :] -= self._box.period
        amounts = density * self.mesh_size * self._box.length
        stress = outside_stress(heights, amounts, self._box)
        return periodic + stress / self.viscosity * heights

    def viscous_stress(self, velocity: FloatArray) -> FloatArray:
        """Return η (v̄_{j+1} - v̄_j)/dx half-way above each mesh line, shape (N_y,)."""
        return self.viscosity * (np.roll(velocity, -1) - velocity) / self.mesh_size

    def carried_stress(self, density: FloatArray) -> FloatArray:
        """Return the stress that bodies carry across each half-way height, shape (N_y,).

        It is the force, per unit length along x, that bodies below that height put on the fluid,
        which is what bodies above put on them; it is counted from the middle of the outer solvent,
        where nothing is carried. The density is smoothed
        just as the scheme smooths what its viscous stress balances.

        Parameters
        ----------
        density
            x-averaged force density of membranes and contacts, without what holds and drives the
            walls, shape (N_y,).
        """
        smooth = np.fft.irfft(np.fft.rfft(density) * self._smoothing, self._count)
        upwards = np.roll(smooth, -self._outside)
        return np.roll(np.cumsum(upwards) * self.mesh_size, self._outside)
