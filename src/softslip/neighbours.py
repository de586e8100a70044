"""Pairs of nodes of different bodies that are close enough to touch."""

import math

import numpy as np

from softslip.geometry import FloatArray, IntArray, Layout
from softslip.kernels import compiled


@compiled
def _sort_into_cells(
    positions: FloatArray, length: float, low: float, columns: int, rows: int, size: float
) -> tuple[IntArray, IntArray]:
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
    members, fill = np.empty(count, np.int64), first.copy()
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
    members: IntArray,
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
            dx -= length * math.floor(dx / length + 0.5)
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
def _largest_move(positions: FloatArray, reference: FloatArray, length: float) -> float:
    largest = 0.0
    for i in range(positions.shape[0]):
        dx = positions[i, 0] - reference[i, 0]
        dx -= length * math.floor(dx / length + 0.5)
        dy = positions[i, 1] - reference[i, 1]
        squared = dx * dx + dy * dy
        if not squared <= largest:  # Written so that NaN counts as the farthest.
            largest = squared
            if math.isnan(squared):
                break
    return math.sqrt(largest)


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
            or not _largest_move(positions, reference, self._length) < 0.5 * self._skin
        ):
            reach = self._reach + self._skin
            self._pairs = find_pairs(positions, body, walls_from, self._length, reach)
            self._reference = positions.copy()
        return self._pairs


SKIN = 0.35
"""Thickness of the Verlet skin over the contact range: balances rebuilding and listing."""


class ContactList:
    """Verlet list of the nodes of different bodies within the contact range.

    Parameters
    ----------
    layout
        Bodies of the nodes.
    length
        Period L_x [length unit].
    contact_range
        Distance below which pairs must be listed [length unit].
    """

    def __init__(self, layout: Layout, length: float, contact_range: float) -> None:
        self._body = layout.body
        self._walls_from = layout.particles
        self._list = VerletList(length, contact_range, SKIN * contact_range)

    def pairs(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return ``starts, partners`` as `find_pairs` does."""
        return self._list.pairs(positions, self._body, self._walls_from)
