"""Closed chains of nodes, and points between the nodes of a chain.

A chain is closed when its first node follows its last: a membrane, or a wall, whose x grows by
one period L_x along the way. The nodes are equally spaced in the reference (material) coordinate,
so that a point between two of them is a fixed combination of its six nearest nodes. Forces on such
points go back to the nodes by the transpose: then the nodes feel minus the gradient of whatever
energy the points have, and the total force is kept.
"""

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import BoolArray, FloatArray, IntArray, Layout

PADDING = 3
"""Nodes of wrap that `unroll` puts on each side of a chain, and the fewest a chain may have."""

_NODES = 6
_BEFORE = 2


def lagrange_weights(factor: int) -> FloatArray:
    """Return the weights of the nodes s-2 ... s+3 at the material coordinates s + q/factor.

    Row q holds the Lagrange polynomials of the six nodes at q/factor, so that a smooth chain is
    met within O(Δs^6). Row 0 is exactly (0, 0, 1, 0, 0, 0): the node itself.

    Parameters
    ----------
    factor
        Points per node, m.

    Returns
    -------
    FloatArray
        Shape (factor, 6); every row sums to 1.

    Raises
    ------
    ValueError
        When there is not at least one point per node.
    """
    if factor < 1:
        raise ValueError(f"A chain needs at least one point per node, not {factor}.")
    place = np.arange(factor) / factor
    nodes = np.arange(_NODES) - _BEFORE
    weights = np.ones((factor, _NODES))
    for k, node in enumerate(nodes):
        for other in nodes[nodes != node]:
            weights[:, k] *= (place - other) / (node - other)
    return weights


def period_jumps(layout: Layout, length: float) -> FloatArray:
    """Return what x gains along each chain of `Layout.chains`: nothing, L_x along a wall."""
    jumps = np.zeros(layout.particles + 2)
    jumps[-2:] = length
    return jumps


class Subdivision:
    """Points between the nodes of all bodies, m to a node, each with its share of the force.

    Forces that nodes stand for are spread along the membrane; sums along a direction in which
    the nodes lie far apart need them there, not in lumps. The total force on each body is kept,
    because the six weights of a node add up to m over its points.

    Parameters
    ----------
    layout
        Nodes of the run.
    length
        Period L_x [length unit].
    factor
        Points per node, m.

    Raises
    ------
    ValueError
        When there is not at least one point per node.
    """

    def __init__(self, layout: Layout, length: float, factor: int) -> None:
        self._weights = lagrange_weights(factor)
        self._chains, self._jumps = layout.chains, period_jumps(layout, length)

    def points(self, positions: FloatArray) -> FloatArray:
        """Return where the points are, shape (m nodes, 2), from all nodes' positions."""
        return self._refined(positions, self._jumps)

    def shares(self, forces: FloatArray) -> FloatArray:
        """Return the points' shares of the forces on all nodes, shape (m nodes, 2)."""
        return self._refined(forces, np.zeros_like(self._jumps)) / len(self._weights)

    def _refined(self, values: FloatArray, jumps: FloatArray) -> FloatArray:
        if len(self._weights) == 1:
            return values
        refined = np.empty((len(self._weights) * len(values), 2))
        every = np.ones(jumps.size, np.bool_)
        begins = len(self._weights) * self._chains
        refine(values, self._chains, jumps, every, self._weights, begins, *refined.T)
        return refined


@compiled
def unroll(
    positions: FloatArray, first: int, end: int, jump: float, x: FloatArray, y: FloatArray
) -> int:
    """Copy a chain with `PADDING` nodes of wrap on each side, and return its number of nodes.

    Node ``first + s`` lands in entry ``s + PADDING``: loops over neighbours then run straight
    through memory, without a test for the ends.

    Parameters
    ----------
    positions
        Shape (nodes, 2) [length unit].
    first, end
        Rows of the chain, at least `PADDING` of them.
    jump
        Added to x when the chain comes round: 0 for a membrane, ±L_x for a wall.
    x, y
        Output, at least ``end - first + 2 * PADDING`` long.
    """
    count = end - first
    chain = positions[first:end].reshape(-1)
    for s in range(count):
        x[s + PADDING] = chain[2 * s]
        y[s + PADDING] = chain[2 * s + 1]
    for k in range(PADDING):
        x[k] = x[k + count] - jump
        y[k] = y[k + count]
        x[k + count + PADDING] = x[k + PADDING] + jump
        y[k + count + PADDING] = y[k + PADDING]
    return count


@compiled
def longest_chain(offsets: IntArray) -> int:
    """Return the largest number of nodes of a chain, 0 without chains."""
    longest = 0
    for p in range(offsets.size - 1):
        longest = max(longest, offsets[p + 1] - offsets[p])
    return longest


@compiled
def refine(
    positions: FloatArray,
    offsets: IntArray,
    jumps: FloatArray,
    selected: BoolArray,
    weights: FloatArray,
    begins: IntArray,
    points_x: FloatArray,
    points_y: FloatArray,
) -> None:
    """Place m points per node along each selected chain, at the material coordinates s + q/m.

    Parameters
    ----------
    positions
        Shape (nodes, 2) [length unit]; each chain contiguous, without jumps inside.
    offsets
        First row of each chain, and the end of the last; at least `PADDING` nodes a chain.
    jumps
        What x gains along each whole chain, shape (chains,): 0 for a membrane, ±L_x for a wall
        [length unit].
    selected
        Which chains get their points, shape (chains,).
    weights
        Of `lagrange_weights`, shape (m, 6).
    begins
        Where the points of each chain begin, shape (chains,) or more.
    points_x, points_y
        Output, shape (points,): point q of the s-th node of a chain is m s + q after its first.
    """
    factor = weights.shape[0]
    size = longest_chain(offsets) + 2 * PADDING
    x, y = np.empty(size), np.empty(size)
    for p in range(offsets.size - 1):
        if not selected[p]:
            continue
        count = unroll(positions, offsets[p], offsets[p + 1], jumps[p], x, y)
        own_x = points_x[begins[p] : begins[p] + factor * count]
        own_y = points_y[begins[p] : begins[p] + factor * count]
        for q in range(factor):
            _interpolate(x, weights[q], count, own_x[q::factor])
            _interpolate(y, weights[q], count, own_y[q::factor])


@compiled
def _interpolate(x: FloatArray, weights: FloatArray, count: int, points: FloatArray) -> None:
    """Combine the six nodes around each of the ``count`` places of an unrolled chain."""
    a, b, c, d, e, f = weights[0], weights[1], weights[2], weights[3], weights[4], weights[5]
    for s in range(count):
        points[s] = (
            a * x[s + 1] + b * x[s + 2] + c * x[s + 3] + d * x[s + 4] + e * x[s + 5] + f * x[s + 6]
        )


@compiled
def carry_back(
    forces_x: FloatArray,
    forces_y: FloatArray,
    begins: IntArray,
    offsets: IntArray,
    selected: BoolArray,
    weights: FloatArray,
    forces: FloatArray,
) -> None:
    """Add the forces on the points of `refine` to the nodes, by its transpose.

    Parameters
    ----------
    forces_x, forces_y, begins
        Shape (points,), in the order of `refine` [force per unit length of the third direction].
    offsets, selected, weights
        As in `refine`.
    forces
        Of the nodes, added to, shape (nodes, 2).
    """
    factor = weights.shape[0]
    size = longest_chain(offsets) + _NODES
    x, y = np.zeros(size), np.zeros(size)
    for p in range(offsets.size - 1):
        if not selected[p]:
            continue
        first, count = offsets[p], offsets[p + 1] - offsets[p]
        # Entry s of both belongs to node s - _BEFORE; what sticks out is folded back below.
        for s in range(count):
            for q in range(factor):
                point = begins[p] + factor * s + q
                fx, fy = forces_x[point], forces_y[point]
                # Most points touch nothing.
                if fx == 0.0 and fy == 0.0:
                    continue
                for k in range(_NODES):
                    x[s + k] += weights[q, k] * fx
                    y[s + k] += weights[q, k] * fy
        for s in range(_BEFORE):
            x[s + count] += x[s]
            y[s + count] += y[s]
        for s in range(count + _BEFORE, count + _NODES - 1):
            x[s - count] += x[s]
            y[s - count] += y[s]
        for s in range(count):
            forces[first + s, 0] += x[s + _BEFORE]
            forces[first + s, 1] += y[s + _BEFORE]
        x[: count + _NODES] = y[: count + _NODES] = 0.0
