"""The stages with hydrodynamics: ageing at zero stress, then shear (Sec. II B)."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.files.quantities import described
from softslip.simulation.assembly import assemble, layout_of, mean_flow
from softslip.simulation.known_mean import is_known, look_times, relative_error
from softslip.simulation.observer import Observer
from softslip.simulation.record import Recorder
from softslip.simulation.trajectory import Advanced, Callbacks, Effort, Progress, advance, ignore
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.state import State
from softslip.solver.suspension import Suspension

if TYPE_CHECKING:
    # Checkpoints are no part of the code whose change reruns a stage.
    from softslip.simulation.checkpointer import Checkpointer, Resumable


def age(
    expansion: xr.Dataset,
    parameters: Parameters,
    progress: Progress = ignore,
    threads: int = 1,
    checkpointer: "Checkpointer | None" = None,
) -> xr.Dataset:
    """Relax an expanded packing at zero stress for t_w, with hydrodynamics.

    Parameters
    ----------
    expansion
        Result of `simulation.expansion.expand`.
    parameters
        Of the run.
    progress
        See `Progress`.
    threads
        See `assemble`.
    checkpointer
        Writes checkpoints from time to time, and resumes from one.

    Returns
    -------
    xarray.Dataset
        The aged state (``node_position``, ``tether``, ``wall_displacement``,
        ``nodes_per_particle``, ``reference_area``) and how far it has come to rest
        (``shear_rate_wall``, ``area_deviation``, ``film_thickness``).

    Raises
    ------
    NumericalError
        When the packing cannot be relaxed at this time step.
    """
    packing = expansion.rename(area="reference_area")
    layout = layout_of(packing, parameters)
    suspension = assemble(parameters, layout, stress=0.0, threads=threads)
    start = State.at_rest(expansion["node_position"].values, layout)
    aged = _follow(
        suspension,
        start,
        _ends(parameters),
        parameters,
        Callbacks(progress=progress),
        checkpointer,
        {},
    )
    observer = Observer(parameters, layout, mean_flow(parameters))
    last = observer.measure(aged.state, aged.evaluation)
    state = aged.state
    return described(
        xr.Dataset(
            {
                "node_position": (("node", "axis"), state.node_position),
                "tether": (("wall", "wall_node", "axis"), state.tether),
                "wall_displacement": ("wall", state.wall_displacement),
                "nodes_per_particle": packing["nodes_per_particle"],
                "reference_area": packing["reference_area"],
                **{name: ((), last[name]) for name in RESTING},
            },
            attrs=aged.counts,
        )
    )


def _follow(
    suspension: Suspension,
    start: State,
    stops: FloatArray,
    parameters: Parameters,
    callbacks: Callbacks,
    checkpointer: "Checkpointer | None",
    others: "Mapping[str, Resumable]",
) -> Advanced:
    """Advance a state from the start of a stage, or from its checkpoint."""
    if checkpointer is None:
        return advance(suspension, suspension.load(start), stops, parameters, callbacks)
    state, past = checkpointer.resume(start, others) or (suspension.load(start), None)
    end = float(stops[-1]) if len(stops) else state.time

    def save(state: State, effort: Effort) -> None:
        checkpointer.save_if_due(state, effort, end, others)

    return advance(suspension, state, stops, parameters, replace(callbacks, save=save), past)


def _ends(parameters: Parameters) -> FloatArray:
    """Return the time at which ageing ends, none where there is no ageing, shape (1,) or (0,)."""
    stepping = parameters.time_stepping
    steps = round(stepping.ageing_time / stepping.step)
    return np.array([steps * stepping.step] if steps else [])


RESTING = ("shear_rate_wall", "area_deviation", "film_thickness")
"""Observables that say how far an aged packing has come to rest."""


def _aged_state(ageing: xr.Dataset, layout: Layout) -> State:
    """Return the state at the end of ageing as the start of a new stage."""
    state = State.at_rest(ageing["node_position"].values, layout)
    state.tether[:] = ageing["tether"].values
    state.wall_displacement[:] = ageing["wall_displacement"].values
    return state


def shear(
    ageing: xr.Dataset,
    parameters: Parameters,
    progress: Progress = ignore,
    threads: int = 1,
    checkpointer: "Checkpointer | None" = None,
) -> xr.Dataset:
    """Shear an aged packing under constant stress or constant apparent shear rate.

    Parameters
    ----------
    ageing
        Result of `age`.
    parameters
        Of the run.
    progress
        See `Progress`.
    threads
        See `assemble`.
    checkpointer
        As for `age`.

    Returns
    -------
    xarray.Dataset
        Interval means of the observables, velocity profiles and snapshots. The attribute
        ``ended_by`` is ``time``, or ``error`` where the mean shear rates were known well enough
        before (``until.error``); then ``relative_error`` is theirs.

    Raises
    ------
    NumericalError
        When the run leaves the range in which its numbers mean anything.
    """
    layout = layout_of(ageing, parameters)
    rheometer = parameters.rheometer
    suspension = assemble(
        parameters,
        layout,
        stress=rheometer.stress,
        shear_rate=rheometer.shear_rate,
        threads=threads,
    )
    steps = round(parameters.time_stepping.shear_time / parameters.time_stepping.step)
    observer = Observer(parameters, layout, mean_flow(parameters))
    recorder = Recorder(parameters, steps, suspension, observer, parameters.recording.snapshots)
    ending = _Ending(parameters, recorder)
    callbacks = Callbacks(recorder.visit, progress, ending.reached)
    start, others = _aged_state(ageing, layout), {"recorder": recorder}
    sheared = _follow(
        suspension, start, recorder.stops, parameters, callbacks, checkpointer, others
    )
    if checkpointer is not None and recorder.at_edge:
        checkpointer.save_end(sheared.state, sheared.effort, others)
    return described(
        recorder.dataset().assign(nodes_per_particle=ageing["nodes_per_particle"])
    ).assign_attrs(
        wall_nodes=layout.wall_nodes,
        particles=layout.particles,
        **sheared.counts,
        **ending.labels(sheared.state),
    )


class _Ending:
    """Whether the shear stage knows its means well enough to end before its time.

    Parameters
    ----------
    parameters
        Of the run.
    recorder
        Of the run.
    """

    def __init__(self, parameters: Parameters, recorder: Recorder) -> None:
        self._wanted, self._recorder = parameters.until.error, recorder
        self._names = ["stress"]
        if parameters.rheometer.mode == "stress":
            bulk = parameters.recording.bulk_margin is not None
            self._names = ["shear_rate_wall", *(["shear_rate_bulk"] if bulk else [])]
        self._looks = look_times(recorder.edges)

    def reached(self, state: State) -> bool:
        """Return whether the stage ends here."""
        if self._wanted is None or state.time not in self._looks:
            return False
        return all(
            is_known(self._looks, *self._recorder.series(name), state.time, self._wanted)
            for name in self._names
        )

    def labels(self, state: State) -> dict[str, str | float]:
        """Return what ended the stage, and the error if it was that."""
        if not self.reached(state):
            return {"ended_by": "time"}
        errors = [relative_error(*self._recorder.series(name)) for name in self._names]
        return {"ended_by": "error", "relative_error": max(errors)}
