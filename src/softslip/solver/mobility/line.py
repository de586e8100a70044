"""The mobility of a straight line of equally spaced nodes, in closed form.

Forces at nodes h apart on a straight line drive the nodes of the line by a convolution, which is
diagonal in Fourier modes: with the symbols T̂ of `solver.mobility.quadrature` and Poisson's
formula, a mode k of nodal forces moves the nodes at

    m(k) = (1/h) Σ_j T̂(k + 2πj/h),      and corrected by -(2/h) Σ_{j≥1} T̂(2πj/h).

A membrane moves like this in the modes that are much shorter than its radius of curvature.
"""

import math

import numpy as np

from softslip.solver.geometry import FloatArray
from softslip.solver.mobility.quadrature import across, missed

ALIASES = 32
"""Aliases that are summed on either side; those left out add less than 1e-3 of the symbol."""


def line_symbols(
    modes: FloatArray, spacing: float, regularisation: float, viscosity: float, *, corrected: bool
) -> tuple[FloatArray, FloatArray]:
    """Return velocity over nodal force of modes along a line, for forces along and normal to it.

    A uniform force moves an infinite line without bound; its symbol is that of no force, 0 less
    the aliases.

    Parameters
    ----------
    modes
        Wavenumbers k, from 0 to π/h, any shape [1 / length unit].
    spacing
        h [length unit].
    regularisation, viscosity
        ε and η.
    corrected
        Whether the sum is corrected as `solver.mobility.quadrature` does.
    """
    step = 2 * np.pi / spacing
    symbols = []
    for direction in (0, 1):

        def line(wavenumbers: FloatArray, direction: int = direction) -> FloatArray:
            """T̂(k) for k > 0."""
            return across(regularisation * wavenumbers)[direction] / (4 * viscosity * wavenumbers)

        nonzero = np.where(modes > 0, modes, 1.0)
        total = np.where(modes > 0, line(nonzero), 0.0)
        for alias in range(1, ALIASES + 1):
            total += line(alias * step + modes) + line(alias * step - modes)
            total -= 2 * line(np.asarray(alias * step))
        if not corrected:
            aliases = missed(spacing, regularisation)[direction]
            total += spacing / (4 * math.pi * viscosity) * aliases
        symbols.append(total / spacing)
    return symbols[0], symbols[1]
