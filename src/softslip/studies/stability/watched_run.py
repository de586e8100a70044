"""A run that is watched from outside: invariants and exact geometry, at every look.

None of it asks the guards that run with the scheme.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.observer import Observer
from softslip.simulation.trajectory import Advanced
from softslip.solver.geometry import LOWER, UPPER, Layout
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation
from softslip.studies import scenes
from softslip.studies.stability.exact_geometry import crossing_of, polygon_area_error

STRESS_ERROR = 1e-6
"""Largest deviation of the x-averaged stress from σ anywhere, over σ plus what contacts carry."""

AREA_ERROR = 0.02
"""Largest relative change of any area."""

LOOKS = 8
"""Times at which membranes are checked for crossings, besides the end."""


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


@dataclass(frozen=True)
class WatchedRun:
    """A run to its end, and what was seen on the way."""

    watch: Watch
    stretch: Advanced
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


def watched(scene: scenes.Scene, duration: float, evidence: Evidence) -> WatchedRun:
    """Run a scene and look at it on the way; what is seen of a run that stops is evidence too."""
    state = scene.state
    stops = duration * np.arange(1, LOOKS + 1) / LOOKS
    watch = Watch(scene.parameters, scene.layout, {0.0, *stops.tolist()})
    try:
        done = scenes.advance_to(scene, stops, watch)
    finally:
        evidence.film = watch.film / scene.parameters.steric.length
        evidence.stress_error, evidence.area_error = watch.stress_error, watch.area_error
        evidence.crossings = float(len(watch.crossings))
    evidence.time, evidence.steps = done.state.time, float(done.state.step)
    evidence.rejections = float(done.rejections)
    moved = done.state.wall_displacement - state.wall_displacement
    rate = float(moved[UPPER] - moved[LOWER]) / (scene.parameters.channel.height * duration)
    return WatchedRun(watch, done, rate)
