"""Contact repulsion between nodes of different bodies (Eqs. 2 and 22)."""

import math

import numpy as np

from softslip.solver.clusters import SIZE, Slots
from softslip.solver.compilation import compiled, compiled_exactly
from softslip.solver.geometry import FloatArray, IndexArray, IntArray
from softslip.solver.lanes import (
    add_four,
    add_two,
    beyond,
    equal,
    four_twice,
    how_many,
    lesser,
    multiply_add,
    nearest_integer,
    put_eight,
    two_by_four,
    where,
)


class ContactForces:
    """Contact forces between nodes of different bodies.

    The pair force is c w_i w_j (96/r) [(σ_LJ/r)^8 - (σ_LJ/r)^6], minus the derivative of Eq. 22,
    repulsive below σ_LJ, where it is cut off and vanishes.

    Parameters
    ----------
    chains
        First node of each body and, last, the number of nodes, shape (bodies + 1,).
    weights
        Of the nodes, shape (nodes,) [length unit].
    length
        Period L_x [length unit].
    contact_range
        σ_LJ [length unit].
    strength
        c of `contact_strength`.

    Attributes
    ----------
    slots
        Of the nodes.
    places, forces
        Of the nodes, in slots, shape (2, slots): places over σ_LJ, forces over `scale`.
    scale
        Unit of the forces.
    """

    def __init__(
        self,
        chains: IntArray,
        weights: FloatArray,
        length: float,
        contact_range: float,
        strength: float,
    ) -> None:
        self.slots = Slots(chains)
        self._length, self._range = length / contact_range, contact_range
        self.scale = 96.0 * strength / contact_range
        self._weights = np.zeros(self.slots.count)
        self._weights[self.slots.of_nodes] = weights
        self.places, self.forces = self.slots.places(), self.slots.values()
        self._listed: object = None
        self._clusters = np.zeros(1, np.int64), np.empty(0, np.uint32)

    def fill(self, listed: tuple[IntArray, IndexArray | IntArray]) -> float:
        """Set the forces of the nodes in their places and return the smallest distance.

        Parameters
        ----------
        listed
            Pairs of `solver.neighbours.find_pairs`, complete within the contact range.

        Returns
        -------
        float
            Smallest distance between nodes of two bodies [length unit], or infinity when nothing
            is within the range.
        """
        if listed is not self._listed:
            self._listed, self._clusters = listed, self.slots.pairs(*listed)
        self.forces[:] = 0.0
        closest = _add_contacts(
            self.places, self._weights, *self._clusters, self._length, self.forces
        )
        return self._range * math.sqrt(closest)

    def add(
        self,
        positions: FloatArray,
        listed: tuple[IntArray, IndexArray | IntArray],
        forces: FloatArray,
    ) -> float:
        """Add the contact forces of nodes, shape (nodes, 2), and return as `fill` does."""
        self.slots.fill(positions, 1.0 / self._range, self.places)
        film = self.fill(listed)
        self.slots.add(self.forces, self.scale, forces)
        return film


@compiled_exactly
def _add_contacts(
    points: FloatArray,
    weights: FloatArray,
    starts: IntArray,
    partners: IndexArray,
    length: float,
    forces: FloatArray,
) -> float:
    """Add the forces over 96 c/σ_LJ and return the least (r/σ_LJ)².

    Pairs out of range add exactly nothing, and sums run in the order of the clusters, so that
    they do not depend on the age of the list.

    Parameters
    ----------
    points, forces
        In slots, shape (2, slots), points over the range; x periodic with ``length``.
    weights
        In slots, shape (slots,).
    starts, partners
        Pairs of clusters.
    """
    x, y, gx, gy = points[0], points[1], forces[0], forces[1]
    per_length, two, size = 1.0 / length, np.uint64(2), np.uint64(SIZE)
    closest = equal(np.inf)
    for cluster in range(starts.size - 1):
        begin, end = starts[cluster], starts[cluster + 1]
        if begin == end:
            continue
        # Two of its nodes a vector, each with the four of a partner.
        i = np.uint64(cluster) * size
        x1, y1, w1 = two_by_four(x, i), two_by_four(y, i), two_by_four(weights, i)
        x2, y2, w2 = two_by_four(x, i + two), two_by_four(y, i + two), two_by_four(weights, i + two)
        fx1, fy1, fx2, fy2 = equal(0.0), equal(0.0), equal(0.0), equal(0.0)
        for k in range(begin, end):
            j = np.uint64(partners[np.uint64(k)]) * size
            xj, yj = four_twice(x, j), four_twice(y, j)
            dx1, dy1 = xj - x1, yj - y1
            dx2, dy2 = xj - x2, yj - y2
            dx1 = multiply_add(nearest_integer(dx1 * per_length), -length, dx1)
            dx2 = multiply_add(nearest_integer(dx2 * per_length), -length, dx2)
            square1 = multiply_add(dx1, dx1, dy1 * dy1)
            square2 = multiply_add(dx2, dx2, dy2 * dy2)
            # What is no number is not beyond the range, and shows in the forces.
            beyond1, beyond2 = beyond(square1, 1.0), beyond(square2, 1.0)
            if how_many(beyond1) + how_many(beyond2) == 16:
                continue
            closest = lesser(square1, lesser(square2, closest))
            w = four_twice(weights, j)
            ratio1, ratio2 = 1.0 / square1, 1.0 / square2
            twice1, twice2 = ratio1 * ratio1, ratio2 * ratio2
            force1 = (w1 * w) * ((twice1 * twice1) * (ratio1 - 1.0))
            force2 = (w2 * w) * ((twice2 * twice2) * (ratio2 - 1.0))
            force1, force2 = where(beyond1, 0.0, force1), where(beyond2, 0.0, force2)
            px1, py1, px2, py2 = force1 * dx1, force1 * dy1, force2 * dx2, force2 * dy2
            fx1, fy1, fx2, fy2 = fx1 - px1, fy1 - py1, fx2 - px2, fy2 - py2
            add_four(gx, j, px1 + px2)
            add_four(gy, j, py1 + py2)
        add_two(gx, i, fx1)
        add_two(gy, i, fy1)
        add_two(gx, i + two, fx2)
        add_two(gy, i + two, fy2)
    least = np.empty(8)
    put_eight(least, np.uint64(0), closest)
    nearest = least.min()
    return nearest if nearest < 1.0 else math.inf


@compiled
def closing_rate(
    positions: FloatArray,
    velocities: FloatArray,
    starts: IntArray,
    partners: IndexArray | IntArray,
    length: float,
    contact_range: float,
) -> float:
    """Return the largest -(d/dt) ln r over pairs within the contact range, at least 0.

    Parameters
    ----------
    positions, velocities
        Shape (nodes, 2); x periodic with ``length``.
    starts, partners, contact_range
        As for `ContactForces`.
    """
    cutoff = contact_range * contact_range
    fastest = 0.0
    for i in range(starts.size - 1):
        for k in range(starts[i], starts[i + 1]):
            j = partners[k]
            dx = positions[j, 0] - positions[i, 0]
            dx -= length * np.floor(dx / length + 0.5)
            dy = positions[j, 1] - positions[i, 1]
            squared = dx * dx + dy * dy
            if squared < cutoff:
                approach = dx * (velocities[i, 0] - velocities[j, 0])
                approach += dy * (velocities[i, 1] - velocities[j, 1])
                fastest = max(fastest, approach / squared)
    return fastest
