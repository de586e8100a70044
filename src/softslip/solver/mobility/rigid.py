"""Nodes that keep their mutual distances, such as those of a rigid wall."""

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.mobility.blob import Blob


class RigidPairs:
    """Near velocities of nodes that keep their mutual distances: a constant sparse operator.

    Parameters
    ----------
    positions
        Reference positions, shape (nodes, 2) [length unit]; x periodic.
    starts, partners
        Their pairs within the reach (`solver.neighbours.find_pairs`).
    length
        Period L_x [length unit].
    blob, reach
        The blob and its reach [length unit].
    scale
        1/(2πη).

    Attributes
    ----------
    nodes, pairs
        Numbers of nodes and of pairs.
    """

    def __init__(
        self,
        positions: FloatArray,
        starts: IntArray,
        partners: IntArray,
        length: float,
        blob: Blob,
        reach: float,
        scale: float,
    ) -> None:
        self.nodes, self.pairs = len(positions), len(partners)
        self._starts, self._partners = starts, partners
        arm = positions[partners] - positions[np.repeat(np.arange(len(positions)), np.diff(starts))]
        arm[:, 0] -= length * np.round(arm[:, 0] / length)
        arm /= reach
        squared = np.sum(arm**2, axis=1)
        tangential, excess = blob.profiles(squared)
        excess /= squared
        x, y = arm.T
        self._blocks = scale * np.stack(
            (tangential + excess * x * x, excess * x * y, tangential + excess * y * y), axis=1
        )

    @classmethod
    def none(cls) -> "RigidPairs":
        """Return the operator of no nodes."""
        empty = np.empty(0, np.int64)
        return cls(np.empty((0, 2)), np.zeros(1, np.int64), empty, 1.0, Blob.fitted(0.1), 1.0, 1.0)

    def add(self, forces: FloatArray, velocities: FloatArray) -> None:
        """Add the velocities of these nodes, shape (nodes, 2), under forces of the same shape."""
        _add_rigid(self._starts, self._partners, self._blocks, forces, velocities)


@compiled
def _add_rigid(
    starts: IntArray,
    partners: IntArray,
    blocks: FloatArray,
    forces: FloatArray,
    velocities: FloatArray,
) -> None:
    for i in range(starts.size - 1):
        for k in range(starts[i], starts[i + 1]):
            j, xx, xy, yy = partners[k], blocks[k, 0], blocks[k, 1], blocks[k, 2]
            velocities[i, 0] += xx * forces[j, 0] + xy * forces[j, 1]
            velocities[i, 1] += xy * forces[j, 0] + yy * forces[j, 1]
            velocities[j, 0] += xx * forces[i, 0] + xy * forces[i, 1]
            velocities[j, 1] += xy * forces[i, 0] + yy * forces[i, 1]
