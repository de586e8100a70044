"""The paper's scheme and a level of fidelity side by side: core-seconds per simulated time."""

import math
from dataclasses import replace
from typing import Any

import xarray as xr

from softslip.config.parameters import Parameters
from softslip.studies import boxes, scenes
from softslip.studies.bench.memory import memory_of_evaluation
from softslip.studies.membrane_nodes import renoded
from softslip.studies.timing import Tell, silent

FEWEST_STEPS = 5
"""Steps of the paper's scheme at least: the first few are still settling."""

LEVEL_TIME = 20.0
"""Time over which the level's cost is taken: many of its long steps [time unit]."""


def paper_scheme(particles: int, gap: float = boxes.PAPER_GAP) -> Parameters:
    """Return the numerical scheme of the paper: mesh, plain sums, Euler steps, its periodic box.

    Parameters
    ----------
    particles
        N.
    gap
        Wanted solvent outside the walls, which is rounded [length unit].
    """
    _, height = boxes.channel_sides(particles)
    return boxes.parameters_of(
        particles,
        gap=boxes.nearest_gap(height, gap),
        channel={"outside": "periodic"},
    )


def bench_run(
    particles: int,
    fidelity: str = "paper",
    *,
    ageing: float = scenes.AGEING,
    shearing: float = scenes.SHEARING,
    gap: float = boxes.PAPER_GAP,
    budget: float = 60.0,
    level_time: float = LEVEL_TIME,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Compare what a simulated time unit costs, from one sheared state.

    Both schemes start from the state that the level has reached, at the same stress, through the
    loop of the shear stage with all its guards. The paper's scheme gets the same membranes on its
    own nodes, tethers that hold its walls rigid, and steps for as long as the budget lasts. The
    rates are means over just that stretch in both. The level's steps are longer than all of it,
    so its cost is taken over a stretch of its own.

    Parameters
    ----------
    particles
        N.
    fidelity
        The level.
    ageing, shearing
        Times at rest and under stress before both start [time unit].
    gap
        Solvent outside the walls of the paper's scheme [length unit]; see `paper_scheme`.
    budget
        Time for the steps of the paper's scheme [s]; `FEWEST_STEPS` are taken anyway.
    level_time
        Time over which the level's cost is taken [time unit].

    Returns
    -------
    dict
        ``ratio`` of the core-seconds per time unit; for ``paper`` and ``level`` each
        ``core_seconds`` and ``clock_seconds`` per time unit, ``steps`` and ``evaluations`` per time
        unit, the ``duration`` that they were taken over, ``nodes``, and ``peak_memory`` of a
        process that evaluates its equations of motion; ``memory_ratio`` of these; ``stretch``,
        the time over which both ``shear_rate_wall`` are means, and their ``rate_difference``,
        relative.

    Raises
    ------
    SoftslipError
        When there is no such scene, or a scheme fails on it.
    """
    tell(f"making {particles} aged and sheared particles at fidelity {fidelity}")
    level, _ = scenes.flowing(particles, fidelity, ageing, shearing)
    tell("moving them to the nodes of the paper's scheme")
    paper = on_paper_nodes(level, gap)
    step = paper.parameters.time_stepping.step
    tell("timing one step of the paper's scheme")
    first = scenes.advance(paper, step)
    # The check of the step against the stability limit costs some evaluations, but only at the
    # start and then every few hundred steps: the state remembers that it was made.
    paper = replace(paper, state=first.state)
    level = replace(level, state=scenes.advance(level, step).state)
    count = max(FEWEST_STEPS, math.floor(budget / first.seconds))
    tell(f"taking {count} steps of the paper's scheme")
    slow = scenes.advance(paper, count * step)
    tell(f"advancing the same state at fidelity {fidelity}")
    together = scenes.advance(level, slow.duration)
    fast = scenes.advance(level, level_time)
    tell("measuring the peak memory of both in processes of their own")
    membranes = scenes.membranes_of(level)
    rates = {"paper": slow.shear_rate_wall, "level": together.shear_rate_wall}
    costs = {
        "paper": _cost(slow, paper, membranes),
        "level": _cost(fast, level, membranes),
    }
    return {
        "bench": "run",
        "particles": particles,
        "fidelity": fidelity,
        "ratio": costs["paper"]["core_seconds"] / costs["level"]["core_seconds"],
        "memory_ratio": costs["paper"]["peak_memory"] / costs["level"]["peak_memory"],
        **{name: {**cost, "shear_rate_wall": rates[name]} for name, cost in costs.items()},
        "stretch": slow.duration,
        "rate_difference": rates["level"] / rates["paper"] - 1,
    }


def on_paper_nodes(level: scenes.Scene, gap: float = boxes.PAPER_GAP) -> scenes.Scene:
    """Return the same membranes and walls in the paper's scheme; see `paper_scheme`."""
    parameters = paper_scheme(level.layout.particles, gap)
    membranes = renoded(scenes.membranes_of(level), parameters)
    return scenes.scene_of(membranes, parameters, level.state.wall_displacement)


def _cost(stretch: scenes.Stretch, scene: scenes.Scene, membranes: xr.Dataset) -> dict[str, float]:
    """Return what a time unit takes, from what a stretch took, and the scheme's memory."""
    return {
        "core_seconds": stretch.core_seconds / stretch.duration,
        "clock_seconds": stretch.seconds / stretch.duration,
        "steps": stretch.steps / stretch.duration,
        "evaluations": stretch.evaluations / stretch.duration,
        "duration": stretch.duration,
        "nodes": scene.layout.nodes,
        "peak_memory": memory_of_evaluation(membranes, scene.parameters),
    }
