"""Clusters of four nodes that follow each other along a membrane, and lists of pairs of them.

A vector of the processor holds the distances of two nodes of one cluster from all four of another,
without gathering numbers from all over the memory (Páll & Hess 2013, Comput. Phys. Commun. 184,
2641). Pairs of nodes that are out of reach are worked out too, and add exactly nothing.
"""

from collections.abc import Sequence

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray

SIZE = 4
"""Nodes of a cluster."""

NOWHERE = 1e9
"""Coordinate of slots that no node fills, and, times the slot's number plus one, how far they are
from each other: out of every reach."""


class Slots:
    """Places for nodes in clusters, no cluster with nodes of two groups.

    Parameters
    ----------
    rows
        First node of each group and, last, the number of nodes, shape (groups + 1,).

    Attributes
    ----------
    begins
        First slot of each group and, last, the number of slots, shape (groups + 1,).
    nodes
        Number of nodes.
    count
        Number of slots, a multiple of `SIZE`.
    """

    def __init__(self, rows: IntArray | Sequence[int]) -> None:
        self._rows = np.asarray(rows, np.int64)
        sizes = np.diff(self._rows)
        self.begins = np.concatenate(([0], np.cumsum(-(-sizes // SIZE) * SIZE)))
        self.nodes, self.count = int(self._rows[-1]), int(self.begins[-1])

    @property
    def clusters(self) -> int:
        """Number of clusters."""
        return self.count // SIZE

    @property
    def of_nodes(self) -> IndexArray:
        """Slot of each node, shape (nodes,)."""
        shifts = np.repeat(self.begins[:-1] - self._rows[:-1], np.diff(self._rows))
        return (np.arange(self.nodes) + shifts).astype(np.uint32)

    def places(self) -> FloatArray:
        """Return room for the places of all nodes, shape (2, count), out of reach but for them."""
        return np.tile(NOWHERE * (1.0 + np.arange(self.count)), (2, 1))

    def values(self) -> FloatArray:
        """Return room for a quantity of all nodes, shape (2, count), zero but for them."""
        return np.zeros((2, self.count))

    def fill(self, values: FloatArray, scale: float, slots: FloatArray) -> None:
        """Fill both components of the values of all nodes, shape (nodes, 2), times a scale."""
        _fill(values, self._rows, self.begins, scale, slots)

    def add(self, slots: FloatArray, scale: float, values: FloatArray) -> None:
        """Add slots, times a scale, to the values of all nodes, shape (nodes, 2)."""
        _add(slots, self._rows, self.begins, scale, values)

    def sum_of(self, one: FloatArray, other: FloatArray, scale: float, values: FloatArray) -> None:
        """Set the values of all nodes, shape (nodes, 2), to one quantity plus a scaled other."""
        _sum_of(one, other, self._rows, self.begins, scale, values)

    def pairs(
        self, starts: IntArray, partners: IndexArray | IntArray
    ) -> tuple[IntArray, IndexArray]:
        """Return the pairs of clusters with any of the pairs of nodes of `find_pairs`.

        Returns
        -------
        starts, partners
            Partners of cluster I, in ascending order and with itself among them if two of its own
            nodes are a pair, are ``partners[starts[I]:starts[I + 1]]``.
        """
        return _cluster_pairs(starts, partners, self.of_nodes, self.clusters)


@compiled
def _fill(
    values: FloatArray, rows: IntArray, begins: IntArray, scale: float, slots: FloatArray
) -> None:
    flat = values.reshape(-1)
    for g in range(rows.size - 1):
        own, count = flat[2 * rows[g] : 2 * rows[g + 1]], rows[g + 1] - rows[g]
        x, y = slots[0, begins[g] : begins[g + 1]], slots[1, begins[g] : begins[g + 1]]
        for i in range(count):
            x[i], y[i] = scale * own[2 * i], scale * own[2 * i + 1]


@compiled
def _add(
    slots: FloatArray, rows: IntArray, begins: IntArray, scale: float, values: FloatArray
) -> None:
    flat = values.reshape(-1)
    for g in range(rows.size - 1):
        own, count = flat[2 * rows[g] : 2 * rows[g + 1]], rows[g + 1] - rows[g]
        x, y = slots[0, begins[g] : begins[g + 1]], slots[1, begins[g] : begins[g + 1]]
        for i in range(count):
            own[2 * i] += scale * x[i]
            own[2 * i + 1] += scale * y[i]


@compiled
def _sum_of(
    one: FloatArray,
    other: FloatArray,
    rows: IntArray,
    begins: IntArray,
    scale: float,
    values: FloatArray,
) -> None:
    flat = values.reshape(-1)
    for g in range(rows.size - 1):
        own, count = flat[2 * rows[g] : 2 * rows[g + 1]], rows[g + 1] - rows[g]
        first = begins[g]
        for i in range(count):
            own[2 * i] = one[0, first + i] + scale * other[0, first + i]
            own[2 * i + 1] = one[1, first + i] + scale * other[1, first + i]


@compiled
def _cluster_pairs(
    starts: IntArray, partners: IndexArray | IntArray, slots: IndexArray, clusters: int
) -> tuple[IntArray, IndexArray]:
    begins = np.zeros(clusters + 1, np.int64)
    found, end, node = np.empty(partners.size + 1, np.uint32), 0, 0
    # The last cluster that had each as a partner.
    seen = np.full(clusters, -1, np.int64)
    for cluster in range(clusters):
        begin = end
        while node < slots.size and slots[node] // SIZE == cluster:
            for k in range(starts[node], starts[node + 1]):
                other = np.int64(slots[partners[k]] // SIZE)
                if seen[other] == cluster:
                    continue
                seen[other] = cluster
                place = end
                while place > begin and found[place - 1] > other:
                    found[place] = found[place - 1]
                    place -= 1
                found[place] = other
                end += 1
            node += 1
        begins[cluster + 1] = end
    return begins, found[:end].copy()
