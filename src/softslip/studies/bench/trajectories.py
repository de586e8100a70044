"""A level of fidelity and the paper's mesh from one aged state, and how far their flows part."""

import math
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation import trajectory
from softslip.solver.geometry import FloatArray
from softslip.studies import boxes, scenes
from softslip.studies.interval_means import QUANTITIES, IntervalMeans
from softslip.studies.membrane_nodes import renoded
from softslip.studies.timing import Tell, silent

RUNS = ("fidelity", "grid", "second_seed")
"""The level, the mesh from the same aged state, and the level from another packing."""

SEEDS = (1, 2)
"""Seeds of the two packings: the first is sheared in both schemes."""

AGEING = 50.0
"""Time at rest before the stress [time unit]."""

INTERVAL = 0.25
"""Time that a record is the mean of [time unit]."""

SETTLED = 1.0
"""Time from which series are compared: before it both still answer to the step in stress, in the
same way whatever the packing [time unit]."""

MARGIN = 5.0
"""Distance from the walls where the bulk begins, that of the paper [mean radius]."""

ASPECT, SIDE = 2.4, 1 / 128
"""H/L_x, which leaves a bulk in a box of few particles, and what L_x is a multiple of."""

SHORTEST = 1 / 16
"""Shortest period along the flow [length unit]: three diameters of the larger particles."""

Watch = Callable[[str], AbstractContextManager[trajectory.Progress]]
"""Called with the name of a run; gives what shows how far it has come."""


def unwatched(_: str) -> AbstractContextManager[trajectory.Progress]:
    """Show nothing of a run."""
    return nullcontext(lambda *_: None)


def bench_trajectory(
    particles: int = 44,
    stress: float = 0.5,
    duration: float = 20.0,
    fidelity: str = "paper",
    *,
    ageing: float = AGEING,
    tell: Tell = silent,
    watch: Watch = unwatched,
) -> dict[str, Any]:
    """Shear one aged packing at a level and on the mesh at dx = 1/8192, and a second at the level.

    The mesh run has the paper's nodes, plain sums and Euler steps of 0.002, in the level's box
    with its small outer gap and still solvent outside. It starts from the membranes that the
    level has aged, moved to its own nodes. What two packings of the same kind differ by is the
    measure of what the schemes may differ by.

    Parameters
    ----------
    particles
        N; the box has H/L_x near `ASPECT`.
    stress
        Imposed stress [stress unit].
    duration
        Time under stress [time unit], longer than `SETTLED`.
    fidelity
        The level.
    ageing
        Time at rest before it [time unit].
    watch
        Shows the progress of each run.

    Returns
    -------
    dict
        ``time``, the ends of the records' intervals; in ``series`` each of `QUANTITIES` for each
        of `RUNS`, as means over the intervals; for each quantity ``grid_difference`` and
        ``seed_difference``, the rms difference from the first run over that run's rms value, from
        `SETTLED` on, and their ``difference_ratio``; ``cost`` of each run.

    Raises
    ------
    SoftslipError
        When there is no such scene, it has no bulk, or a run fails.
    """
    count = math.floor(duration / INTERVAL * (1 + 1e-12))
    edges: FloatArray = INTERVAL * np.arange(count + 1, dtype=np.float64)
    starts = _starts(particles, stress, fidelity, ageing, tell)
    series, cost = {}, {}
    for name, scene in starts.items():
        tell(f"shearing {particles} particles for {edges[-1]:g} time units: {name}")
        with watch(name) as report:
            series[name], cost[name] = recorded(scene, edges, report)
    settled = edges[1:] > SETTLED
    differences = {
        key: _differences({name: series[name][key][settled] for name in RUNS}) for key in QUANTITIES
    }
    return {
        "bench": "trajectory",
        "particles": particles,
        "fidelity": fidelity,
        "stress": stress,
        "duration": float(edges[-1]),
        "time": edges[1:].tolist(),
        "series": {key: {name: series[name][key].tolist() for name in RUNS} for key in QUANTITIES},
        **{
            kind: {key: differences[key][kind] for key in QUANTITIES}
            for kind in ("grid_difference", "seed_difference", "difference_ratio")
        },
        "cost": cost,
    }


def parameters_of(
    particles: int, fidelity: str | None, stress: float, *, seed: int = SEEDS[0], **groups: Any
) -> Parameters:
    """Return the parameters of a narrow, high box with a bulk; None is the paper's scheme."""
    wide, low = boxes.channel_sides(particles)
    length = max(round(math.sqrt(wide * low / ASPECT) / SIDE) * SIDE, SHORTEST)
    height = wide * low / length
    sides = {"length": length, "height": height, "outer_gap": boxes.outer_gap(height)}
    return boxes.parameters_of(
        particles,
        fidelity,
        seed=seed,
        channel=sides,
        rheometer={"stress": stress},
        recording={"bulk_margin": MARGIN},
        **groups,
    )


def _starts(
    particles: int, stress: float, fidelity: str, ageing: float, tell: Tell
) -> dict[str, scenes.Scene]:
    """Return the scene that each run starts from."""
    aged = {}
    for seed in SEEDS:
        tell(f"ageing {particles} particles of seed {seed} for {ageing:g} time units")
        timing = {"ageing_time": ageing}
        given = parameters_of(particles, fidelity, stress, seed=seed, time_stepping=timing)
        aged[seed] = scenes.aged_packing(given)
    level, mesh = (parameters_of(particles, each, stress) for each in (fidelity, None))
    first, second = (_scene(aged[seed], level) for seed in SEEDS)
    return {
        "fidelity": first,
        "grid": _scene(aged[SEEDS[0]], mesh),
        "second_seed": second,
    }


def _scene(aged: xr.Dataset, parameters: Parameters) -> scenes.Scene:
    membranes = renoded(aged, parameters)
    return scenes.scene_of(membranes, parameters, aged["wall_displacement"].values)


def recorded(
    scene: scenes.Scene, edges: FloatArray, report: trajectory.Progress
) -> tuple[dict[str, FloatArray], float]:
    """Advance a scene; return interval means and core-seconds per time unit.

    Parameters
    ----------
    scene
        Where to start, at the first edge.
    edges
        Times between which means are taken, shape (records + 1,) [time unit].
    report
        Shown the progress.
    """
    series = IntervalMeans(scene.parameters, scene.layout)
    core = time.process_time()
    done = scenes.advance_to(scene, edges[1:], series.visit, report)
    core = time.process_time() - core
    series.sample(done.state, done.evaluation)
    return series.means(edges), core / float(edges[-1] - edges[0])


def _differences(values: dict[str, FloatArray]) -> dict[str, float]:
    """Return how far the other runs are from the first, relative to its rms value."""
    first = values["fidelity"]
    apart = {name: root_mean_square(values[name] - first) for name in ("grid", "second_seed")}
    return {
        "grid_difference": apart["grid"] / root_mean_square(first),
        "seed_difference": apart["second_seed"] / root_mean_square(first),
        "difference_ratio": apart["grid"] / apart["second_seed"],
    }


def root_mean_square(values: FloatArray | Sequence[float]) -> float:
    """Return the root of the mean square."""
    return math.sqrt(float(np.mean(np.square(values))))
