"""How much work a stage of a run is: nodes, records, evaluations, numbers that are stored.

Euler takes one evaluation of the equations of motion a step. A step Δt of rkc2 takes
√(1 + Δt ρ / 0.65) of them: ρ is the spectral radius, which grows as nodes come closer and the
regularisation shorter, and Δt the shortest of the time to the next record, the longest step, and
the step that the tolerance allows at that stress. ρ and the latter are power laws; they do not
depend on the machine, and their constants were fitted once to the runs of ``costs.json``. Of ρ,
imex_rkc2 sees what its implicit part leaves, less as steps are longer, and its steps are longer
too: so long that records cut them, into as many steps, all alike, as are needed.
"""

import math
from functools import cache, lru_cache

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.solver.geometry import FloatArray

STABLE_STEP = 0.65
"""Δt ρ / s² of s stages of rkc2 at the edge of stability (Sommeijer, Shampine & Verwer 1998)."""

FEWEST_STAGES = 3.0
"""Evaluations of a step of rkc2 at least."""

START_STEPS = 9.5
"""Additional steps of rkc2 at the start, where films settle and steps are short."""

STEP_LAW = (1.055, 0.29, -0.42)
"""Step that the tolerance allows [η / K_e]: factor, and powers of the tolerance and the stress."""

RADIUS_LAW = (0.056, -0.714, -0.42)
"""Spectral radius [K_e / η]: factor, and powers of node spacing and regularisation length."""

GRID_REGULARISATION = 0.78
"""Regularisation length of the mesh of 'grid' over its mesh size."""

IMPLICIT_STEP_LAW = (1.28, 1 / 3, -0.85)
"""The same of imex_rkc2, whose steps follow the motion alone (40 to 800 particles)."""

REMAINDER = 55.0
"""s² - 1 of the s stages of a step η/K_e of imex_rkc2; it grows as √Δt, as the spectral radius that
the implicit part leaves falls (40 to 800 particles at all levels)."""

IMPLICIT_STAGES, BESIDE_STAGES = 5.0, 1.3
"""Stages of a step of imex_rkc2 at least, and its evaluations beside them: the smoothing, and a
step's share in estimates of the spectral radius."""

IMPLICIT_START = 120.0
"""Additional evaluations of imex_rkc2 at the start."""

IMPLICIT_AGEING = 0.08
"""Stress over the membrane modulus at which steps of imex_rkc2 are as long as in ageing."""

IMPLICIT_WORK = 1.35
"""Work of a stage of imex_rkc2 over that of its evaluation, in 800 particles at 'standard'."""

NODE_GROWTH, MESH_GROWTH = 1.05, 1.3
"""Powers of the number of nodes or mesh points as which the time of an evaluation grows, by the
benchmarks of 50 to 800 particles: meshes outgrow the processor's caches."""

LEAST_STRESS, USUAL_STRESS = 0.02, 0.3
"""Stress over the membrane modulus below which steps grow no longer, and the one that is assumed
where a shear rate is imposed."""


@cache
def _contours(parameters: Parameters) -> tuple[float, float]:
    """Return the lengths of all membranes as circles, and of both walls [length unit]."""
    membranes = 2 * math.pi * float(particle_radii(parameters).sum())
    return membranes, 2 * wall_contour(parameters).arc_length


def membrane_nodes(parameters: Parameters) -> float:
    """Return the number of nodes of all membranes, to a per cent."""
    flow = parameters.hydrodynamics
    return _contours(parameters)[0] * flow.resolution / flow.node_spacing


def nodes(parameters: Parameters) -> float:
    """Return the number of nodes of membranes and walls, to a per cent."""
    flow = parameters.hydrodynamics
    return sum(_contours(parameters)) * flow.resolution / flow.node_spacing


def mesh_points(parameters: Parameters) -> float:
    """Return the number of points of the mesh of 'grid'."""
    channel, resolution = parameters.channel, parameters.hydrodynamics.resolution
    return channel.length * (channel.height + channel.outer_gap) * resolution**2


def load(stage: str, parameters: Parameters, evaluations: float) -> float:
    """Return what the time of a stage is proportional to, beyond what it takes to start."""
    radii, growth = particle_radii(parameters), parameters.expansion
    if stage == "packing":
        return len(radii) * parameters.packing.equilibration_steps
    if stage == "expansion":
        growing = growth.growth_nodes * float(radii.sum() / radii.min()) if len(radii) else 0.0
        return growing * (growth.ramp_steps + growth.relaxation_steps)
    if parameters.time_stepping.integrator == "imex_rkc2":
        evaluations *= IMPLICIT_WORK
    if parameters.hydrodynamics.mobility == "ewald":
        return math.pow(nodes(parameters), NODE_GROWTH) * evaluations
    return math.pow(mesh_points(parameters), MESH_GROWTH) * evaluations


def stored(stage: str, parameters: Parameters) -> float:
    """Return about how many numbers the dataset of a stage holds."""
    if stage == "packing":
        return 4.0 * len(particle_radii(parameters))
    if stage == "expansion":
        return 2.0 * membrane_nodes(parameters)
    if stage == "ageing":
        return 2.0 * nodes(parameters)
    recording, channel = parameters.recording, parameters.channel
    stepping = parameters.time_stepping
    records = float(_records(parameters)[1].sum())
    heights = channel.height * parameters.hydrodynamics.resolution / 2
    profiles = stepping.shear_time / max(recording.profile_interval, stepping.step)
    spacing = recording.field_spacing * parameters.suspension.mean_radius
    field = channel.length * channel.height / spacing**2
    snapshots = len(recording.snapshots) * 2 * (nodes(parameters) + field)
    return 16 * records + profiles * heights + snapshots


Pieces = tuple[FloatArray, FloatArray]
"""Lengths of intervals and how many there are of each, both of shape (lengths,)."""


@lru_cache(maxsize=256)
def _intervals(end: float, per_decade: int, longest: float, step: float) -> Pieces:
    """Return the lengths of the records of a stage, which grow with time up to the longest."""
    steps, most = round(end / step), max(round(longest / step), 1)
    widths, place, growth = list[int](), 0, 10 ** (1 / per_decade)
    # As `simulation.record.interval_edges`, which would load the whole solver.
    while place < steps and (width := max(math.ceil(place * growth) - place, 1)) < most:
        widths.append(min(width, steps - place))
        place += widths[-1]
    # From there on records end at multiples of the longest.
    if place < steps:
        widths.append(min((place // most + 1) * most, steps) - place)
        place += widths[-1]
    rest = (steps - place) / most
    return step * np.array([*widths, most]), np.array([1.0] * len(widths) + [rest])


def _records(parameters: Parameters) -> Pieces:
    recording, stepping = parameters.recording, parameters.time_stepping
    return _intervals(
        stepping.shear_time,
        recording.samples_per_decade,
        recording.longest_interval,
        stepping.step,
    )


def evaluations(stage: str, parameters: Parameters) -> float:
    """Return the number of evaluations of the equations of motion, 0 where there are none."""
    stepping, flow = parameters.time_stepping, parameters.hydrodynamics
    duration = {"ageing": stepping.ageing_time, "shear": stepping.shear_time}.get(stage, 0.0)
    if not duration:
        return 0.0
    if stepping.integrator == "euler":
        return duration / stepping.step
    unit = parameters.solvent.viscosity / parameters.membrane.elastic_constant
    lengths, counts = _records(parameters)
    if stage == "ageing":
        lengths, counts = np.array([duration]), np.ones(1)
    if stepping.integrator == "imex_rkc2":
        stress = IMPLICIT_AGEING if stage == "ageing" else _stress(stage, parameters)
        tolerated = _tolerated(IMPLICIT_STEP_LAW, stress, stepping.tolerance)
        step = min(unit * tolerated, stepping.longest_step)
        steps = np.ceil(lengths / step)
        stages = np.sqrt(1 + REMAINDER * np.sqrt(lengths / steps / unit))
        each = np.maximum(stages, IMPLICIT_STAGES) + BESIDE_STAGES
        return float(counts * steps @ each) + IMPLICIT_START
    tolerated = _tolerated(STEP_LAW, _stress(stage, parameters), stepping.tolerance)
    step = min(unit * tolerated, stepping.longest_step)
    factor, *powers = RADIUS_LAW
    spacing = flow.node_spacing / flow.resolution
    epsilon = (flow.regularisation or GRID_REGULARISATION) / flow.resolution
    radius = factor * spacing ** powers[0] * epsilon ** powers[1] / unit
    stages = np.sqrt(1 + np.minimum(lengths, step) * radius / STABLE_STEP)
    steps = counts * np.maximum(lengths / step, 1.0)
    return float(steps @ np.maximum(stages, FEWEST_STAGES)) + START_STEPS * FEWEST_STAGES


def _tolerated(law: tuple[float, float, float], stress: float, tolerance: float) -> float:
    """Return the step that a tolerance allows at a stress by a law [η / K_e]."""
    factor, of_tolerance, of_stress = law
    return float(factor * tolerance**of_tolerance * stress**of_stress)


def _stress(stage: str, parameters: Parameters) -> float:
    """Return the stress of a stage over the membrane modulus, no less than `LEAST_STRESS`."""
    if stage == "ageing":
        return LEAST_STRESS
    imposed = parameters.rheometer.stress
    if imposed is None:
        return USUAL_STRESS
    return max(imposed / parameters.membrane.elastic_constant, LEAST_STRESS)
