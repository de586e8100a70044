"""One run over one scene: its records, what it took, and where its membranes are."""

import time
from dataclasses import dataclass, replace

import numpy as np

from softslip.config.parameters import Parameters
from softslip.files.quantities import QUANTITIES
from softslip.simulation.trajectory import Advanced
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.membrane import membrane_areas
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation
from softslip.studies import scenes
from softslip.studies.interval_means import IntervalMeans
from softslip.studies.membrane_nodes import interpolation
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign

MARKERS = 48
"""Points of each membrane at which members are compared, whatever their own nodes."""

COUNTS = {
    "cost": ("s / time unit", "processor time per simulated time"),
    "steps": ("1 / time unit", "steps per simulated time"),
    "evaluations": ("1 / time unit", "evaluations of the equations of motion per simulated time"),
    "rejections": ("1", "trial steps that were repeated shorter"),
    "area_deviation": QUANTITIES["area_deviation"],
    "evaluation_time": ("s", "least time of one evaluation, in turn with the reference"),
}
"""Units and meanings of what a scene gives one number for, at the records that count."""

PLACES = {
    "velocity": ("length unit / time unit", "velocities of the markers at the start"),
    "marker": ("length unit", "positions of the markers at the end of the short window"),
}
"""Units and meanings of what has a value at each point of the membranes."""


@dataclass(frozen=True)
class MemberRun:
    """A member's run over one scene.

    Attributes
    ----------
    series
        Means of `interval_means.QUANTITIES` over the records.
    counts
        `COUNTS` but for the time of an evaluation.
    velocity, marker
        `PLACES`, shape (particles, MARKERS, 2).
    last
        The scene at the end.
    """

    series: dict[str, FloatArray]
    counts: dict[str, float]
    velocity: FloatArray
    marker: FloatArray
    last: scenes.Scene


class _Watch:
    """Takes note of the observables, and of the markers at one time, along a run."""

    def __init__(self, scene: scenes.Scene, marked_at: float) -> None:
        self.series = IntervalMeans(scene.parameters, scene.layout)
        self._layout, self._marked_at = scene.layout, marked_at
        self.marker: FloatArray | None = None

    def visit(self, state: State, evaluation: Evaluation) -> None:
        """See `simulation.hydrodynamics.Visit`."""
        if self.marker is None and state.time >= self._marked_at:
            self.marker = on_markers(state.node_position, self._layout)
        self.series.visit(state, evaluation)


def run_of(scene: scenes.Scene, design: TradeoffDesign, *, short: bool) -> MemberRun:
    """Advance a scene over its window and measure it.

    Raises
    ------
    NumericalError
        When the run leaves the range in which its numbers mean anything.
    """
    long_window, short_window = design.window
    edges = design.interval * np.arange((short_window if short else long_window) + 1.0)
    start = scene.suspension.evaluate(scene.state)
    velocity = on_markers(scene.state.like(start.rate).node_position, scene.layout)
    watch = _Watch(scene, edges[short_window])

    def advanced(state: State, stops: FloatArray) -> Advanced:
        return scenes.advance_to(replace(scene, state=state), stops, watch.visit)

    begin = scene.state
    if design.skipped:
        begin = advanced(begin, edges[1 : design.skipped + 1]).state
    core = time.process_time()
    done = advanced(begin, edges[design.skipped + 1 :])
    core = time.process_time() - core
    watch.series.sample(done.state, done.evaluation)
    assert watch.marker is not None, "every run reaches the end of the short window"
    duration = done.state.time - begin.time
    return MemberRun(
        series=watch.series.means(edges),
        counts={
            "cost": core / duration,
            "steps": (done.state.step - begin.step) / duration,
            "evaluations": done.evaluations / duration,
            "rejections": float(done.rejections),
            "area_deviation": _area_deviation(done.state, scene.layout, scene.parameters),
        },
        velocity=velocity,
        marker=watch.marker,
        last=replace(scene, state=done.state),
    )


def _area_deviation(state: State, layout: Layout, parameters: Parameters) -> float:
    areas = membrane_areas(state.node_position, layout.offsets, parameters.membrane.order)
    return float(np.abs(areas / layout.reference_area - 1).max(initial=0.0))


def on_markers(values: FloatArray, layout: Layout) -> FloatArray:
    """Return a quantity of the particle nodes at `MARKERS` material points of each membrane.

    Parameters
    ----------
    values
        Shape (particle nodes, components).
    layout
        Whose nodes they are of.

    Returns
    -------
    FloatArray
        Shape (particles, MARKERS, components).
    """
    chains = np.split(values, layout.offsets[1:-1])
    return np.stack([interpolation(len(chain), MARKERS) @ chain for chain in chains])
