"""The stages with hydrodynamics: ageing at zero stress, then shear (Sec. II B)."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from softslip import health
from softslip.geometry import Box, FloatArray, Layout, WallContour, wall_positions
from softslip.integrators import INTEGRATORS, Vector
from softslip.membrane import rest_spacing, wrap_particles
from softslip.mobility import Mobility
from softslip.mobility.ewald import EwaldMobility
from softslip.mobility.grid import GridMobility, regularisation_length
from softslip.mobility.profile import MeanFlow
from softslip.parameters import Parameters
from softslip.record import Observer, Recorder, described
from softslip.state import State
from softslip.suspension import Evaluation, Suspension

Progress = Callable[[int, int, float], None]
"""Called as progress(steps done, steps of the stage, time)."""

Visit = Callable[[State, Evaluation], None]
"""Called before each step with the state and its evaluation."""

GUARD_INTERVAL = 20
"""Steps between two full checks of the state; its motion is checked at every step."""


def _ignore(*_: object) -> None:
    """Show nothing."""


def layout_of(packing: xr.Dataset, parameters: Parameters) -> Layout:
    """Return the node layout of an expanded packing between the run's walls.

    Rest distances are those of the circle of each particle's reference area (Sec. II B).

    Parameters
    ----------
    packing
        Dataset with ``nodes_per_particle`` and ``reference_area``.
    parameters
        Of the run.
    """
    hydrodynamics = parameters.hydrodynamics
    counts = packing["nodes_per_particle"].values
    offsets = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    contour = WallContour.of(parameters)
    spacing = hydrodynamics.node_spacing / hydrodynamics.resolution
    walls = wall_positions(contour, parameters.channel.height, spacing)
    areas = packing["reference_area"].values
    return Layout(offsets, rest_spacing(areas, offsets), walls, contour.arc_length / walls.shape[1])


def assemble(
    parameters: Parameters, layout: Layout, *, stress: float | None, shear_rate: float | None = None
) -> Suspension:
    """Return the equations of motion of a run under a stress or a shear rate."""
    box, hydrodynamics = Box.of(parameters), parameters.hydrodynamics
    viscosity = parameters.solvent.viscosity
    mobility: Mobility
    if hydrodynamics.mobility == "grid":
        mobility = GridMobility(box, hydrodynamics.resolution, viscosity, hydrodynamics.symbol)
    else:
        mesh_size = 1.0 / hydrodynamics.resolution
        regularisation = regularisation_length(mesh_size, hydrodynamics.symbol)
        mobility = EwaldMobility(box, regularisation, viscosity, hydrodynamics.split * mesh_size)
    printed = parameters.rheometer.control == "printed" and bool(stress)
    return Suspension(
        parameters,
        layout,
        mobility,
        stress=stress,
        shear_rate=shear_rate,
        printed_control=printed,
    )


def mean_flow(parameters: Parameters) -> MeanFlow:
    """Return the one-dimensional solver of the run's x-averaged flow."""
    hydrodynamics = parameters.hydrodynamics
    return MeanFlow(
        Box.of(parameters),
        hydrodynamics.resolution,
        parameters.solvent.viscosity,
        hydrodynamics.symbol,
        parameters.channel.outside,
    )


def advance(
    suspension: Suspension,
    state: State,
    steps: int,
    parameters: Parameters,
    reference_area: FloatArray,
    visit: Visit,
    progress: Progress,
) -> State:
    """Advance a state by a number of steps: evaluate, guard, show, step.

    Raises
    ------
    NumericalError
        When a guard of `softslip.health` finds the numbers out of range.
    """
    stepping, contact_range = parameters.time_stepping, parameters.steric.length
    integrate, layout = INTEGRATORS[stepping.integrator], suspension.layout

    def rate(vector: Vector, time: float) -> Vector:
        return suspension.rate(state.replace(vector, time, state.step))

    def guard(current: State, evaluation: Evaluation) -> None:
        health.check_state(
            current,
            layout,
            reference_area,
            evaluation.film_thickness,
            height=parameters.channel.height,
            contact_range=contact_range,
        )

    for _ in range(steps):
        evaluation = suspension.evaluate(state)
        velocities = state.like(evaluation.rate).node_position
        health.check_move(velocities, stepping.step, contact_range, state.step)
        if state.step % GUARD_INTERVAL == 0:
            guard(state, evaluation)
        visit(state, evaluation)
        vector = integrate(rate, state.vector, state.time, stepping.step, evaluation.rate)
        done = state.step + 1
        state = state.replace(vector, done * stepping.step, done)
        wrap_particles(state.node_position, layout.offsets, parameters.channel.length)
        progress(done, steps, state.time)
    guard(state, suspension.evaluate(state))
    return state


def age(expansion: xr.Dataset, parameters: Parameters, progress: Progress = _ignore) -> xr.Dataset:
    """Relax an expanded packing at zero stress for t_w, with hydrodynamics.

    Parameters
    ----------
    expansion
        Result of `softslip.expansion.expand`.
    parameters
        Of the run.
    progress
        See `Progress`.

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
    suspension = assemble(parameters, layout, stress=0.0)
    state = suspension.load(State.at_rest(expansion["node_position"].values, layout))
    steps = round(parameters.time_stepping.ageing_time / parameters.time_stepping.step)
    areas = packing["reference_area"].values
    state = advance(suspension, state, steps, parameters, areas, _ignore, progress)
    observer = Observer(parameters, layout, mean_flow(parameters), areas)
    last = observer.measure(state, suspension.evaluate(state))
    return described(
        xr.Dataset(
            {
                "node_position": (("node", "axis"), state.node_position),
                "tether": (("wall", "wall_node", "axis"), state.tether),
                "wall_displacement": ("wall", state.wall_displacement),
                "nodes_per_particle": packing["nodes_per_particle"],
                "reference_area": packing["reference_area"],
                **{name: ((), last[name]) for name in RESTING},
            }
        )
    )


RESTING = ("shear_rate_wall", "area_deviation", "film_thickness")
"""Observables that say how far an aged packing has come to rest."""


def _aged_state(ageing: xr.Dataset, layout: Layout) -> State:
    """Return the state at the end of ageing as the start of a new stage."""
    state = State.at_rest(ageing["node_position"].values, layout)
    state.tether[:] = ageing["tether"].values
    state.wall_displacement[:] = ageing["wall_displacement"].values
    return state


def shear(ageing: xr.Dataset, parameters: Parameters, progress: Progress = _ignore) -> xr.Dataset:
    """Shear an aged packing under constant stress or constant apparent shear rate.

    Parameters
    ----------
    ageing
        Result of `age`.
    parameters
        Of the run.
    progress
        See `Progress`.

    Returns
    -------
    xarray.Dataset
        Interval means of the observables, velocity profiles and snapshots.

    Raises
    ------
    NumericalError
        When the run leaves the range in which its numbers mean anything.
    """
    layout = layout_of(ageing, parameters)
    rheometer = parameters.rheometer
    suspension = assemble(
        parameters, layout, stress=rheometer.stress, shear_rate=rheometer.shear_rate
    )
    steps = round(parameters.time_stepping.shear_time / parameters.time_stepping.step)
    areas = ageing["reference_area"].values
    observer = Observer(parameters, layout, mean_flow(parameters), areas)
    recorder = Recorder(parameters, steps, suspension, observer, parameters.recording.snapshots)
    state = suspension.load(_aged_state(ageing, layout))
    advance(suspension, state, steps, parameters, areas, recorder.visit, progress)
    return described(
        recorder.dataset().assign(nodes_per_particle=ageing["nodes_per_particle"])
    ).assign_attrs(wall_nodes=layout.wall_nodes, particles=layout.particles)
