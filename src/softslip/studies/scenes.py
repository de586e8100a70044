"""What the benchmarks run on: boxes, packings of N particles, and the same state on other nodes.

A scene comes from the real chain: discs by LAMMPS, grown into membranes, aged, then sheared. What
a process has made once it keeps, so that several benchmarks share it; nothing is kept in files.
"""

import functools
import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation import assembly, hydrodynamics, trajectory
from softslip.simulation.expansion import expand, membrane_node_counts
from softslip.simulation.packing import pack
from softslip.solver.geometry import FloatArray, IntArray, Layout
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation, Suspension

MEAN_RADIUS, SIZE_RATIO, AREA_FRACTION = 0.00846, 1.4, 0.84
"""The particles of all benchmarks, those of the paper."""

PAPER_PARTICLES, PAPER_LENGTH = 800, 0.5
"""Size of the paper's channel: smaller boxes have its shape."""

SHORTEST = 3 / 32
"""Shortest period along the flow [length unit]: five diameters of the larger particles."""

CELL = 1 / 64
"""Sides of boxes are multiples of this, or of twice this [length unit]: their meshes then have
sizes that Fourier transforms like, at any resolution."""

GAP, PAPER_GAP = 0.03, 0.56
"""Least solvent outside the walls where little is enough, and that of the paper [length unit]."""

STRESS = 0.3
"""Stress of the sheared scenes, several times the yield stress [stress unit]."""

AGEING, SHEARING = 5.0, 2.0
"""Times at rest and under stress before anything is measured [time unit]."""


def channel_sides(particles: int) -> tuple[float, float]:
    """Return L_x and H of a channel that holds a number of particles at φ = 0.84 [length unit]."""
    wanted = PAPER_LENGTH * math.sqrt(particles / PAPER_PARTICLES)
    length = max(round(wanted / (2 * CELL)) * 2 * CELL, SHORTEST)
    small = 2 * MEAN_RADIUS / (1 + SIZE_RATIO)
    area = 0.5 * math.pi * small**2 * (1 + SIZE_RATIO**2)
    return length, particles * area / (AREA_FRACTION * length)


def outer_gap(height: float, least: float = GAP) -> float:
    """Return the gap L_y - H of at least this size that makes L_y a multiple of `CELL`."""
    return math.ceil((height + least) / CELL) * CELL - height


def nearest_gap(height: float, wanted: float = PAPER_GAP) -> float:
    """Return the gap L_y - H nearest to a wanted one that makes L_y a multiple of `CELL`."""
    return round((height + wanted) / CELL) * CELL - height


def parameters_of(
    particles: int,
    fidelity: str | None = None,
    *,
    gap: float | None = None,
    seed: int = 1,
    **groups: Any,
) -> Parameters:
    """Return the parameters of a box of N particles between smooth walls.

    Parameters
    ----------
    particles
        N.
    fidelity
        Level of `config.fidelity`; None is the paper's scheme.
    gap
        Solvent outside the walls [length unit]; by default what `outer_gap` gives.
    seed
        Of the packing.
    groups
        Further settings, group by group.

    Raises
    ------
    ConfigError
        When so few particles make no channel, or there is no such level.
    """
    length, height = channel_sides(particles)
    channel = {
        "length": length,
        "height": height,
        "outer_gap": outer_gap(height) if gap is None else gap,
    }
    tree: dict[str, Any] = {
        "fidelity": fidelity,
        "seed": seed,
        "channel": channel,
        "suspension": {"area_fraction": AREA_FRACTION, "mean_radius": MEAN_RADIUS},
        "rheometer": {"stress": STRESS},
        # Small channels have no bulk.
        "recording": {"bulk_margin": None},
    }
    for group, values in groups.items():
        tree[group] = {**tree.get(group, {}), **values}
    return Parameters.from_mapping(tree)


@dataclass(frozen=True)
class Scene:
    """A state with the equations that move it.

    Attributes
    ----------
    parameters, layout, suspension, state
        Of a run.
    """

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


def advance(scene: Scene, duration: float) -> Stretch:
    """Advance a scene as its stage would, with all guards, but without records."""
    state = scene.state
    core, clock = time.process_time(), time.perf_counter()
    done = trajectory.advance(
        scene.suspension,
        state,
        np.array([state.time + duration]),
        scene.parameters,
        _ignore,
        _ignore,
    )
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


def _ignore(*_: State | Evaluation | float) -> None:
    """Show nothing."""


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
    suspension = assembly.assemble(parameters, layout, stress=parameters.rheometer.stress)
    state = State.at_rest(membranes["node_position"].values, layout)
    return Scene(parameters, layout, suspension, state)


def membranes_of(scene: Scene) -> xr.Dataset:
    """Return the membranes of a scene in the schema that `scene_of` and `renoded` take."""
    layout = scene.layout
    return _membranes(scene.state.node_position, np.diff(layout.offsets), layout.reference_area)


def _membranes(nodes: FloatArray, counts: IntArray, areas: FloatArray) -> xr.Dataset:
    return xr.Dataset(
        {
            "node_position": (("node", "axis"), nodes),
            "nodes_per_particle": ("particle", counts),
            "reference_area": ("particle", areas),
        }
    )


def renoded(membranes: xr.Dataset, parameters: Parameters) -> xr.Dataset:
    """Return the same membranes on as many nodes as other parameters give them.

    Each is the trigonometric interpolant of its nodes in the material coordinate.
    """
    before = membranes["nodes_per_particle"].values
    after = membrane_node_counts(parameters)
    chains = np.split(membranes["node_position"].values, np.cumsum(before)[:-1])
    nodes = [
        interpolation(len(chain), count) @ chain for chain, count in zip(chains, after, strict=True)
    ]
    return _membranes(np.concatenate(nodes), after, membranes["reference_area"].values)


@functools.cache
def interpolation(before: int, after: int, offset: float = 0.0) -> FloatArray:
    """Return the matrix from values at equally spaced nodes of a period to those at others.

    It evaluates the trigonometric polynomial through the nodes, of which all modes are kept.

    Parameters
    ----------
    before, after
        Numbers of nodes.
    offset
        Place of the first node of either, in spacings: 0 on membranes, 1/2 on walls.

    Returns
    -------
    FloatArray
        Shape (after, before); every row sums to 1.
    """
    places = (np.arange(after) + offset) / after
    nodes = (np.arange(before) + offset) / before
    apart = places[:, None] - nodes[None, :]
    matrix = np.ones_like(apart)
    for mode in range(1, (before + 1) // 2):
        matrix += 2 * np.cos(2 * np.pi * mode * apart)
    if before % 2 == 0:
        # Of the highest mode the nodes know the cosine only.
        highest = np.pi * before
        matrix += np.cos(highest * (places - nodes[0]))[:, None] * np.cos(
            highest * (nodes - nodes[0])
        )
    return matrix / before


def on_nodes(values: FloatArray, before: Layout, after: Layout) -> FloatArray:
    """Return a quantity of all nodes at the material points of another layout's nodes.

    Parameters
    ----------
    values
        Such as velocities, shape (nodes, components), periodic along each membrane and wall.
    before, after
        Layouts of the same membranes and walls.
    """
    parts = np.split(values, before.chains[1:-1])
    counts = np.diff(after.chains)
    offsets = chain_offsets(after)
    return np.concatenate(
        [
            interpolation(len(part), int(count), offset) @ part
            for part, count, offset in zip(parts, counts, offsets, strict=True)
        ]
    )


def chain_offsets(layout: Layout) -> list[float]:
    """Return the place of the first node of each membrane and wall, in spacings."""
    return [0.0] * layout.particles + [0.5, 0.5]
