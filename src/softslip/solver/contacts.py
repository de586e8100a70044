"""The contact points of all bodies: where they are, what touches, and how fast films close."""

import math
from dataclasses import dataclass

import numpy as np

from softslip.solver import steric
from softslip.solver.chains import carry_back, lagrange_weights, period_jumps, refine
from softslip.solver.contact_list import ContactList, PairSource, Refinement
from softslip.solver.geometry import BoolArray, FloatArray, Layout


@dataclass(frozen=True)
class ContactLaw:
    """How membranes and walls repel each other.

    Attributes
    ----------
    range
        Contact range σ_LJ [length unit].
    strength
        c of `solver.films.contact_strength`.
    refinement
        Contact points per node.
    """

    range: float
    strength: float
    refinement: int


class Contacts:
    """Contact points, several to a node where nodes are far apart, and the forces between them.

    A point between two nodes is interpolated along its membrane or wall, and its force is carried
    back to the nodes by the transpose, so that forces remain minus the gradient of the contact
    energy and sum to zero.

    Parameters
    ----------
    law
        Of the contacts.
    length
        Period L_x [length unit].
    layout
        Of the nodes.
    shared
        Source of node pairs that something else lists anyway, and its reach.
    """

    def __init__(
        self,
        law: ContactLaw,
        length: float,
        layout: Layout,
        shared: tuple[PairSource, float] | None = None,
    ) -> None:
        self._length, self._range = length, law.range
        factor = law.refinement
        self._plain = factor == 1
        # Positions and velocities of the points.
        self._buffers = np.empty((2, factor * layout.nodes, 2))
        self._interpolation = lagrange_weights(factor)
        self._chains = layout.chains
        self._jump = period_jumps(layout, self._length)
        self._between = steric.ContactForces(
            factor * layout.chains,
            np.repeat(layout.weights, factor) / factor,
            length,
            law.range,
            law.strength,
        )
        self._to_places = self._interpolation / law.range
        self._from_forces = self._interpolation * self._between.scale
        gain = float(np.abs(self._interpolation).sum(axis=1).max())
        every = np.ones(layout.particles + 2, np.bool_)
        refinement = Refinement(
            factor, lambda values: self._points(values, self._jump, every, self._buffers[0]), gain
        )
        self._list = ContactList(layout, length, law.range, refinement, shared)

    def add_forces(self, positions: FloatArray, forces: FloatArray) -> float:
        """Add the contact forces of all nodes and return the smallest film thickness.

        Parameters
        ----------
        positions, forces
            Of all nodes, shape (nodes, 2).

        Returns
        -------
        float
            Smallest distance between contact points of two bodies [length unit]; infinite where
            nothing is within the contact range.
        """
        listed = self._list.pairs(positions)
        if not listed[1].size:
            return math.inf
        touching, between = self._list.touching, self._between
        begins, (x, y), (fx, fy) = between.slots.begins, between.places, between.forces
        refine(positions, self._chains, self._jump, touching, self._to_places, begins, x, y)
        film = between.fill(listed)
        carry_back(fx, fy, begins, self._chains, touching, self._from_forces, forces)
        return film

    def listed(self, positions: FloatArray) -> int:
        """Return the number of pairs of contact points that may touch."""
        return len(self._list.pairs(positions)[1])

    def closing_rate(self, positions: FloatArray, velocities: FloatArray) -> float:
        """Return the largest rate -d(ln h)/dt at which a film closes [1 / time unit].

        Parameters
        ----------
        positions, velocities
            Of all nodes, shape (nodes, 2).
        """
        starts, partners = self._list.pairs(positions)
        if not partners.size:
            return 0.0
        touching = self._list.touching
        points = self._points(positions, self._jump, touching, self._buffers[0])
        # What is common to a whole chain does not jump from one end to the other.
        rates = self._points(velocities, np.zeros_like(self._jump), touching, self._buffers[1])
        return steric.closing_rate(points, rates, starts, partners, self._length, self._range)

    def _points(
        self, values: FloatArray, jump: FloatArray, touching: BoolArray, points: FloatArray
    ) -> FloatArray:
        """Return a quantity of the nodes at the contact points of the touching bodies."""
        if self._plain:
            return values
        begins = len(self._interpolation) * self._chains
        refine(values, self._chains, jump, touching, self._interpolation, begins, *points.T)
        return points


class NoContacts:
    """What `Contacts` is where there are no particles: walls do not touch each other."""

    def add_forces(self, positions: FloatArray, forces: FloatArray) -> float:
        """Add nothing and return infinity, as there is no film; see `Contacts`."""
        return math.inf

    def listed(self, positions: FloatArray) -> int:
        """Return 0, the number of pairs."""
        return 0

    def closing_rate(self, positions: FloatArray, velocities: FloatArray) -> float:
        """Return 0, as there is no film to close."""
        return 0.0
