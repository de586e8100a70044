"""Segments of closed chains that are close enough to a node of another chain to touch it."""

import math
from typing import NamedTuple

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.neighbours import find_pairs


class Candidates(NamedTuple):
    """Segments that each node may touch, chain by chain.

    Attributes
    ----------
    starts
        The candidates of node i are entries ``starts[i]:starts[i + 1]``, shape (nodes + 1,).
    segment
        First node of each segment, ascending for each node.
    shift
        What to add to the segment's x to bring it next to the node [length unit].
    """

    starts: IntArray
    segment: IntArray
    shift: FloatArray


def find_candidates(
    position: FloatArray, body: IntArray, following: IntArray, length: float, reach: float
) -> Candidates:
    """Return all segments of other chains within a reach of each node.

    A segment is at most as far as its first node, and no nearer than that less its length.

    Parameters
    ----------
    position
        Nodes, shape (nodes, 2) [length unit].
    body, following
        Chain of each node, and the node that ends the segment it begins, shape (nodes,).
    length, reach
        Period L_x, and the largest distance [length unit].
    """
    steps = position[following] - position
    longest = float(np.hypot(steps[:, 0], steps[:, 1]).max())
    no_walls = int(body[-1]) + 1
    starts, partners = find_pairs(position, body, no_walls, length, reach + longest)
    return Candidates(*_of_every_node(position, starts, partners, length))


@compiled
def _of_every_node(
    position: FloatArray, starts: IntArray, partners: IntArray, length: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Turn pairs i < j into the list of every node's partners, ascending, with their shifts."""
    count = len(starts) - 1
    first = np.zeros(count + 1, np.int64)
    for i in range(count):
        first[i + 1] += starts[i + 1] - starts[i]
        for m in range(starts[i], starts[i + 1]):
            first[partners[m] + 1] += 1
    first = np.cumsum(first)
    fill = first[:-1].copy()
    segment = np.empty(first[count], np.int64)
    shift = np.empty(first[count])
    for i in range(count):
        for m in range(starts[i], starts[i + 1]):
            j = partners[m]
            image = length * math.floor((position[j, 0] - position[i, 0]) / length + 0.5)
            segment[fill[i]], shift[fill[i]] = j, -image
            segment[fill[j]], shift[fill[j]] = i, image
            fill[i] += 1
            fill[j] += 1
    return first, segment, shift
