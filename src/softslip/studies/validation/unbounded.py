"""Unbounded fluid by closed forms, pair by pair: no mesh, no split, no table."""

import numpy as np
from scipy.special import exp1

from softslip.solver.geometry import FloatArray


class Unbounded:
    """The regularised kernel's sum in fluid without boundaries, for forces that balance.

    Two-dimensional flow knows no far field for a net force, so that forces must sum to zero.
    With s = ε², c = r²/4: 2πη T_r = (1 - ln r)/2 - [s (1 - e^{-c/s}) + c E₁(c/s)]/r², and since
    the flow is incompressible, T_t = d(r T_r)/dr, 2πη (T_r + T_t) = 1/2 - ln r - E₁(c/s)/2.

    Parameters
    ----------
    regularisation
        ε [length unit].
    viscosity
        η.
    """

    def __init__(self, regularisation: float, viscosity: float) -> None:
        self.regularisation, self.viscosity = regularisation, viscosity

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the velocities of the nodes, shape (nodes, 2)."""
        return self.velocities_at(positions, positions, forces)

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the velocities at any points, shape (points, 2)."""
        arm = points[:, None] - positions
        # Nearer than a millionth of ε the kernel is that at the node itself, to all digits.
        squared = np.maximum(np.sum(arm**2, axis=-1), 1e-12 * self.regularisation**2)
        s, c = self.regularisation**2, 0.25 * squared
        e1, log = exp1(c / s), 0.5 * np.log(squared)
        radial = 0.5 * (1 - log) - (-s * np.expm1(-c / s) + c * e1) / squared
        tangential = 0.5 - log - 0.5 * e1 - radial
        along = (radial - tangential) / squared * np.einsum("ija,ja->ij", arm, forces)
        total: FloatArray = tangential @ forces + np.einsum("ij,ija->ia", along, arm)
        return total / (2 * np.pi * self.viscosity)
