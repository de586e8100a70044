"""The contact points of all bodies: where they are, what touches, and how fast films close."""

import math

import numpy as np

from softslip import steric
from softslip.chains import carry_back, lagrange_weights, refine
from softslip.geometry import BoolArray, FloatArray, Layout
from softslip.neighbours import ContactList, PairSource, Refinement
from softslip.parameters import Parameters


class Contacts:
    """Contact points, several to a node where nodes are far apart, and the forces between them.

    A point between two nodes is interpolated along its membrane or wall, and its force is carried
    back to the nodes by the transpose, so that forces remain minus the gradient of the contact
    energy and sum to zero.

    Parameters
    ----------
    parameters, layout
        Of the run.
    shared
        Source of node pairs that something else lists anyway, and its reach.
    """

    def __init__(
        self,
        parameters: Parameters,
        layout: Layout,
        shared: tuple[PairSource, float] | None = None,
    ) -> None:
        given, self._length = parameters.steric, parameters.channel.length
        self._range = given.length
        self._strength = steric.contact_strength(given.energy, given.reading)
        factor = given.refinement
        self._plain = factor == 1
        # Of the points, their positions and forces: used again at every evaluation.
        self._room = np.empty((2, factor * layout.nodes, 2))
        self._interpolation = lagrange_weights(factor)
        self._chains = layout.chains
        self._jump = np.zeros(layout.particles + 2)
        self._jump[-2:] = self._length
        self._weights = np.repeat(layout.weights, factor) / factor
        gain = float(np.abs(self._interpolation).sum(axis=1).max())
        every = np.ones(layout.particles + 2, np.bool_)
        refinement = Refinement(
            factor, lambda values: self._points(values, self._jump, every), gain
        )
        self._list = ContactList(layout, self._length, given.length, refinement, shared)

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
        starts, partners = self._list.pairs(positions)
        if not partners.size:
            return math.inf
        if self._plain:
            points, on_points = positions, forces
        else:
            points, on_points = self._room
            self._refine(positions, self._jump, self._list.touching, points)
            on_points[:] = 0.0
        film = steric.add_contacts(
            points,
            self._weights,
            starts,
            partners,
            self._length,
            self._range,
            self._strength,
            on_points,
        )
        if not self._plain:
            touching = self._list.touching
            carry_back(on_points, self._chains, touching, self._interpolation, forces)
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
        points = self._points(positions, self._jump, touching)
        rates = self._points(velocities, np.zeros_like(self._jump), touching)
        return steric.closing_rate(points, rates, starts, partners, self._length, self._range)

    def _points(self, values: FloatArray, jump: FloatArray, wanted: BoolArray) -> FloatArray:
        """Return a quantity of the nodes at the contact points of the wanted bodies."""
        if self._plain:
            return values
        points = np.empty((self._interpolation.shape[0] * len(values), 2))
        self._refine(values, jump, wanted, points)
        return points

    def _refine(
        self, values: FloatArray, jump: FloatArray, wanted: BoolArray, points: FloatArray
    ) -> None:
        refine(values, self._chains, jump, wanted, self._interpolation, points)
