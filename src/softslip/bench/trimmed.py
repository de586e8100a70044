"""Scenes with and without what the product leaves out of a run, and what their runs take."""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from softslip import shear, steric
from softslip.bench import scenes
from softslip.bench.mobility import difference
from softslip.bench.trajectory import Series
from softslip.chains import carry_back, lagrange_weights, refine
from softslip.contacts import Contacts
from softslip.errors import SoftslipError
from softslip.geometry import FloatArray, IntArray, Layout
from softslip.mobility.ewald import EwaldMobility
from softslip.neighbours import VerletList, find_pairs, refined_pairs
from softslip.parameters import Parameters, split_length
from softslip.record import Observer
from softslip.state import State
from softslip.suspension import Evaluation, Suspension

RATES = ("shear_rate_wall", "shear_rate_bulk", "slip_velocity")
"""Observables that no trimming may change."""

SHORTER_SPLIT = 0.8
"""Factor on the split length, for the error of the sums: there may be no room for a longer one."""

REPEATS = 3
"""How often a stretch is run: the least time counts, and all else comes out the same."""

Rates = dict[str, float]


@dataclass(frozen=True)
class Run:
    """What a stretch of a run took and measured.

    Attributes
    ----------
    core_seconds, steps, evaluations, samples, searches
        Per time unit: time of the processor, steps, evaluations, samples of the observables, and
        searches for contacts.
    rates
        Means of `RATES`.
    """

    core_seconds: float
    steps: float
    evaluations: float
    samples: float
    searches: float
    rates: Rates


class Searching:
    """Contact forces without the trimmings of `Contacts`: points of all bodies, a new search.

    Parameters
    ----------
    parameters, layout
        Of the run.
    keep
        Whether node pairs are listed with a skin and kept, so that only the points remain.
    """

    def __init__(self, parameters: Parameters, layout: Layout, *, keep: bool) -> None:
        given = parameters.steric
        self._layout, self._factor, self._range = layout, given.refinement, given.length
        self._length = parameters.channel.length
        self._strength = steric.contact_strength(given.energy, given.reading)
        self._interpolation = lagrange_weights(given.refinement)
        self._jump = np.zeros(layout.particles + 2)
        self._jump[-2:] = self._length
        self._weights = np.repeat(layout.weights, self._factor) / self._factor
        # A point lies within a node spacing of its node.
        self._reach = given.length + 2 * float(layout.weights.max())
        skin = 0.5 * given.length
        self._list = VerletList(self._length, self._reach, skin) if keep else None

    def node_pairs(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the pairs of nodes whose points may touch."""
        layout = self._layout
        if self._list is not None:
            return self._list.pairs(positions, layout.body, layout.particles)
        return find_pairs(positions, layout.body, layout.particles, self._length, self._reach)

    def add_forces(self, positions: FloatArray, forces: FloatArray) -> float:
        """Add the contact forces and return the smallest film; see `Contacts`."""
        layout, every = self._layout, np.ones(self._layout.particles + 2, np.bool_)
        points = np.empty((self._factor * len(positions), 2))
        refine(positions, layout.chains, self._jump, every, self._interpolation, points)
        starts, partners = refined_pairs(
            points,
            positions,
            *self.node_pairs(positions),
            layout.body,
            self._factor,
            self._length,
            self._reach,
            self._range,
        )
        on_points = np.zeros_like(points)
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
        carry_back(on_points, layout.chains, every, self._interpolation, forces)
        return film


class _Counted:
    """A source of node pairs that counts how often it is asked."""

    def __init__(self, solver: EwaldMobility) -> None:
        self._solver = solver
        self.count = 0

    def __call__(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        self.count += 1
        return self._solver.near_pairs(positions)


class Trimmed:
    """A scene as the product treats it, and pieces to treat it otherwise.

    Parameters
    ----------
    scene
        Of a level; its parameters say where the bulk begins.
    duration
        Time over which it is run [time unit].

    Attributes
    ----------
    scene, evaluation, run
        The scene, its evaluation at its beginning, and what its run took.
    """

    def __init__(self, scene: scenes.Scene, duration: float) -> None:
        self.scene = scene
        self._observer = Observer(scene.parameters, scene.layout, shear.mean_flow(scene.parameters))
        self.evaluation = scene.suspension.evaluate(scene.state)
        self.run = run_of(scene, duration)

    def solver(self, split: float = 1.0, *, rigid: bool = True) -> EwaldMobility:
        """Return the Ewald sum of the scene, if wanted at another split or without rigid walls."""
        parameters = self.scene.parameters
        if rigid and split == 1.0:
            return scenes.plain_sum(parameters, self.scene.layout)
        walls = self.scene.layout.wall_reference.reshape(-1, 2)
        return EwaldMobility(
            self.scene.suspension.box,
            shear.regularisation_of(parameters),
            parameters.solvent.viscosity,
            split * split_length(parameters),
            rigid=walls if rigid else None,
        )

    def measured(self, suspension: Suspension | None = None) -> Rates:
        """Return the rates at the beginning, by other equations of motion if they are given."""
        evaluation = (suspension or self.scene.suspension).evaluate(self.scene.state)
        sample = self._observer.measure(self.scene.state, evaluation)
        return {key: float(sample[key]) for key in RATES}

    def of_profile(self, profile: FloatArray) -> Rates:
        """Return the rates that a mean velocity profile on the observer's heights gives."""
        walls = self.evaluation.wall_velocity
        bulk = self._observer._bulk_flow(profile, walls)
        apart = float(walls[1] - walls[0]) / self.scene.parameters.channel.height
        return {"shear_rate_wall": apart} | {key: float(bulk[key]) for key in RATES[1:]}

    @property
    def heights(self) -> FloatArray:
        """Heights of the profile, shape (heights,) [length unit]."""
        return self._observer.heights

    def otherwise(self) -> Suspension:
        """Return the equations of motion with another split of the sums."""
        return assembled(self.scene, self.solver(SHORTER_SPLIT))

    def sum_error(self) -> Rates:
        """Return how far the rates at the beginning change with the split of the sums."""
        return relative_change(self.measured(), self.measured(self.otherwise()))

    def field_error(self) -> Rates:
        """Return what the rms error of the sums' velocities may do to a profile of them.

        The slip velocity is a small difference of velocities as large as a wall's.
        """
        state, given = self.scene.state, self.evaluation
        other = self.otherwise().evaluate(state)
        found, reference = (state.like(each.rate).node_position for each in (other, given))
        error = difference(found, reference)["rms_error"]
        rates, walls = self.measured(), given.wall_velocity
        speed = 0.5 * abs(float(walls[1] - walls[0]))
        return {
            "shear_rate_wall": error,
            "shear_rate_bulk": error,
            "slip_velocity": error * speed / abs(rates["slip_velocity"]),
        }


def run_of(scene: scenes.Scene, duration: float) -> Run:
    """Run a scene as its stage would, with its observables, and return what it took."""
    solver = scenes.plain_sum(scene.parameters, scene.layout)
    cores = []
    for _ in range(REPEATS):
        pairs = _Counted(solver)
        series = Series(scene.parameters, scene.layout)
        suspension = assembled(scene, solver, pairs)
        edges = scene.state.time + np.array([0.0, duration])
        core = time.process_time()
        done = shear.advance(
            suspension, scene.state, edges[1:], scene.parameters, series.visit, _ignore
        )
        cores.append(time.process_time() - core)
    if not pairs.count:
        raise SoftslipError(
            "bench trimming: the near sum does not reach as far as the search for contacts, which "
            "therefore have a list of their own; use another fidelity"
        )
    means = series.means(edges)
    return Run(
        core_seconds=min(cores) / duration,
        steps=(done.state.step - scene.state.step) / duration,
        evaluations=done.evaluations / duration,
        samples=series.samples / duration,
        searches=pairs.count / duration,
        rates={key: float(means[key][0]) for key in RATES},
    )


def _ignore(*_: State | Evaluation | float) -> None:
    """Show nothing."""


def assembled(
    scene: scenes.Scene, solver: EwaldMobility, pairs: _Counted | None = None
) -> Suspension:
    """Return a scene's equations of motion around a solver whose list the contacts share."""
    return Suspension(
        scene.parameters,
        scene.layout,
        shear.mobility_of(scene.parameters, scene.layout, solver),
        stress=scene.parameters.rheometer.stress,
        near_pairs=(pairs or solver.near_pairs, solver.reach),
    )


def with_contacts(scene: scenes.Scene, contacts: Contacts | Searching) -> Suspension:
    """Return a scene's equations of motion with other contacts."""
    suspension: Any = assembled(scene, scenes.plain_sum(scene.parameters, scene.layout))
    suspension._contacts = contacts
    given: Suspension = suspension
    return given


def relative_change(trimmed: Rates, untrimmed: Rates) -> Rates:
    """Return the relative size of what a trimming changes, 0 where nothing does."""
    return {
        key: abs(trimmed[key] - untrimmed[key]) / abs(untrimmed[key])
        if trimmed[key] != untrimmed[key]
        else 0.0
        for key in RATES
    }
