"""Clusters of four nodes that follow each other along a membrane, and lists of pairs of them.

A vector of the processor holds the distances of two nodes of one cluster from all four of another,
without gathering numbers from all over the memory (Páll & Hess 2013, Comput. Phys. Commun. 184,
2641). Pairs of nodes that are out of reach are worked out too, and add exactly nothing.
"""

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray

SIZE = 4
"""Nodes of a cluster."""

NOWHERE = 1e9
"""Coordinate of slots that no node fills, and, times the slot's number plus one, how far they are
from each other: out of every reach."""


class Slots:
    """Places for nodes in clusters: two groups of nodes, no cluster of both.

    Parameters
    ----------
    first, second
        Numbers of nodes of the two groups.

    Attributes
    ----------
    first, second, nodes
        As given, and both together.
    behind
        Slot of the second group's first node.
    count
        Number of slots, a multiple of `SIZE`.
    """

    def __init__(self, first: int, second: int) -> None:
        self.first, self.second = first, second
        self.nodes = first + second
        self.behind = -(-first // SIZE) * SIZE
        self.count = self.behind + -(-second // SIZE) * SIZE

    @property
    def clusters(self) -> int:
        """Number of clusters."""
        return self.count // SIZE

    def places(self) -> FloatArray:
        """Return room for the places of all nodes, shape (2, count), out of reach but for them."""
        return np.tile(NOWHERE * (1.0 + np.arange(self.count)), (2, 1))

    def values(self) -> FloatArray:
        """Return room for a quantity of all nodes, shape (2, count), zero but for them."""
        return np.zeros((2, self.count))

    def fill(self, values: FloatArray, scale: float, slots: FloatArray) -> None:
        """Fill both components of the values of all nodes, shape (nodes, 2), times a scale."""
        _fill(values, self.first, self.behind, scale, slots)

    def sum_of(self, one: FloatArray, other: FloatArray, scale: float, values: FloatArray) -> None:
        """Set the values of all nodes, shape (nodes, 2), to one quantity plus a scaled other."""
        _sum_of(one, other, self.first, self.behind, scale, values)

    def pairs(self, starts: IntArray, partners: IntArray) -> tuple[IntArray, IndexArray]:
        """Return the pairs of clusters with any of the pairs of nodes of `find_pairs`.

        Returns
        -------
        starts, partners
            Partners of cluster I, in ascending order and with itself among them if two of its own
            nodes are a pair, are ``partners[starts[I]:starts[I + 1]]``.
        """
        return _cluster_pairs(starts, partners, self.first, self.behind, self.count // SIZE)


@compiled
def _fill(values: FloatArray, first: int, behind: int, scale: float, slots: FloatArray) -> None:
    flat, count = values.reshape(-1), values.shape[0]
    for axis in range(2):
        own = slots[axis]
        for i in range(first):
            own[i] = scale * flat[2 * i + axis]
        for i in range(count - first):
            own[behind + i] = scale * flat[2 * (first + i) + axis]


@compiled
def _sum_of(
    one: FloatArray,
    other: FloatArray,
    first: int,
    behind: int,
    scale: float,
    values: FloatArray,
) -> None:
    flat, count = values.reshape(-1), values.shape[0]
    for axis in range(2):
        a, b = one[axis], other[axis]
        for i in range(first):
            flat[2 * i + axis] = a[i] + scale * b[i]
        for i in range(count - first):
            flat[2 * (first + i) + axis] = a[behind + i] + scale * b[behind + i]


@compiled
def _cluster_pairs(
    starts: IntArray, partners: IntArray, first: int, behind: int, clusters: int
) -> tuple[IntArray, IndexArray]:
    nodes = starts.size - 1
    begins = np.zeros(clusters + 1, np.int64)
    found, end = np.empty(partners.size + 1, np.uint32), 0
    # The last cluster that had each as a partner.
    seen = np.full(clusters, -1, np.int64)
    for cluster in range(clusters):
        begin, slot = end, cluster * SIZE
        node = slot if slot < behind else slot - behind + first
        last = min(node + SIZE, first if slot < behind else nodes)
        for k in range(starts[node], starts[last]):
            j = partners[k]
            other = (j if j < first else j - first + behind) // SIZE
            if seen[other] == cluster:
                continue
            seen[other] = cluster
            place = end
            while place > begin and found[place - 1] > other:
                found[place] = found[place - 1]
                place -= 1
            found[place] = other
            end += 1
        begins[cluster + 1] = end
    return begins, found[:end].copy()
