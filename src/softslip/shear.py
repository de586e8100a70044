"""The stages with hydrodynamics: ageing at zero stress, then shear (Sec. II B)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from softslip.geometry import Box, FloatArray, Layout, WallContour, wall_positions
from softslip.membrane import rest_spacing
from softslip.mobility import Mobility
from softslip.mobility.ewald import EwaldMobility
from softslip.mobility.grid import GridMobility, regularisation_of
from softslip.mobility.profile import MeanFlow
from softslip.mobility.quadrature import CorrectedQuadrature
from softslip.parameters import Parameters, split_length
from softslip.record import Observer, Recorder, described
from softslip.state import State
from softslip.suspension import Suspension
from softslip.trajectory import Advanced, Effort, Progress, Visit, advance

if TYPE_CHECKING:
    # How runs are kept is no part of the code whose change makes them run again.
    from softslip.keeper import Keeper, Kept


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


def solver_of(
    parameters: Parameters, layout: Layout, threads: int = 1
) -> GridMobility | EwaldMobility:
    """Return the Stokes solver of a run in its periodic box; 'grid' uses one thread only."""
    box, hydrodynamics = Box.of(parameters), parameters.hydrodynamics
    viscosity = parameters.solvent.viscosity
    if hydrodynamics.mobility == "grid":
        return GridMobility(box, hydrodynamics.resolution, viscosity, hydrodynamics.symbol)
    walls = layout.wall_reference.reshape(-1, 2)
    epsilon, split = regularisation_of(parameters), split_length(parameters)
    return EwaldMobility(box, epsilon, viscosity, split, rigid=walls, threads=threads)


def mobility_of(parameters: Parameters, layout: Layout, solver: Mobility | None = None) -> Mobility:
    """Return a run's Stokes solver, a new one unless it is given, with the run's quadrature."""
    solver = solver or solver_of(parameters, layout)
    if parameters.hydrodynamics.quadrature == "plain":
        return solver
    length, viscosity = parameters.channel.length, parameters.solvent.viscosity
    return CorrectedQuadrature(solver, layout, length, regularisation_of(parameters), viscosity)


def assemble(
    parameters: Parameters,
    layout: Layout,
    *,
    stress: float | None,
    shear_rate: float | None = None,
    threads: int = 1,
) -> Suspension:
    """Return the equations of motion of a run under a stress or a shear rate.

    The number of threads changes how long an evaluation takes, and no bit of it.
    """
    printed = parameters.rheometer.control == "printed" and bool(stress)
    solver = solver_of(parameters, layout, threads)
    shared = (solver.near_pairs, solver.reach) if isinstance(solver, EwaldMobility) else None
    return Suspension(
        parameters,
        layout,
        mobility_of(parameters, layout, solver),
        stress=stress,
        shear_rate=shear_rate,
        printed_control=printed,
        near_pairs=shared,
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


def age(
    expansion: xr.Dataset,
    parameters: Parameters,
    progress: Progress = _ignore,
    threads: int = 1,
    keeper: "Keeper | None" = None,
) -> xr.Dataset:
    """Relax an expanded packing at zero stress for t_w, with hydrodynamics.

    Parameters
    ----------
    expansion
        Result of `softslip.expansion.expand`.
    parameters
        Of the run.
    progress
        See `Progress`.
    threads
        See `assemble`.
    keeper
        Keeps the stage from time to time, and knows where it was broken off.

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
    aged = _follow(suspension, start, _ends(parameters), parameters, _ignore, progress, keeper, {})
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
    visit: Visit,
    progress: Progress,
    keeper: "Keeper | None",
    kept: Mapping[str, "Kept"],
) -> Advanced:
    """Advance a state from the start of a stage, or from where it was broken off."""
    if keeper is None:
        return advance(suspension, suspension.load(start), stops, parameters, visit, progress)
    found = keeper.resume(start, kept)
    state, past = found or (suspension.load(start), None)
    end = float(stops[-1]) if len(stops) else state.time

    def keep(state: State, effort: Effort) -> None:
        keeper.offer(state, effort, end, kept)

    return advance(suspension, state, stops, parameters, visit, progress, keep, past)


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
    progress: Progress = _ignore,
    threads: int = 1,
    keeper: "Keeper | None" = None,
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
    keeper
        As for `age`.

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
        parameters,
        layout,
        stress=rheometer.stress,
        shear_rate=rheometer.shear_rate,
        threads=threads,
    )
    steps = round(parameters.time_stepping.shear_time / parameters.time_stepping.step)
    observer = Observer(parameters, layout, mean_flow(parameters))
    recorder = Recorder(parameters, steps, suspension, observer, parameters.recording.snapshots)
    start, kept = _aged_state(ageing, layout), {"recorder": recorder}
    sheared = _follow(
        suspension, start, recorder.stops, parameters, recorder.visit, progress, keeper, kept
    )
    return described(
        recorder.dataset().assign(nodes_per_particle=ageing["nodes_per_particle"])
    ).assign_attrs(wall_nodes=layout.wall_nodes, particles=layout.particles, **sheared.counts)
