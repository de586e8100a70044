"""Whether a cell is right: invariants, exact geometry, and a finer run that shares no step.

None of it asks the guards that run with the scheme, so that what they miss shows as `wrong`.
"""

import math
import time
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import NumericalError, SoftslipError
from softslip.simulation import assembly, trajectory
from softslip.simulation.assembly import regularisation_of
from softslip.simulation.contour import split
from softslip.simulation.record import Observer
from softslip.solver.geometry import LOWER, UPPER, FloatArray, Layout
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation
from softslip.studies import scenes
from softslip.studies.stability.cells import Cell
from softslip.studies.stability.exact import crossing_of, polygon_area_error
from softslip.studies.stability.scenery import merged, periodic_difference, scene_of

Verdict = Literal["correct", "stopped", "wrong"]

STRESS_ERROR = 1e-6
"""Largest deviation of the x-averaged stress from σ anywhere, over σ plus what contacts carry."""

AREA_ERROR = 0.02
"""Largest relative change of any area."""

POSITION_ERROR = 0.15
"""Largest rms difference of the nodes from the finer run, over the contact range: half of what a
film gives way to before its pressure doubles."""

RATE_ERROR = 0.03
"""Largest relative difference of the mean γ̇_wall from the finer run."""

RATE_FLOOR = 0.02
"""Difference of the walls' displacement that does not count, over the contact range."""

REST_DRIFT = 0.01
"""Largest displacement of anything at rest, over the contact range."""

LOST_DIGITS = 1e-9
"""Largest relative change of rates when whole periods are taken from the walls' displacements: a
hundred periods cost two digits of sixteen, and stiff forces some more."""

LOOKS = 8
"""Times at which membranes are checked for crossings, besides the end."""

TIGHTER = 10.0
"""Ratio of the tolerances of a cell and of its finer run."""

SHARPER = 4.0
"""Ratio of the regularisation lengths of a cell and of its sharper run."""

TIGHTEST, LOOSEST = 1e-5, 1e-3
"""Bounds of the tolerance of a finer run."""

FIRST, LONGEST = 1e-3, 0.1
"""First and longest step of a finer run [time unit]."""


@dataclass
class Evidence:
    """What a cell came to; NaN for what it did not come to.

    Attributes
    ----------
    time, steps, rejections
        Simulated time, and steps and refused trials it took.
    film
        Smallest distance between contact points of two bodies over σ_LJ.
    stress_error, area_error, position_error, rate_error
        See the limits of this module.
    crossings
        Looks at which membranes crossed each other, themselves or a wall.
    regularisation_error
        Relative difference of the shear rate from that at a quarter of ε.
    seconds
        Processor time of the cell without its finer run [s].
    """

    time: float = math.nan
    steps: float = math.nan
    rejections: float = math.nan
    film: float = math.nan
    stress_error: float = math.nan
    area_error: float = math.nan
    position_error: float = math.nan
    rate_error: float = math.nan
    crossings: float = math.nan
    regularisation_error: float = math.nan
    seconds: float = math.nan


@dataclass(frozen=True)
class Judgement:
    """What became of a cell, why, and the numbers behind it."""

    verdict: Verdict
    message: str
    evidence: Evidence


@dataclass
class Watch:
    """Looks at a run from outside, at every step and at `LOOKS` times more closely."""

    parameters: Parameters
    layout: Layout
    looks: set[float]
    stress_error: float = 0.0
    area_error: float = 0.0
    film: float = math.inf
    crossings: list[str] = field(default_factory=list)
    lost: str = ""

    def __post_init__(self) -> None:
        """Prepare what looks at the flow."""
        self._observer = Observer(self.parameters, self.layout, assembly.mean_flow(self.parameters))

    def __call__(self, state: State, evaluation: Evaluation) -> None:
        """Take note of a state."""
        self.film = min(self.film, evaluation.film_thickness)
        if not self.lost and not np.isfinite(state.vector).all():
            self.lost = f"a state that is not finite at step {state.step}"
        if state.time in self.looks:
            self._measure(state, evaluation)

    def _measure(self, state: State, evaluation: Evaluation) -> None:
        measured = self._observer.measure(state, evaluation)
        stress = self.parameters.rheometer.stress or 0.0
        forces = np.abs(evaluation.body_forces[:, 0]).sum() / self.parameters.channel.length
        size = stress + forces
        off = abs(evaluation.stress - stress) + float(measured["stress_deviation"])
        self.stress_error = max(self.stress_error, off / size if size else off)
        self.area_error = max(self.area_error, polygon_area_error(state, self.layout))
        crossing = crossing_of(state, self.layout, self.parameters)
        if crossing:
            self.crossings.append(f"{crossing} at time {state.time:.4g}")


def judge(cell: Cell) -> Judgement:
    """Run a cell and say what became of it."""
    evidence = Evidence()
    clock = time.process_time()
    try:
        scene = scene_of(cell.start, cell.tree)
        run = _run(scene, cell.duration, evidence)
    except SoftslipError as error:
        evidence.seconds = time.process_time() - clock
        return Judgement("stopped", f"{type(error).__name__}: {error}", evidence)
    evidence.seconds = time.process_time() - clock
    faults = run.faults()
    if cell.criterion == "rest":
        faults += _drift(scene, run, evidence)
    else:
        faults += _against_finer(cell, scene, run, evidence)
    if cell.criterion == "sharper":
        _sharpen(cell, scene, run, evidence)
    if cell.group == "far_shear":
        faults += _lost_digits(scene, run)
    return Judgement("wrong" if faults else "correct", "; ".join(faults), evidence)


@dataclass(frozen=True)
class WatchedRun:
    """A run to its end, and what was seen on the way."""

    watch: Watch
    stretch: trajectory.Advanced
    shear_rate: float

    def faults(self) -> list[str]:
        """Say which invariants do not hold."""
        watch = self.watch
        found = list(watch.crossings[:1])
        found += [watch.lost] if watch.lost else []
        for name, value, limit in (
            ("stress", watch.stress_error, STRESS_ERROR),
            ("area", watch.area_error, AREA_ERROR),
        ):
            if not value <= limit:
                found.append(f"{name} is off by {value:.2g}, more than {limit:g}")
        return found


def _unseen(*_: float) -> None:
    """Show no progress."""


def _run(scene: scenes.Scene, duration: float, evidence: Evidence) -> WatchedRun:
    state = scene.state
    stops = duration * np.arange(1, LOOKS + 1) / LOOKS
    watch = Watch(scene.parameters, scene.layout, {0.0, *stops.tolist()})
    try:
        done = trajectory.advance(scene.suspension, state, stops, scene.parameters, watch, _unseen)
    finally:
        evidence.film = watch.film / scene.parameters.steric.length
        evidence.stress_error, evidence.area_error = watch.stress_error, watch.area_error
        evidence.crossings = float(len(watch.crossings))
    evidence.time, evidence.steps = done.state.time, float(done.state.step)
    evidence.rejections = float(done.rejections)
    moved = done.state.wall_displacement - state.wall_displacement
    rate = float(moved[UPPER] - moved[LOWER]) / (scene.parameters.channel.height * duration)
    return WatchedRun(watch, done, rate)


def _tight(cell: Cell) -> dict[str, object]:
    """Return a cell's parameters with steps of high accuracy."""
    stepping = Parameters.from_mapping(cell.tree).time_stepping
    tight = {
        "integrator": "rkc2",
        "tolerance": min(max(stepping.tolerance / TIGHTER, TIGHTEST), LOOSEST),
        "step": min(stepping.step, FIRST),
        "longest_step": LONGEST,
    }
    return merged(cell.tree, {"time_stepping": tight})


def _against_finer(
    cell: Cell, scene: scenes.Scene, run: WatchedRun, evidence: Evidence
) -> list[str]:
    """Say how a run differs from one on twice the nodes, or from one on its own if that stops."""
    tight, problems = _tight(cell), []
    spacing = scene.parameters.hydrodynamics.node_spacing
    closer = merged(tight, {"hydrodynamics": {"node_spacing": spacing / 2}})
    for tree in [tight] if cell.criterion == "rates" else [closer, tight]:
        try:
            finer = scene_of(cell.start, tree)
            other = _run(finer, cell.duration, Evidence())
        except NumericalError as error:
            problems.append(str(error))
            continue
        rate, position = _differences(cell, scene, run, (finer, other))
        evidence.rate_error, evidence.position_error = rate, position
        return _too_far(rate, position)
    return [f"no finer run to compare with: {problems[0]}"]


def _too_far(rate: float, position: float) -> list[str]:
    """Say what differs by too much; a position error of NaN says that there are no positions."""
    faults = []
    if not rate <= RATE_ERROR:
        faults.append(f"the shear rate is off by {rate:.2g}, more than {RATE_ERROR:g}")
    if position > POSITION_ERROR:
        faults.append(f"nodes are off by {position:.2g} contact ranges, more than {POSITION_ERROR}")
    return faults


def _sharpen(cell: Cell, scene: scenes.Scene, run: WatchedRun, evidence: Evidence) -> None:
    """Note how much of the shear rate hangs on the regularisation length."""
    given = scene.parameters
    epsilon = regularisation_of(given) * given.hydrodynamics.resolution / SHARPER
    tree = merged(_tight(cell), {"hydrodynamics": {"regularisation": epsilon}})
    sharper = scene_of(cell.start, tree)
    other = _run(sharper, cell.duration, Evidence())
    evidence.regularisation_error, _ = _differences(cell, scene, run, (sharper, other))


def _differences(
    cell: Cell, scene: scenes.Scene, run: WatchedRun, finer: tuple[scenes.Scene, WatchedRun]
) -> tuple[float, float]:
    """Return how far shear rates and nodes differ; NaN for nodes that are not to be compared."""
    given = scene.parameters
    contact, span = given.steric.length, given.channel.height * cell.duration
    floor = RATE_FLOOR * contact / (span * RATE_ERROR)
    ours, theirs = run.shear_rate, finer[1].shear_rate
    rate = abs(ours - theirs) / (abs(theirs) + floor)
    if cell.criterion == "rates" or not scene.layout.particles:
        return rate, math.nan
    apart = periodic_difference(
        run.stretch.state.node_position, _on_nodes(finer, scene.layout), given.channel.length
    )
    return rate, float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))) / contact


def _on_nodes(finer: tuple[scenes.Scene, WatchedRun], layout: Layout) -> FloatArray:
    """Return the finer run's membranes at the material points of another layout's nodes."""
    scene, run = finer
    chains = split(run.stretch.state.node_position, scene.layout.offsets)
    counts = np.diff(layout.offsets)
    return np.concatenate(
        [
            scenes.interpolation(len(chain), int(count)) @ chain
            for chain, count in zip(chains, counts, strict=True)
        ]
    )


def _drift(scene: scenes.Scene, run: WatchedRun, evidence: Evidence) -> list[str]:
    before, after = scene.state, run.stretch.state
    given = scene.parameters
    apart = periodic_difference(after.node_position, before.node_position, given.channel.length)
    walls = after.wall_displacement - before.wall_displacement
    largest = max(np.abs(apart).max(initial=0.0), np.abs(walls).max())
    evidence.position_error = float(largest) / given.steric.length
    if evidence.position_error <= REST_DRIFT:
        return []
    return [f"something at rest moved by {evidence.position_error:.2g} contact ranges"]


def _lost_digits(scene: scenes.Scene, run: WatchedRun) -> list[str]:
    """Say what walls far from where they began have cost.

    The equations must not see whole periods: with these taken away from the walls' displacements,
    rates are the same but for rounding.
    """
    state, length = run.stretch.state, scene.parameters.channel.length
    first = state.node_position[scene.layout.offsets[:-1], 0]
    faults = []
    if not ((first >= 0) & (first < length)).all():
        faults.append("a particle lies outside the period")
    near = state.replace(state.vector.copy(), state.time, state.step)
    near.wall_displacement[:] = np.mod(near.wall_displacement, length)
    far_rate, near_rate = scene.suspension.rate(state), scene.suspension.rate(near)
    positions = slice(0, 2 * state.particle_nodes)
    apart = np.abs(far_rate - near_rate)[positions].max() / np.abs(near_rate)[positions].max()
    if not apart <= LOST_DIGITS:
        faults.append(f"rates depend on the walls' whole periods by {apart:.2g}")
    return faults
