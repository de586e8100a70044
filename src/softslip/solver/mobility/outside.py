"""What the solvent outside the walls does: counter-shear in the periodic box, or nothing.

In a periodic box the solvent outside the walls is sheared backwards, at a stress that grows as
the outer gap shrinks, and the walls' traction grows with it. A wall of regularised nodes lags
behind the flow inside by that traction times about half a mesh size, so that a small outer gap
spoils the very slip velocity that is measured (by the factor L_y/(L_y - H)). Adding a uniform
shear, itself a Stokes flow, so that the solvent outside carries no stress removes this: the
traction equals the stress, and nothing depends on the outer gap.
"""

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import Box, FloatArray
from softslip.solver.mobility import Mobility


def outside_stress(heights: FloatArray, forces_x: FloatArray, box: Box) -> float:
    """Return the stress τ_out = Σ F_x y/(L_x L_y) of the periodic box's outer solvent.

    Parameters
    ----------
    heights, forces_x
        Height and x-force of each node (or force per mesh line times L_x), same shape. The total
        force must be zero for the choice of origin to drop out.
    box
        The periodic box.
    """
    # Not np.dot: BLAS splits long sums over threads, whose number would change the bits.
    return float(np.einsum("i,i", forces_x, heights)) / (box.length * box.period)


class StillOutside:
    """A mobility with a uniform shear on top that leaves the solvent outside without stress.

    V = K F + (y - H/2) τ_out(F)/η: linear and symmetric as K is, for forces of zero sum.

    Parameters
    ----------
    mobility
        K, of the periodic box.
    box
        That box.
    viscosity
        η.
    """

    def __init__(self, mobility: Mobility, box: Box, viscosity: float) -> None:
        self._mobility = mobility
        self._box = box
        self._viscosity = viscosity

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        result = self._mobility.velocities(positions, forces)
        self._add_shear(positions, positions, forces, result)
        return result

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the velocity at any points of the channel, shape (points, 2); see `Mobility`."""
        result = self._mobility.velocities_at(points, positions, forces)
        self._add_shear(points, positions, forces, result)
        return result

    def _add_shear(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray, result: FloatArray
    ) -> None:
        middle = 0.5 * self._box.height
        # Forces of zero sum have the same moment about any height; this one loses fewest digits.
        stress = outside_stress(positions[:, 1] - middle, forces[:, 0], self._box)
        add_shear(points, middle, stress / self._viscosity, result)


@compiled
def add_shear(points: FloatArray, middle: float, rate: float, velocities: FloatArray) -> None:
    """Add a uniform shear about a height to velocities at points, both of shape (points, 2)."""
    for i in range(points.shape[0]):
        velocities[i, 0] += rate * (points[i, 1] - middle)
