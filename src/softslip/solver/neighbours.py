"""Pairs of nodes of different bodies that are close enough to touch."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray, Layout


@compiled
def _sort_into_cells(
    positions: FloatArray, length: float, low: float, columns: int, rows: int, size: float
) -> tuple[IntArray, IndexArray]:
    """Return the first entry of each cell, shape (columns * rows + 1,), and the sorted nodes."""
    count = positions.shape[0]
    cell = np.empty(count, np.int64)
    first = np.zeros(columns * rows + 1, np.int64)
    for i in range(count):
        fraction = positions[i, 0] / length
        column = int((fraction - math.floor(fraction)) * columns)
        row = int((positions[i, 1] - low) / size)
        cell[i] = min(max(column, 0), columns - 1) * rows + min(max(row, 0), rows - 1)
        first[cell[i] + 1] += 1
    for c in range(columns * rows):
        first[c + 1] += first[c]
    # Unsigned, which spares the search a test for negative indices.
    members, fill = np.empty(count, np.uint32), first.copy()
    for i in range(count):
        members[fill[cell[i]]] = i
        fill[cell[i]] += 1
    return first, members


@compiled
def _partners(
    i: int,
    positions: FloatArray,
    body: IntArray,
    walls_from: int,
    length: float,
    reach: float,
    grid: tuple[int, int, float, float],
    first: IntArray,
    members: IndexArray,
    found: IntArray,
) -> int:
    """Fill ``found`` with the partners j > i of node i in ascending order; return their number.

    A number larger than ``found`` can hold says how much room is needed.
    """
    columns, rows, low, size = grid
    fraction = positions[i, 0] / length
    column = min(int((fraction - math.floor(fraction)) * columns), columns - 1)
    row = min(max(int((positions[i, 1] - low) / size), 0), rows - 1)
    count = 0
    for shift in range(-1, 2) if columns > 2 else range(columns):
        c = ((column + shift) % columns if columns > 2 else shift) * rows
        for k in range(first[c + max(row - 1, 0)], first[c + min(row + 1, rows - 1) + 1]):
            j = members[k]
            if j <= i or body[j] == body[i] or body[i] >= walls_from:
                continue
            dx = positions[j, 0] - positions[i, 0]
            dx -= length * np.floor(dx / length + 0.5)
            dy = positions[j, 1] - positions[i, 1]
            if dx * dx + dy * dy >= reach * reach:
                continue
            if count < found.size:
                slot = count
                while slot > 0 and found[slot - 1] > j:
                    found[slot] = found[slot - 1]
                    slot -= 1
                found[slot] = j
            count += 1
    return count


@compiled
def find_pairs(
    positions: FloatArray, body: IntArray, walls_from: int, length: float, reach: float
) -> tuple[IntArray, IntArray]:
    """Return every pair i < j of nodes of different bodies closer than ``reach``.

    Two walls do not form pairs. Cells of at least the reach sort the nodes; the partners of each
    node come in ascending order, so that sums over them do not depend on the cells.

    Parameters
    ----------
    positions
        Shape (nodes, 2) [length unit]; x periodic with ``length``.
    body, walls_from
        Body of each node and the first body that is a wall.
    length, reach
        [length unit].

    Returns
    -------
    starts, partners
        The partners of node i are ``partners[starts[i]:starts[i + 1]]``.
    """
    count = positions.shape[0]
    low, high = 0.0, reach
    if count:
        low = positions[:, 1].min()
        high = positions[:, 1].max()
    columns = max(int(length / reach), 1)
    rows = min(max(int((high - low) / reach), 1), max(count, 1))
    size = (high - low) / rows * (1 + 1e-12) if high - low > reach else reach
    grid = (columns, rows, low, size)
    first, members = _sort_into_cells(positions, length, low, columns, rows, size)
    starts = np.zeros(count + 1, np.int64)
    partners = np.empty(8 * count + 8, np.int64)
    found = np.empty(64, np.int64)
    for i in range(count):
        close = _partners(
            i, positions, body, walls_from, length, reach, grid, first, members, found
        )
        if close > found.size:
            found = np.empty(2 * close, np.int64)
            close = _partners(
                i, positions, body, walls_from, length, reach, grid, first, members, found
            )
        end = starts[i] + close
        if end > partners.size:
            longer = np.empty(2 * end, np.int64)
            longer[: starts[i]] = partners[: starts[i]]
            partners = longer
        partners[starts[i] : end] = found[:close]
        starts[i + 1] = end
    return starts, partners[: starts[count]]


@compiled
def _still_complete(
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
            or not _still_complete(positions, reference, self._length, self._reach, self._skin, 1.0)
        ):
            reach = self._reach + self._skin
            self._pairs = find_pairs(positions, body, walls_from, self._length, reach)
            self._reference = positions.copy()
        return self._pairs


@compiled
def _farthest(points: FloatArray, positions: FloatArray, factor: int) -> float:
    """Return the largest distance of a point from the node it follows, lost ones aside."""
    largest = 0.0
    for b in range(points.shape[0]):
        dx = points[b, 0] - positions[b // factor, 0]
        dy = points[b, 1] - positions[b // factor, 1]
        squared = dx * dx + dy * dy
        if largest < squared < math.inf:
            largest = squared
    return math.sqrt(largest)


@compiled
def refined_pairs(
    points: FloatArray,
    positions: FloatArray,
    starts: IntArray,
    partners: IntArray,
    body: IntArray,
    factor: int,
    length: float,
    node_reach: float,
    reach: float,
) -> tuple[IntArray, IntArray]:
    """Return the pairs of points of different bodies closer than ``reach``, from pairs of nodes.

    Parameters
    ----------
    points
        ``factor`` of them follow each node along its membrane, shape (factor nodes, 2).
    positions, body
        Of the nodes, shape (nodes, 2) and (nodes,).
    starts, partners
        Pairs of nodes as of `find_pairs`, complete within ``node_reach``; more does no harm.
    factor
        Points per node.
    length
        Period L_x [length unit].
    node_reach
        No two points closer than ``reach`` belong to nodes farther apart than this [length unit].
    reach
        [length unit].

    Returns
    -------
    starts, partners
        Of the points, as `find_pairs` returns them.
    """
    count = positions.shape[0]
    first = np.zeros(factor * count + 1, np.int64)
    found, end = np.empty(8 * factor * count + 8, np.int64), 0
    close, image = np.empty(count, np.uint64), np.empty(count)
    for i in range(count):
        near = 0
        for k in range(starts[i], starts[i + 1]):
            j = np.uint64(partners[k])
            dx = positions[j, 0] - positions[i, 0]
            shift = length * np.floor(dx / length + 0.5)
            dx -= shift
            dy = positions[j, 1] - positions[i, 1]
            close[near], image[near] = j, shift
            near += (body[j] != body[i]) & (dx * dx + dy * dy < node_reach * node_reach)
        if end + factor * factor * near > found.size:
            longer = np.empty(2 * (end + factor * factor * near), np.int64)
            longer[:end] = found[:end]
            found = longer
        for a in range(factor * i, factor * (i + 1)):
            for k in range(near):
                for q in range(factor):
                    b = np.uint64(factor) * close[k] + np.uint64(q)
                    dx = points[b, 0] - points[a, 0] - image[k]
                    dy = points[b, 1] - points[a, 1]
                    found[end] = b
                    end += dx * dx + dy * dy < reach * reach
            first[a + 1] = end
    return first, found[:end].copy()


PairSource = Callable[[FloatArray], tuple[IntArray, IntArray]]
"""Returns pairs of nodes of given positions, complete within some reach."""


@dataclass(frozen=True)
class Refinement:
    """How contact points follow from nodes.

    Attributes
    ----------
    factor
        Points that follow each node along its membrane.
    points
        Returns the points of given nodes, shape (factor nodes, 2).
    gain
        Largest displacement of any point when no node moves by more than one.
    """

    factor: int = 1
    points: Callable[[FloatArray], FloatArray] = lambda positions: positions
    gain: float = 1.0


class ContactList:
    """List of contact points within the contact range, kept until the nodes have moved too far.

    It is made from pairs of nodes: those that the mobility lists anyway where they reach far
    enough, and a search of its own otherwise.

    Parameters
    ----------
    layout
        Bodies of the nodes.
    length
        Period L_x [length unit].
    contact_range
        Distance below which pairs of points must be listed [length unit].
    refinement
        The contact points, by default the nodes themselves.
    shared
        Source of node pairs and the reach within which they are complete [length unit].

    Attributes
    ----------
    touching
        Whether each body has a point in the list, shape (bodies,).
    """

    def __init__(
        self,
        layout: Layout,
        length: float,
        contact_range: float,
        refinement: Refinement = Refinement(),
        shared: tuple[PairSource, float] | None = None,
    ) -> None:
        self._body, self._walls_from = layout.body, layout.particles
        self._length = length
        self._range, self._skin = contact_range, SKIN * contact_range
        self._refinement = refinement
        self._shared = shared
        self._reference: FloatArray | None = None
        self._pairs = (np.zeros(1, np.int64), np.empty(0, np.uint32))
        self.touching = np.zeros(layout.particles + 2, np.bool_)

    def pairs(self, positions: FloatArray) -> tuple[IntArray, IndexArray]:
        """Return ``starts, partners`` of the points, complete within the contact range.

        Parameters
        ----------
        positions
            Of the nodes, shape (nodes, 2).
        """
        reference = self._reference
        if reference is None or not _still_complete(
            positions, reference, self._length, self._range, self._skin, self._refinement.gain
        ):
            starts, partners = self._find(positions)
            self._pairs = (starts, partners.astype(np.uint32))
            self._reference = positions.copy()
            factor = self._refinement.factor
            self.touching[:] = False
            self.touching[self._body[partners // factor]] = True
            self.touching[self._body[np.flatnonzero(np.diff(starts)) // factor]] = True
        return self._pairs

    def _find(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        factor = self._refinement.factor
        points = self._refinement.points(positions)
        reach = self._range + self._skin
        node_reach = reach + 2 * _farthest(points, positions, factor)
        if self._shared is not None and self._shared[1] >= node_reach:
            node_pairs = self._shared[0](positions)
        else:
            node_pairs = find_pairs(
                positions, self._body, self._walls_from, self._length, node_reach
            )
            if factor == 1:
                return node_pairs
        return refined_pairs(
            points,
            positions,
            *node_pairs,
            self._body,
            factor,
            self._length,
            node_reach,
            reach,
        )
