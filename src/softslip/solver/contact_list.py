"""Pairs of contact points, listed from pairs of nodes and kept until nodes have moved too far."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray, Layout
from softslip.solver.neighbours import find_pairs
from softslip.solver.verlet_list import SKIN, still_complete


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
        if reference is None or not still_complete(
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
