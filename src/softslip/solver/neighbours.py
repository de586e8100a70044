"""Pairs of nodes of different bodies that are close enough to touch."""

import math

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray


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
