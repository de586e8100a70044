"""A list of pairs of nodes that is kept until nodes have moved too far."""

import math

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.neighbours import find_pairs


@compiled
def still_complete(
    positions: FloatArray,
    reference: FloatArray,
    length: float,
    reach: float,
    skin: float,
    gain: float,
) -> bool:
    """Return whether no pair can have come within the reach that was beyond reach plus skin.

    A displacement is split into a uniform shear, Δx = a + b y, and a remainder δ. Two nodes d apart
    have moved against each other by at most 2 max|δ| + |b| d, so that the list holds as long as
    2 max|δ| + |b| (reach + skin) < skin; without the shear, as long as 2 max|δ| < skin.

    Parameters
    ----------
    positions, reference
        Now and when the list was made, shape (nodes, 2); x periodic with ``length``.
    gain
        Factor on δ for points that are interpolated between nodes.
    """
    largest, mean_x, mean_y = 0.0, 0.0, 0.0
    for i in range(positions.shape[0]):
        dx = positions[i, 0] - reference[i, 0]
        dx -= length * np.floor(dx / length + 0.5)
        dy = positions[i, 1] - reference[i, 1]
        squared = dx * dx + dy * dy
        if not squared <= largest:  # Written so that NaN counts as the farthest.
            largest = squared
            if math.isnan(squared):
                return False
        mean_x += dx
        mean_y += reference[i, 1]
    if 2 * gain * math.sqrt(largest) < skin:
        return True
    # A displacement across much of the period cannot be told from one across the rest of it.
    if not 16 * largest < length * length:
        return False
    mean_x /= positions.shape[0]
    mean_y /= positions.shape[0]
    shear = _mean_shear(positions, reference, length, mean_x, mean_y)
    remainder = 0.0
    for i in range(positions.shape[0]):
        dx = positions[i, 0] - reference[i, 0]
        dx -= length * np.floor(dx / length + 0.5)
        dx -= mean_x + shear * (reference[i, 1] - mean_y)
        dy = positions[i, 1] - reference[i, 1]
        remainder = max(remainder, dx * dx + dy * dy)
    return 2 * gain * math.sqrt(remainder) + abs(shear) * (reach + skin) < skin


@compiled
def _mean_shear(
    positions: FloatArray, reference: FloatArray, length: float, mean_x: float, mean_y: float
) -> float:
    """Return b of the least-squares fit Δx = a + b y to all displacements."""
    product, square = 0.0, 0.0
    for i in range(positions.shape[0]):
        dx = positions[i, 0] - reference[i, 0]
        dx -= length * np.floor(dx / length + 0.5)
        y = reference[i, 1] - mean_y
        product += (dx - mean_x) * y
        square += y * y
    return product / square if square > 0 else 0.0


SKIN = 0.35
"""Thickness of the Verlet skin over the contact range: balances rebuilding and listing."""


class VerletList:
    """List of node pairs within a reach, kept until nodes have moved too far.

    The list is a cache: `pairs` returns at least all pairs within the reach, in an order that
    does not depend on when it was built, so that sums over pairs within the reach are the same
    to the last bit after a restart.

    Parameters
    ----------
    length
        Period L_x [length unit].
    reach
        Distance below which pairs must be listed [length unit].
    skin
        Extra distance within which they are listed too [length unit].
    """

    def __init__(self, length: float, reach: float, skin: float) -> None:
        self._length = length
        self._reach = reach
        self._skin = skin
        self._reference: FloatArray | None = None
        self._pairs = (np.zeros(1, np.int64), np.empty(0, np.int64))

    def pairs(
        self, positions: FloatArray, body: IntArray, walls_from: int
    ) -> tuple[IntArray, IntArray]:
        """Return ``starts, partners`` as `find_pairs` does for the same bodies at every call."""
        reference = self._reference
        if (
            reference is None
            or reference.shape != positions.shape
            or not still_complete(positions, reference, self._length, self._reach, self._skin, 1.0)
        ):
            reach = self._reach + self._skin
            self._pairs = find_pairs(positions, body, walls_from, self._length, reach)
            self._reference = positions.copy()
        return self._pairs
