"""What studies run: states with their equations, made by the real chain and advanced.

A scene comes from the real chain: discs by LAMMPS, grown into membranes, aged, then sheared. What
a process has made once it keeps, so that several benchmarks share it; nothing is kept in files.
"""

import functools
import time
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation import assembly, hydrodynamics, trajectory
from softslip.simulation.expansion import expand
from softslip.simulation.packing import pack
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.state import State
from softslip.solver.suspension import Suspension
from softslip.studies.boxes import parameters_of
from softslip.studies.membrane_nodes import membrane_dataset

AGEING, SHEARING = 5.0, 2.0
"""Times at rest and under stress before anything is measured [time unit]."""


@dataclass(frozen=True)
class Scene:
    """A state with the equations that move it."""

    parameters: Parameters
    layout: Layout
    suspension: Suspension
    state: State


@dataclass(frozen=True)
class Stretch:
    """What advancing a scene took.

    Attributes
    ----------
    state
        At the end.
    duration
        Simulated time [time unit].
    shear_rate_wall
        Mean relative wall speed over H [1 / time unit].
    core_seconds, seconds
        Time of the processor, and of the clock.
    steps, evaluations
        Steps, and evaluations of the equations of motion.
    """

    state: State
    duration: float
    shear_rate_wall: float
    core_seconds: float
    seconds: float
    steps: int
    evaluations: int


def advance_to(
    scene: Scene,
    stops: FloatArray,
    visit: trajectory.Visit = trajectory.ignore,
    progress: trajectory.Progress = trajectory.ignore,
) -> trajectory.Advanced:
    """Advance a scene as its stage would, with all guards; see `simulation.trajectory.advance`."""
    callbacks = trajectory.Callbacks(visit, progress)
    return trajectory.advance(scene.suspension, scene.state, stops, scene.parameters, callbacks)


def advance(scene: Scene, duration: float) -> Stretch:
    """Advance a scene for some time, and measure what that takes."""
    state = scene.state
    core, clock = time.process_time(), time.perf_counter()
    done = advance_to(scene, np.array([state.time + duration]))
    core, clock = time.process_time() - core, time.perf_counter() - clock
    moved = done.state.wall_displacement - state.wall_displacement
    passed = done.state.time - state.time
    return Stretch(
        state=done.state,
        duration=passed,
        shear_rate_wall=float(moved[1] - moved[0]) / (scene.parameters.channel.height * passed),
        core_seconds=core,
        seconds=clock,
        steps=done.state.step - state.step,
        evaluations=done.evaluations,
    )


def plain_sum(parameters: Parameters, layout: Layout) -> EwaldMobility:
    """Return the Ewald sum of a run without the correction of the quadrature around it."""
    solver = assembly.solver_of(parameters, layout)
    assert isinstance(solver, EwaldMobility), "every level has this mobility"
    return solver


def aged_packing(parameters: Parameters) -> xr.Dataset:
    """Return the membranes of parameters, packed, grown and aged for their ``ageing_time``.

    The dataset has what `simulation.assembly.layout_of` wants, and ``node_position``.

    Raises
    ------
    SoftslipError
        When there is no such packing.
    """
    return hydrodynamics.age(expand(pack(parameters), parameters), parameters)


@functools.cache
def packed(particles: int) -> xr.Dataset:
    """Return the discs of N particles, which no numerical setting changes."""
    return pack(parameters_of(particles))


@functools.cache
def expanded(particles: int, fidelity: str) -> xr.Dataset:
    """Return the membranes of N particles on the nodes of a level."""
    return expand(packed(particles), parameters_of(particles, fidelity))


@functools.cache
def aged(particles: int, fidelity: str, ageing: float = AGEING) -> xr.Dataset:
    """Return N membranes after some time at rest, on the nodes of a level.

    The dataset has what `simulation.assembly.layout_of` wants, and ``node_position``.
    """
    timed = parameters_of(particles, fidelity, time_stepping={"ageing_time": ageing})
    return hydrodynamics.age(expanded(particles, fidelity), timed)


@functools.cache
def flowing(
    particles: int, fidelity: str, ageing: float = AGEING, shearing: float = SHEARING
) -> tuple[Scene, Stretch]:
    """Return N aged particles after some time under stress, and what that time took."""
    parameters = parameters_of(particles, fidelity)
    start = scene_of(aged(particles, fidelity, ageing), parameters)
    stretch = advance(start, shearing)
    return replace(start, state=stretch.state), stretch


def scene_of(
    membranes: xr.Dataset, parameters: Parameters, wall_displacement: FloatArray | None = None
) -> Scene:
    """Return membranes between walls that tethers hold rigid, under the stress of the parameters.

    Parameters
    ----------
    membranes
        ``node_position``, ``nodes_per_particle`` and ``reference_area``.
    parameters
        Whose node spacing the membranes have.
    wall_displacement
        Of each wall along x, shape (2,) [length unit]; zero by default.

    Raises
    ------
    NumericalError
        When no tethers are found.
    """
    bare = untethered(membranes, parameters)
    if wall_displacement is not None:
        bare.state.wall_displacement[:] = wall_displacement
    return replace(bare, state=bare.suspension.load(bare.state))


def untethered(membranes: xr.Dataset, parameters: Parameters) -> Scene:
    """Return membranes at rest between walls that nothing holds yet; see `scene_of`."""
    layout = assembly.layout_of(membranes, parameters)
    return at_rest(membranes["node_position"].values, layout, parameters)


def at_rest(nodes: FloatArray, layout: Layout, parameters: Parameters) -> Scene:
    """Return nodes at rest under what the rheometer imposes, between walls that nothing holds.

    Parameters
    ----------
    nodes
        Of all membranes, shape (nodes, 2) [length unit].
    layout
        Of them and the walls.
    parameters
        Of the run.
    """
    imposed = parameters.rheometer
    suspension = assembly.assemble(
        parameters, layout, stress=imposed.stress, shear_rate=imposed.shear_rate
    )
    return Scene(parameters, layout, suspension, State.at_rest(nodes, layout))


def membranes_of(scene: Scene) -> xr.Dataset:
    """Return the membranes of a scene in the schema that `scene_of` and `renoded` take."""
    layout = scene.layout
    counts = np.diff(layout.offsets)
    return membrane_dataset(scene.state.node_position, counts, layout.reference_area)
