"""What a stage of a run costs: processor time and disk, estimated from runs that were measured.

The estimates are those of a model whose constants are fitted to a table of measured runs
(``costs.json``, which `operations.calibration` makes), corrected by the finished runs of the
scenario itself where there are any. For a stage the model is

    packing         t = t₀ + c · discs · steps
    expansion       t = t₀ + c · growth nodes · steps
    ageing, shear   t = t₀ + c · nodes^1.05 · E     (Ewald sum)
                    t = t₀ + c · points^1.3 · E     (mesh)

with E evaluations of the equations of motion. Euler takes one a step. A step Δt of rkc2 takes
√(1 + Δt ρ / 0.65) of them: ρ is the spectral radius, which grows as nodes come closer and the
regularisation shorter, and Δt the shortest of the time to the next record, the longest step, and
the step that the tolerance allows at that stress. ρ and the latter are power laws. Some steps more
are taken at the start, where films settle and steps are short.
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.solver.geometry import FloatArray

TABLE = "costs.json"
"""File of the package with the measured runs."""

STABLE_STEP = 0.65
"""Δt ρ / s² of s stages of rkc2 at the edge of stability (Sommeijer, Shampine & Verwer 1998)."""

FEWEST_STAGES = 3.0
"""Evaluations of a step of rkc2 at least."""

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

LEAST_STARTS = 2.0
"""Steps over those at the start from which on they tell of something else."""

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


def discs(parameters: Parameters) -> int:
    """Return the number of particles."""
    return len(particle_radii(parameters))


@cache
def _contours(parameters: Parameters) -> tuple[float, float]:
    """Return the lengths of all membranes as circles, and of both walls [length unit]."""
    membranes = 2 * math.pi * float(particle_radii(parameters).sum())
    return membranes, 2 * wall_contour(parameters).arc_length


def membrane_nodes(parameters: Parameters) -> float:
    """Return the number of nodes of all membranes, to a per cent."""
    hydrodynamics = parameters.hydrodynamics
    return _contours(parameters)[0] * hydrodynamics.resolution / hydrodynamics.node_spacing


def nodes(parameters: Parameters) -> float:
    """Return the number of nodes of membranes and walls, to a per cent."""
    hydrodynamics = parameters.hydrodynamics
    return sum(_contours(parameters)) * hydrodynamics.resolution / hydrodynamics.node_spacing


def growth_nodes(parameters: Parameters) -> float:
    """Return the number of nodes with which all particles grow, to a per cent."""
    radii = particle_radii(parameters)
    return parameters.expansion.growth_nodes * float(radii.sum() / radii.min()) if len(radii) else 0


def mesh_points(parameters: Parameters) -> float:
    """Return the number of points of the mesh of 'grid'."""
    channel = parameters.channel
    area = channel.length * (channel.height + channel.outer_gap)
    return area * parameters.hydrodynamics.resolution**2


def load(stage: str, parameters: Parameters, evaluations: float) -> float:
    """Return what the time of a stage is proportional to, beyond what it takes to start."""
    if stage == "packing":
        return discs(parameters) * parameters.packing.equilibration_steps
    if stage == "expansion":
        growth = parameters.expansion
        return growth_nodes(parameters) * (growth.ramp_steps + growth.relaxation_steps)
    if parameters.hydrodynamics.mobility == "grid":
        return math.pow(mesh_points(parameters), MESH_GROWTH) * evaluations
    return math.pow(nodes(parameters), NODE_GROWTH) * evaluations


def duration(stage: str, parameters: Parameters) -> float:
    """Return the simulated time of ageing or shear [time unit]."""
    stepping = parameters.time_stepping
    return stepping.ageing_time if stage == "ageing" else stepping.shear_time


def stored(stage: str, parameters: Parameters) -> float:
    """Return about how many numbers the dataset of a stage holds."""
    if stage == "packing":
        return 4.0 * discs(parameters)
    if stage in ("expansion", "ageing"):
        return 2.0 * (membrane_nodes if stage == "expansion" else nodes)(parameters)
    recording, channel = parameters.recording, parameters.channel
    stepping = parameters.time_stepping
    records = float(_records(parameters)[1].sum())
    heights = channel.height * parameters.hydrodynamics.resolution / 2
    profiles = min(recording.profiles, stepping.shear_time / stepping.step)
    spacing = recording.field_spacing * parameters.suspension.mean_radius
    field = channel.length * channel.height / spacing**2
    kept = len(recording.snapshots) * 2 * (nodes(parameters) + field)
    return 16 * records + profiles * heights + kept


Pieces = tuple[FloatArray, FloatArray]
"""Lengths of intervals and how many there are of each, both of shape (lengths,)."""


@lru_cache(maxsize=256)
def _intervals(end: float, per_decade: int, longest: float, step: float) -> Pieces:
    """Return the lengths of the records of a stage, which grow with time up to the longest."""
    steps, most = round(end / step), max(round(longest / step), 1)
    widths, place, growth = list[int](), 0, 10 ** (1 / per_decade)
    # As `simulation.record.interval_edges`, which this may not wait for.
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


@dataclass(frozen=True)
class _Steps:
    """What the steps of rkc2 follow from, in units of the membranes' time η / K_e.

    Attributes
    ----------
    lengths, counts
        Of the intervals whose ends are ends of steps, shape (lengths,).
    cap
        Longest step, whatever the tolerance.
    """

    lengths: FloatArray
    counts: FloatArray
    cap: float

    @classmethod
    def of(cls, stage: str, parameters: Parameters) -> "_Steps":
        stepping, unit = parameters.time_stepping, _time_unit(parameters)
        whole = np.array([stepping.ageing_time]), np.ones(1)
        lengths, counts = whole if stage == "ageing" else _records(parameters)
        return cls(lengths / unit, counts, stepping.longest_step / unit)

    def number(self, tolerated: float) -> float:
        """Return the number of steps, of which the tolerance allows some length."""
        return float(self.counts @ np.maximum(self.lengths / min(tolerated, self.cap), 1.0))

    def evaluations(self, tolerated: float, radius: float) -> float:
        """Return the number of evaluations at a spectral radius."""
        longest = min(tolerated, self.cap)
        stages = np.sqrt(1 + np.minimum(self.lengths, longest) * radius / STABLE_STEP)
        steps = self.counts * np.maximum(self.lengths / longest, 1.0)
        return float(steps @ np.maximum(stages, FEWEST_STAGES))


def _time_unit(parameters: Parameters) -> float:
    """Return the time in which membranes relax, η / K_e [time unit]."""
    return parameters.solvent.viscosity / parameters.membrane.elastic_constant


def _stress(stage: str, parameters: Parameters) -> float:
    """Return the stress of a stage over the membrane modulus, no less than `LEAST_STRESS`."""
    if stage == "ageing":
        return LEAST_STRESS
    imposed = parameters.rheometer.stress
    if imposed is None:
        return USUAL_STRESS
    return max(imposed / parameters.membrane.elastic_constant, LEAST_STRESS)


Features = Callable[[str, Parameters], tuple[float, ...]]
"""What a power law is of."""


def _of_step(stage: str, parameters: Parameters) -> tuple[float, ...]:
    return parameters.time_stepping.tolerance, _stress(stage, parameters)


def _of_radius(stage: str, parameters: Parameters) -> tuple[float, ...]:
    hydrodynamics = parameters.hydrodynamics
    spacing = hydrodynamics.node_spacing / hydrodynamics.resolution
    epsilon = (hydrodynamics.regularisation or GRID_REGULARISATION) / hydrodynamics.resolution
    return spacing, epsilon


@dataclass(frozen=True)
class _PowerLaw:
    """exp(constant) times powers of features, fitted to the logarithms by least squares."""

    features: Features
    coefficients: tuple[float, ...]

    @classmethod
    def fitted(cls, features: Features, points: Sequence[tuple[Measured, float]]) -> "_PowerLaw":
        rows = [[1.0, *np.log(features(run.stage, run.parameters))] for run, _ in points]
        values = np.log([value for _, value in points])
        solution, *_ = np.linalg.lstsq(np.array(rows), values, rcond=None)
        return cls(features, tuple(solution.tolist()))

    def __call__(self, stage: str, parameters: Parameters) -> float:
        terms = (1.0, *map(math.log, self.features(stage, parameters)))
        return math.exp(math.fsum(c * x for c, x in zip(self.coefficients, terms, strict=True)))


@dataclass(frozen=True)
class _Line:
    """start + slope · load, fitted so that relative errors are least; neither is negative."""

    start: float
    slope: float

    @classmethod
    def fitted(cls, points: Sequence[tuple[float, float]]) -> "_Line":
        loads, values = np.array(points).T
        columns = np.column_stack((1 / values, loads / values))
        ones = np.ones(len(values))
        start, slope = np.linalg.lstsq(columns, ones, rcond=None)[0].tolist()
        if start < 0:
            start, slope = 0.0, float(columns[:, 1].sum() / (columns[:, 1] ** 2).sum())
        if slope < 0:
            start, slope = float(columns[:, 0].sum() / (columns[:, 0] ** 2).sum()), 0.0
        return cls(start, slope)

    def __call__(self, load: float) -> float:
        return self.start + self.slope * load


def _solver(run: Measured) -> str:
    return _kind(run.stage, run.parameters)


def _kind(stage: str, parameters: Parameters) -> str:
    """Return what shares a cost: ageing and shear do, but not the two mobilities."""
    return stage if stage in ("packing", "expansion") else parameters.hydrodynamics.mobility


def _bisected(function: Callable[[float], float], wanted: float, low: float, high: float) -> float:
    """Return where a monotonic function of a positive number takes a value, or the nearer end."""
    rising = function(high) > function(low)
    for _ in range(60):
        middle = math.sqrt(low * high)
        if (function(middle) < wanted) == rising:
            low = middle
        else:
            high = middle
    return math.sqrt(low * high)


class Costs:
    """Estimates from measured runs.

    Parameters
    ----------
    table
        Runs of every stage, with their steps and evaluations; both mobilities among them.

    Attributes
    ----------
    factors
        By stage, the factor by which estimates of the table's own runs are off, upwards or
        downwards, `SURE` standard deviations.
    """

    def __init__(self, table: Sequence[Measured]) -> None:
        self._start, self._step, self._radius = _fitted_steps(table)
        kinds: dict[str, list[tuple[float, float]]] = {}
        sizes: dict[str, list[tuple[float, float]]] = {}
        for run in table:
            point = load(run.stage, run.parameters, run.evaluations), run.core_seconds
            kinds.setdefault(_solver(run), []).append(point)
            sizes.setdefault(run.stage, []).append((stored(run.stage, run.parameters), run.size))
        self._times = {kind: _Line.fitted(points) for kind, points in kinds.items()}
        self._sizes = {stage: _Line.fitted(points) for stage, points in sizes.items()}
        self.factors = {stage: self._scatter(table, stage) for stage in sizes}

    def estimate(self, stage: str, parameters: Parameters) -> Estimate:
        """Return what a stage of a run takes by the table alone."""
        work = load(stage, parameters, self.evaluations(stage, parameters))
        return Estimate(
            self._times[_kind(stage, parameters)](work),
            self._sizes[stage](stored(stage, parameters)),
        )

    def evaluations(self, stage: str, parameters: Parameters) -> float:
        """Return the number of evaluations of the equations of motion, 0 where there are none."""
        if stage in ("packing", "expansion"):
            return 0.0
        stepping = parameters.time_stepping
        if stepping.integrator == "euler":
            return duration(stage, parameters) / stepping.step
        if not duration(stage, parameters):
            return 0.0
        tolerated, radius = self._step(stage, parameters), self._radius(stage, parameters)
        regular = _Steps.of(stage, parameters).evaluations(tolerated, radius)
        return regular + self._start * FEWEST_STAGES

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


def _fitted_steps(table: Sequence[Measured]) -> tuple[float, _PowerLaw, _PowerLaw]:
    """Return the steps at the start, and the laws of the tolerated step and spectral radius."""
    looped = [
        (run, _Steps.of(run.stage, run.parameters))
        for run in table
        if run.steps and run.parameters.time_stepping.integrator == "rkc2"
    ]
    # At rest nothing but the start asks for steps below the longest.
    resting = [(run, steps) for run, steps in looped if run.stage == "ageing"]
    extra = [run.steps - steps.number(steps.cap) for run, steps in resting]
    start = max(float(np.median(extra)), 0.0)
    lengths, radii = [], []
    for run, steps in looped:
        tolerated = _bisected(steps.number, run.steps - start, 1e-6, 1e6)
        # Where records or the longest step set the pace, nothing is learned of the tolerance.
        excess = run.steps - start - steps.number(steps.cap)
        if run.stage == "shear" and excess > LEAST_STARTS * start:
            lengths.append((run, tolerated))
        # Runs that are all start say nothing of what comes after.
        if run.steps > LEAST_STARTS * start:
            evaluations = partial(steps.evaluations, tolerated)
            regular = run.evaluations - start * FEWEST_STAGES
            radii.append((run, _bisected(evaluations, regular, 1e-3, 1e9)))
    return start, _PowerLaw.fitted(_of_step, lengths), _PowerLaw.fitted(_of_radius, radii)


def read_table(path: Path) -> list[Measured]:
    """Return the runs of a table of measured costs.

    Parameters
    ----------
    path
        What `operations.calibration.calibrate` has written.
    """
    words: Mapping[str, Any] = json.loads(path.read_text())
    return [
        Measured(stage, parameters, **measured)
        for run in words["runs"]
        for parameters in [Parameters.from_mapping(run["settings"])]
        for stage, measured in run["stages"].items()
    ]


@cache
def shipped() -> Costs:
    """Return the estimates from the table that comes with the package."""
    return Costs(read_table(Path(__file__).with_name(TABLE)))
