"""What is saved by the trimmings of contacts: their lists, their points, and their search."""

from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.solver.contacts import Contacts
from softslip.solver.geometry import FloatArray, IntArray, Layout
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.neighbours import VerletList, find_pairs, refined_pairs
from softslip.solver.suspension import Suspension
from softslip.studies import scenes
from softslip.studies.bench.trimmed import Row, Trimmed, assembled, relative_change
from softslip.studies.timing import alternately


class Searching(Contacts):
    """Contact forces without the trimmings of `Contacts`: points of all bodies, a new search.

    Parameters
    ----------
    parameters, layout
        Of the run.
    keep
        Whether node pairs are listed with a skin and kept, so that only the points remain.
    """

    def __init__(self, parameters: Parameters, layout: Layout, *, keep: bool) -> None:
        super().__init__(assembly.contact_law(parameters), parameters.channel.length, layout)
        given = parameters.steric
        self._layout, self._factor = layout, given.refinement
        self._every = np.ones(layout.particles + 2, np.bool_)
        # A point lies within a node spacing of its node.
        self._reach = given.length + 2 * float(layout.weights.max())
        skin = 0.5 * given.length
        self._kept = VerletList(self._length, self._reach, skin) if keep else None

    def node_pairs(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the pairs of nodes whose points may touch."""
        layout = self._layout
        if self._kept is not None:
            return self._kept.pairs(positions, layout.body, layout.particles)
        return find_pairs(positions, layout.body, layout.particles, self._length, self._reach)

    def add_forces(self, positions: FloatArray, forces: FloatArray) -> float:
        """Add the contact forces and return the smallest film; see `Contacts`."""
        points = self._points(positions, self._jump, self._every, self._room[0])
        starts, partners = refined_pairs(
            points,
            positions,
            *self.node_pairs(positions),
            self._layout.body,
            self._factor,
            self._length,
            self._reach,
            self._range,
        )
        return self.add_pair_forces(points, starts, partners, self._every, forces)


def with_contacts(scene: scenes.Scene, contacts: Contacts) -> Suspension:
    """Return a scene's equations of motion with other contacts."""
    suspension: Any = assembled(scene, scenes.plain_sum(scene.parameters, scene.layout))
    suspension._contacts = contacts
    given: Suspension = suspension
    return given


def own_contacts(trimmed: Trimmed, solver: EwaldMobility | None = None) -> Contacts:
    """Return the contacts of a scene, on the list of a solver if one is given."""
    shared = (solver.near_pairs, solver.reach) if solver else None
    given = trimmed.scene.parameters
    law = assembly.contact_law(given)
    return Contacts(law, given.channel.length, trimmed.scene.layout, shared)


def _search_seconds(trimmed: Trimmed, budget: float) -> dict[str, float]:
    """Return what a search for contacts takes on the list of the near sum, and without it [s]."""
    positions, solver = trimmed.evaluation.positions, trimmed.solver()
    solver.near_pairs(positions)
    seconds = alternately(
        {
            "none": lambda: own_contacts(trimmed),
            "shared": lambda: own_contacts(trimmed, solver).listed(positions),
            "own": lambda: own_contacts(trimmed).listed(positions),
        },
        budget,
    )
    return {name: seconds[name] - seconds["none"] for name in ("shared", "own")}


def contacts_row(dilute: Trimmed, budget: float, *, keep: bool) -> Row:
    """Compare with points of all bodies, from a list that is kept or from a search each time."""
    scene, run, positions = dilute.scene, dilute.run, dilute.evaluation.positions
    product = own_contacts(dilute, dilute.solver())
    searching = Searching(scene.parameters, scene.layout, keep=keep)
    forces = np.zeros_like(positions)
    seconds = alternately(
        {
            "trimmed": lambda: product.add_forces(positions, forces),
            "untrimmed": lambda: searching.add_forces(positions, forces),
        },
        budget,
    )
    search = _search_seconds(dilute, budget)
    # Without a kept list every evaluation has already searched.
    listing = run.searches * search["own"] if keep else 0.0
    return Row(
        trimmed=run.evaluations * seconds["trimmed"] + run.searches * search["shared"],
        untrimmed=run.evaluations * seconds["untrimmed"] + listing,
        whole=run.core_seconds,
        change=relative_change(
            dilute.measured(with_contacts(scene, product)),
            dilute.measured(with_contacts(scene, searching)),
        ),
        error=dilute.sum_error(),
    )


def shared_list_row(dense: Trimmed, budget: float) -> Row:
    """Compare the search on the list of the near sum with one of its own."""
    seconds = _search_seconds(dense, budget)
    return Row(
        trimmed=dense.run.searches * seconds["shared"],
        untrimmed=dense.run.searches * seconds["own"],
        whole=dense.run.core_seconds,
        change=relative_change(
            dense.measured(with_contacts(dense.scene, own_contacts(dense, dense.solver()))),
            dense.measured(with_contacts(dense.scene, own_contacts(dense))),
        ),
        error=dense.sum_error(),
    )
