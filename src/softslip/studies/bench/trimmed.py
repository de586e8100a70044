"""Scenes as the product treats them and otherwise, what their runs take, and how both compare."""

import time
from dataclasses import dataclass, replace

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import SoftslipError
from softslip.simulation import assembly, trajectory
from softslip.simulation.assembly import regularisation_of, split_length_of
from softslip.simulation.expansion import expand
from softslip.simulation.packing import pack
from softslip.simulation.record import Observer
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation, Suspension
from softslip.studies import scenes
from softslip.studies.bench.mobility import difference
from softslip.studies.bench.trajectory import Series

RATES = ("shear_rate_wall", "shear_rate_bulk", "slip_velocity")
"""Observables that no trimming may change."""

MARGIN = 3.0
"""Distance from the walls where the bulk begins: small boxes have none of 5 [mean radius]."""

DILUTE = 0.3
"""Area fraction at which particles are apart."""

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


@dataclass(frozen=True)
class Row:
    """One trimming: core-seconds per time unit with and without it, and what it changes.

    Attributes
    ----------
    trimmed, untrimmed
        Core-seconds per time unit of the work in question.
    whole
        Core-seconds per time unit of the run that has the trimming.
    change
        Relative change of `RATES` by the trimming.
    error
        Relative error of the estimate of `RATES`, from which a change must not stand out.
    """

    trimmed: float
    untrimmed: float
    whole: float
    change: Rates
    error: Rates

    def figures(self) -> dict[str, float]:
        """Return all figures by name; ``saved`` is the share of the untrimmed run's cost."""
        saved = self.untrimmed - self.trimmed
        return {
            "trimmed_seconds": self.trimmed,
            "untrimmed_seconds": self.untrimmed,
            "saved": saved / (self.whole + saved),
            **{f"{key}_change": value for key, value in self.change.items()},
            **{f"{key}_error": value for key, value in self.error.items()},
        }


class Counted:
    """A source of node pairs that counts how often it is asked."""

    def __init__(self, solver: EwaldMobility) -> None:
        self._solver = solver
        self.count = 0

    def __call__(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the near pairs of the solver, and count."""
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
        self._observer = Observer(
            scene.parameters, scene.layout, assembly.mean_flow(scene.parameters)
        )
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
            regularisation_of(parameters),
            parameters.solvent.viscosity,
            split * split_length_of(parameters),
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


def dense_scene(particles: int, fidelity: str, ageing: float, shearing: float) -> scenes.Scene:
    """Return the sheared scene of all benchmarks with a bulk to fit a line to."""
    scene, _ = scenes.flowing(particles, fidelity, ageing, shearing)
    recording = {"bulk_margin": MARGIN}
    return replace(scene, parameters=scenes.parameters_of(particles, fidelity, recording=recording))


def dilute_scene(particles: int, fidelity: str) -> scenes.Scene:
    """Return fewer particles in the same channel, round and apart, under the same stress."""
    parameters = scenes.parameters_of(
        particles,
        fidelity,
        suspension={"area_fraction": DILUTE},
        recording={"bulk_margin": MARGIN},
    )
    membranes = expand(pack(parameters), parameters)
    return scenes.scene_of(membranes.rename(area="reference_area"), parameters)


def same_state(scene: scenes.Scene, parameters: Parameters) -> scenes.Scene:
    """Return the same nodes at the same instant under other parameters."""
    suspension = assembly.assemble(parameters, scene.layout, stress=parameters.rheometer.stress)
    return replace(scene, parameters=parameters, suspension=suspension)


def run_of(scene: scenes.Scene, duration: float) -> Run:
    """Run a scene as its stage would, with its observables, and return what it took."""
    solver = scenes.plain_sum(scene.parameters, scene.layout)
    cores = []
    for _ in range(REPEATS):
        pairs = Counted(solver)
        series = Series(scene.parameters, scene.layout)
        suspension = assembled(scene, solver, pairs)
        edges = scene.state.time + np.array([0.0, duration])
        core = time.process_time()
        done = trajectory.advance(
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
    scene: scenes.Scene, solver: EwaldMobility, pairs: Counted | None = None
) -> Suspension:
    """Return a scene's equations of motion around a solver whose list the contacts share."""
    stress = scene.parameters.rheometer.stress
    return assembly.assemble_around(
        solver, scene.parameters, scene.layout, stress=stress, pairs=pairs
    )


def relative_change(trimmed: Rates, untrimmed: Rates) -> Rates:
    """Return the relative size of what a trimming changes, 0 where nothing does."""
    return {
        key: abs(trimmed[key] - untrimmed[key]) / abs(untrimmed[key])
        if trimmed[key] != untrimmed[key]
        else 0.0
        for key in RATES
    }
