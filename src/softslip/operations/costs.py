"""What a stage of a run costs: processor time and disk, estimated from measured runs.

For each stage the time is a line, fitted to a table of measured runs (``costs.json``, which
`operations.calibration` writes), and corrected by the finished runs of the scenario itself:

    packing         t = t₀ + c · discs · steps
    expansion       t = t₀ + c · growth nodes · steps
    ageing, shear   t = t₀ + c · nodes^1.05 · E     (Ewald sum)
                    t = t₀ + c · points^1.3 · E     (mesh)

with E evaluations of the equations of motion. Euler takes one a step. A step Δt of rkc2 takes
√(1 + Δt ρ / 0.65) of them: ρ is the spectral radius, which grows as nodes come closer and the
regularisation shorter, and Δt the shortest of the time to the next record, the longest step, and
the step that the tolerance allows at that stress. ρ and the latter are power laws; they do not
depend on the machine, and their constants were fitted once to the runs of the table.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.solver.geometry import FloatArray

TABLE = Path(__file__).with_name("costs.json")
"""The measured runs that come with the package."""

STABLE_STEP = 0.65
"""Δt ρ / s² of s stages of rkc2 at the edge of stability (Sommeijer, Shampine & Verwer 1998)."""

FEWEST_STAGES = 3.0
"""Evaluations of a step of rkc2 at least."""

START_STEPS = 9.5
"""Additional steps at the start, where films settle and steps are short."""

STEP_LAW = (1.055, 0.29, -0.42)
"""Step that the tolerance allows [η / K_e]: factor, and powers of the tolerance and the stress."""

RADIUS_LAW = (0.056, -0.714, -0.42)
"""Spectral radius [K_e / η]: factor, and powers of node spacing and regularisation length."""

GRID_REGULARISATION = 0.78
"""Regularisation length of the mesh of 'grid' over its mesh size."""

NODE_GROWTH, MESH_GROWTH = 1.05, 1.3
"""Powers of the number of nodes or mesh points as which the time of an evaluation grows, by the
benchmarks of 50 to 800 particles: meshes outgrow the processor's caches."""

LEAST_STRESS, USUAL_STRESS = 0.02, 0.3
"""Stress over the membrane modulus below which steps grow no longer, and the one that is assumed
where a shear rate is imposed."""

SURE = 2.0
"""Standard deviations of the logarithm that the stated factor of uncertainty spans."""

LINE_CONSTANTS, FLOW_CONSTANTS = 2, 11
"""Constants fitted for a preparing stage, and for ageing and shear together: two lines, two power
laws of two features, and the steps at the start."""

FEWEST_RUNS = 3
"""Finished runs of the scenario from which on the scatter is theirs, not that of the table."""


@dataclass(frozen=True)
class Measured:
    """What a stage of a run took.

    Attributes
    ----------
    stage, parameters
        What was run.
    core_seconds, size
        Processor time [s] and bytes of its dataset.
    steps, evaluations
        Of its time loop; 0 where it has none.
    """

    stage: str
    parameters: Parameters
    core_seconds: float
    size: int
    steps: int = 0
    evaluations: int = 0


@dataclass(frozen=True)
class Estimate:
    """What a stage of a run will take.

    Attributes
    ----------
    core_seconds, size
        Processor time [s] and bytes of its dataset.
    """

    core_seconds: float
    size: float

    def corrected(self, correction: "Correction") -> "Estimate":
        """Return the estimate in the light of finished runs."""
        return Estimate(self.core_seconds * correction.core_seconds, self.size * correction.size)


@dataclass(frozen=True)
class Correction:
    """How finished runs of a stage compare with the model.

    Attributes
    ----------
    runs
        How many there are.
    core_seconds, size
        Geometric mean of measured over estimated.
    factor
        Of uncertainty of the estimated time of one run, upwards and downwards.
    """

    runs: int
    core_seconds: float
    size: float
    factor: float


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


def load(stage: str, parameters: Parameters, evaluations: float) -> float:
    """Return what the time of a stage is proportional to, beyond what it takes to start."""
    radii, growth = particle_radii(parameters), parameters.expansion
    if stage == "packing":
        return len(radii) * parameters.packing.equilibration_steps
    if stage == "expansion":
        growing = growth.growth_nodes * float(radii.sum() / radii.min()) if len(radii) else 0.0
        return growing * (growth.ramp_steps + growth.relaxation_steps)
    if parameters.hydrodynamics.mobility == "ewald":
        return math.pow(nodes(parameters), NODE_GROWTH) * evaluations
    channel, resolution = parameters.channel, parameters.hydrodynamics.resolution
    points = channel.length * (channel.height + channel.outer_gap) * resolution**2
    return math.pow(points, MESH_GROWTH) * evaluations


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
    profiles = min(recording.profiles, stepping.shear_time / stepping.step)
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
    factor, *powers = STEP_LAW
    tolerated = factor * stepping.tolerance ** powers[0] * _stress(stage, parameters) ** powers[1]
    step = min(unit * tolerated, stepping.longest_step)
    factor, *powers = RADIUS_LAW
    spacing = flow.node_spacing / flow.resolution
    epsilon = (flow.regularisation or GRID_REGULARISATION) / flow.resolution
    radius = factor * spacing ** powers[0] * epsilon ** powers[1] / unit
    stages = np.sqrt(1 + np.minimum(lengths, step) * radius / STABLE_STEP)
    steps = counts * np.maximum(lengths / step, 1.0)
    return float(steps @ np.maximum(stages, FEWEST_STAGES)) + START_STEPS * FEWEST_STAGES


def _stress(stage: str, parameters: Parameters) -> float:
    """Return the stress of a stage over the membrane modulus, no less than `LEAST_STRESS`."""
    if stage == "ageing":
        return LEAST_STRESS
    imposed = parameters.rheometer.stress
    if imposed is None:
        return USUAL_STRESS
    return max(imposed / parameters.membrane.elastic_constant, LEAST_STRESS)


Line = tuple[float, float]
"""Start and slope."""


def fitted_line(points: Sequence[tuple[float, float]]) -> Line:
    """Return start and slope of the line with the least relative errors, neither negative.

    Parameters
    ----------
    points
        Loads and values.
    """
    loads, values = np.array(points).T
    columns = np.column_stack((1 / values, loads / values))
    line = np.linalg.lstsq(columns, np.ones(len(values)), rcond=None)[0]
    if line.min() < 0:
        other = int(line.argmax())
        line = np.zeros(2)
        line[other] = columns[:, other].sum() / (columns[:, other] ** 2).sum()
    return float(line[0]), float(line[1])


def _cost_of(stage: str, parameters: Parameters) -> str:
    """Return what shares a line: ageing and shear do, but not the two mobilities."""
    return stage if stage in ("packing", "expansion") else parameters.hydrodynamics.mobility


class Costs:
    """Estimates from measured runs.

    Parameters
    ----------
    table
        Runs of every stage, with their evaluations; both mobilities among them.

    Attributes
    ----------
    factors
        By stage, the factor by which estimates of the table's own runs are off, upwards or
        downwards, `SURE` standard deviations.
    """

    def __init__(self, table: Sequence[Measured]) -> None:
        times: dict[str, list[tuple[float, float]]] = {}
        sizes: dict[str, list[tuple[float, float]]] = {}
        for run in table:
            stage, parameters = run.stage, run.parameters
            work = load(stage, parameters, run.evaluations)
            times.setdefault(_cost_of(stage, parameters), []).append((work, run.core_seconds))
            sizes.setdefault(stage, []).append((stored(stage, parameters), run.size))
        self._times = {name: fitted_line(points) for name, points in times.items()}
        self._sizes = {stage: fitted_line(points) for stage, points in sizes.items()}
        self.factors = {stage: self._scatter(table, stage) for stage in sizes}

    def estimate(self, stage: str, parameters: Parameters) -> Estimate:
        """Return what a stage of a run takes by the table alone."""
        start, slope = self._times[_cost_of(stage, parameters)]
        work = load(stage, parameters, evaluations(stage, parameters))
        least, each = self._sizes[stage]
        return Estimate(start + slope * work, least + each * stored(stage, parameters))

    def correction(self, stage: str, finished: Iterable[Measured]) -> Correction:
        """Return how finished runs of a stage, if any, compare with the estimates."""
        times, sizes = [], []
        for run in finished:
            estimate = self.estimate(stage, run.parameters)
            times.append(math.log(run.core_seconds / estimate.core_seconds))
            sizes.append(math.log(run.size / estimate.size))
        if not times:
            return Correction(0, 1.0, 1.0, self.factors[stage])
        factor = self.factors[stage]
        if len(times) >= FEWEST_RUNS:
            # The mean of a few is uncertain too.
            spread = float(np.std(times, ddof=1)) * math.sqrt(1 + 1 / len(times))
            factor = math.exp(SURE * spread)
        mean_time, mean_size = float(np.mean(times)), float(np.mean(sizes))
        return Correction(len(times), math.exp(mean_time), math.exp(mean_size), factor)

    def _scatter(self, table: Sequence[Measured], stage: str) -> float:
        errors = [
            math.log(run.core_seconds / self.estimate(stage, run.parameters).core_seconds)
            for run in table
            if run.stage == stage
        ]
        preparing = stage in ("packing", "expansion")
        rows = len(errors) if preparing else sum(run.evaluations > 0 for run in table)
        # What was fitted to these very runs is closer to them than to others.
        unseen = rows / max(rows - (LINE_CONSTANTS if preparing else FLOW_CONSTANTS), 1)
        mean_square = sum(error**2 for error in errors) / len(errors)
        return math.exp(SURE * math.sqrt(mean_square * unseen))


def read_table(path: Path) -> list[Measured]:
    """Return the runs of a table of measured costs.

    Parameters
    ----------
    path
        As `operations.calibration.calibrate` writes it.
    """
    table: Mapping[str, Any] = json.loads(path.read_text())
    return [
        Measured(stage, parameters, **measured)
        for run in table["runs"]
        for parameters in [Parameters.from_mapping(run["settings"])]
        for stage, measured in run["stages"].items()
    ]


@cache
def shipped() -> Costs:
    """Return the estimates from the table that comes with the package."""
    return Costs(read_table(TABLE))
