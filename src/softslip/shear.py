"""The stages with hydrodynamics: ageing at zero stress, then shear (Sec. II B)."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from softslip import health
from softslip.crossing import check_crossing
from softslip.errors import NumericalError
from softslip.geometry import Box, FloatArray, Layout, WallContour, wall_positions
from softslip.integrators import INTEGRATORS, Accuracy, Memory, Vector
from softslip.membrane import rest_spacing, wrap_particles
from softslip.mobility import Mobility
from softslip.mobility.ewald import EwaldMobility
from softslip.mobility.grid import GridMobility, regularisation_length
from softslip.mobility.profile import MeanFlow
from softslip.mobility.quadrature import CorrectedQuadrature
from softslip.parameters import Parameters, split_length
from softslip.record import Observer, Recorder, described
from softslip.state import State
from softslip.suspension import Evaluation, Suspension

Progress = Callable[[int, int, float], None]
"""Called as progress(parts done, parts of the stage, time)."""

Visit = Callable[[State, Evaluation], None]
"""Called before each step, and after the last, with the state and its evaluation."""


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


def regularisation_of(parameters: Parameters) -> float:
    """Return the regularisation length ε, by default that of the mesh scheme [length unit]."""
    hydrodynamics = parameters.hydrodynamics
    mesh_size = 1.0 / hydrodynamics.resolution
    if hydrodynamics.regularisation is None:
        return regularisation_length(mesh_size, hydrodynamics.symbol)
    return hydrodynamics.regularisation * mesh_size


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


@dataclass(frozen=True)
class Advanced:
    """Where a stage has got to, and what it took.

    Attributes
    ----------
    state, evaluation
        At the end.
    evaluations
        Evaluations of the equations of motion.
    rejections
        Trial steps that were refused and repeated with a shorter one.
    """

    state: State
    evaluation: Evaluation
    evaluations: int
    rejections: int

    @property
    def effort(self) -> dict[str, int]:
        """Counts for the attributes of a dataset."""
        return {
            "steps": self.state.step,
            "evaluations": self.evaluations,
            "rejections": self.rejections,
        }


def advance(
    suspension: Suspension,
    state: State,
    stops: FloatArray,
    parameters: Parameters,
    visit: Visit,
    progress: Progress,
) -> Advanced:
    """Advance a state to the last of some times: evaluate, guard, show, step.

    Parameters
    ----------
    suspension
        The equations of motion.
    state
        Where to start; the time of a new stage is 0.
    stops
        Increasing times that steps end at, shape (stops,) [time unit].
    parameters
        Of the run.
    visit
        Called with every state, the first and the last included.
    progress
        See `Progress`.

    Raises
    ------
    NumericalError
        When a guard of `softslip.health` finds the numbers out of range, or no step is short
        enough.
    """
    stepping = parameters.time_stepping
    integrate = INTEGRATORS[stepping.integrator]
    accuracy = Accuracy(stepping.tolerance, suspension.error_scale(state))
    if not state.step_size:
        state = replace(state, step_size=stepping.step)
    latest = suspension.evaluate(state)
    evaluations, rejections, refused = 1, 0, health.Rejections()

    def rate(vector: Vector, time: float) -> Vector:
        nonlocal latest, evaluations
        evaluations += 1
        latest = suspension.evaluate(state.replace(vector, time, state.step))
        return latest.rate

    end = float(stops[-1]) if len(stops) else state.time
    while True:
        _guard(state, latest, suspension.layout, parameters)
        visit(state, latest)
        if state.time >= end:
            return Advanced(state, latest, evaluations, rejections)
        until = float(stops[np.searchsorted(stops, state.time, side="right")])
        longest = _longest_step(state, latest, suspension, parameters)
        try:
            step = integrate(
                rate,
                state.vector,
                state.time,
                latest.rate,
                _memory(state),
                accuracy,
                until,
                longest,
            )
        except NumericalError as error:
            raise health.named(error, state) from error
        rejections += step.rejections
        refused.add(step.rejections, state.step)
        memory = step.memory
        state = replace(
            state.replace(step.vector, step.time, state.step + 1),
            step_size=memory.step,
            spectral_radius=memory.radius,
            radius_age=memory.age,
            direction=memory.direction,
        )
        wrap_particles(state.node_position, suspension.layout.offsets, parameters.channel.length)
        progress(round(state.time / stepping.step), round(end / stepping.step), state.time)


def _memory(state: State) -> Memory:
    return Memory(state.step_size, state.spectral_radius, state.radius_age, state.direction)


def _guard(state: State, evaluation: Evaluation, layout: Layout, parameters: Parameters) -> None:
    """Raise unless a state and its evaluation are sound; see `softslip.health`."""
    health.check_state(
        state,
        layout,
        evaluation.film_thickness,
        order=parameters.membrane.order,
        height=parameters.channel.height,
        contact_range=parameters.steric.length,
        regularisation=regularisation_of(parameters),
        node_spacing=float(layout.spacing.max(initial=0.0)),
    )
    health.check_forces(evaluation.forces, state.step)
    health.check_control(state.wall_speed, evaluation.wall_velocity, state.step)
    film, length = evaluation.film_thickness, parameters.channel.length
    check_crossing(evaluation.positions, layout, length, film, state.step)


def _longest_step(
    state: State, evaluation: Evaluation, suspension: Suspension, parameters: Parameters
) -> float:
    """Return the longest step that the motion allows; refuse a fixed one that is longer."""
    stepping, contact_range = parameters.time_stepping, parameters.steric.length
    velocities = state.like(evaluation.rate).node_position
    if stepping.integrator == "euler":
        health.check_move(velocities, stepping.step, contact_range, state.step)
        return stepping.step
    closing = suspension.closing_rate(evaluation)
    heights = state.node_position[:, 1]
    longest = health.longest_step(velocities, closing, contact_range, state.step, heights)
    return min(longest, stepping.longest_step)


def age(
    expansion: xr.Dataset,
    parameters: Parameters,
    progress: Progress = _ignore,
    threads: int = 1,
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
    state = suspension.load(State.at_rest(expansion["node_position"].values, layout))
    aged = advance(suspension, state, _ends(parameters), parameters, _ignore, progress)
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
            attrs=aged.effort,
        )
    )


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
    state = suspension.load(_aged_state(ageing, layout))
    sheared = advance(suspension, state, recorder.stops, parameters, recorder.visit, progress)
    return described(
        recorder.dataset().assign(nodes_per_particle=ageing["nodes_per_particle"])
    ).assign_attrs(wall_nodes=layout.wall_nodes, particles=layout.particles, **sheared.effort)
