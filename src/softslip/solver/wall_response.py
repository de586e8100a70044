"""How the walls answer their own tethers, linearised: in closed form, wall by wall.

A tether grows at -K_w times the velocity of its node, and drives that node. Along a flat wall
both are convolutions, so that the rate of a tether's mode k is -K_w c(k) h m(k), with the
symbol m of `solver.mobility.line` for nodes h apart. The walls are also close to each other
through the solvent outside, at a distance d: modes that are alike on both move by up to
(1 + kd) e^{-kd} more, opposite ones by so much less. The factor c lies half-way between an
isolated wall and the most that both can add. The mean along x is the traction's, the mean across
moves nothing; neither is touched. A rough wall is treated as if it were unrolled: what that misses
is left to the explicit part.
"""

import numpy as np

from softslip.solver.geometry import Box, FloatArray, Layout
from softslip.solver.mobility.line import line_symbols


class WallResponse:
    """The linear response of both walls to their own tethers; see the module.

    Parameters
    ----------
    layout, box
        Of the run.
    stiffness
        K_w.
    regularisation, viscosity
        ε and η of the flow.
    corrected
        Whether the quadrature is corrected.
    """

    def __init__(
        self,
        layout: Layout,
        box: Box,
        stiffness: float,
        regularisation: float,
        viscosity: float,
        *,
        corrected: bool,
    ) -> None:
        self._count, spacing = layout.wall_nodes, layout.wall_spacing
        modes = np.arange(self._count // 2 + 1.0)
        wavenumbers: FloatArray = 2 * np.pi / (self._count * spacing) * modes
        along, normal = line_symbols(
            wavenumbers, spacing, regularisation, viscosity, corrected=corrected
        )
        apart = wavenumbers * box.outer_gap
        factor = 1 + 0.5 * (1 + apart) * np.exp(-apart)
        rates = stiffness * spacing * factor[:, None] * np.column_stack((along, normal))
        rates[0] = 0.0
        self._rates: FloatArray = rates

    def solve(self, tethers: FloatArray, shift: float) -> None:
        """Multiply changes of the tethers, shape (2, wall_nodes, 2), by (1 - g L)⁻¹ in place."""
        modes = np.fft.rfft(tethers, axis=1) / (1 + shift * self._rates)
        tethers[:] = np.fft.irfft(modes, self._count, axis=1)
