"""The flow without any force: rest, for which nothing is solved."""

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray
from softslip.solver.mobility import Mobility


class RestWithoutForce:
    """A mobility that is asked only where a force acts.

    V = K F is linear, so that no force causes no flow: exact zeros, as the sums would give too (of
    either sign). Walls under no stress without particles between them are such a case.

    Parameters
    ----------
    mobility
        K.
    """

    def __init__(self, mobility: Mobility) -> None:
        self._mobility = mobility

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        if not _acts(forces):
            return np.zeros_like(positions)
        return self._mobility.velocities(positions, forces)

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the velocity at any points, shape (points, 2); see `Mobility`."""
        if not _acts(forces):
            return np.zeros_like(points)
        return self._mobility.velocities_at(points, positions, forces)


@compiled
def _acts(forces: FloatArray) -> bool:
    """Return whether any force is not zero; one that is no number counts."""
    first = 0
    while first < forces.shape[0] and forces[first, 0] == 0.0 and forces[first, 1] == 0.0:
        first += 1
    return bool(first < forces.shape[0])
