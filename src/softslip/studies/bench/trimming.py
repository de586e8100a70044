"""What is saved by work that the product leaves out, and that the flow stays the same."""

from collections.abc import Callable
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.solver.geometry import FloatArray
from softslip.studies import scenes
from softslip.studies.bench.trimmed import (
    MARGIN,
    RATES,
    Row,
    Trimmed,
    assembled,
    dense_scene,
    dilute_scene,
    relative_change,
    run_of,
    same_state,
)
from softslip.studies.bench.trimming_contacts import contacts_row, own_contacts, shared_list_row
from softslip.studies.timing import Tell, alternately, silent

DURATION = 2.0
"""Time over which costs and rates are taken [time unit]."""

FINER = 0.25
"""Factor on the tolerance of a step, for the error of the steps."""

FIELDS = 1.0
"""Velocity fields that a run without this trimming would work out [1 / time unit]."""

BASES = {
    "outer gap": "time steps and sums",
    "1D profile": "velocities",
    "2D fields": "sums",
    "contact points": "sums",
    "contact search": "sums",
    "rigid pairs": "sums",
    "shared list": "sums",
}
"""Trimmings, and which error of the estimate stands beside what each changes."""


def bench_trimming(
    particles: int = 100,
    fidelity: str = "paper",
    *,
    ageing: float = scenes.AGEING,
    shearing: float = scenes.SHEARING,
    duration: float = DURATION,
    budget: float = 2.0,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Measure what each trimming saves of a run, and that it does not change the flow.

    The smaller outer gap changes the motion: both gaps are run over the same stretch from the
    same state, and the error beside the change is that of the time steps, from a run at
    `FINER` times the tolerance, and of the Ewald sums, from another split of them. All others are
    compared at one instant: the profile beside what the rms error of the sums' velocities may do
    to rates, the rest beside the error of the rates. There γ̇_bulk follows from the forces alone,
    which have no error, and γ̇_wall is that of the nodes, which the profile leaves as it is.
    Trimmings of contacts are measured where particles are apart, at the area fraction `DILUTE`.
    Costs are least wall times of the work, or core-seconds of a run, times how often the run
    does it.

    Parameters
    ----------
    particles
        N at the area fraction of the paper; the dilute scene has the same channel.
    fidelity
        Level.
    ageing, shearing
        Times at rest and under stress before anything is measured [time unit].
    duration
        Of the runs [time unit].
    budget
        Time for the repeats of each comparison [s].
    tell
        Shown the phases.

    Returns
    -------
    dict
        ``core_seconds``, ``steps``, ``evaluations``, ``samples`` and ``searches`` per time unit
        of the run; for each of `BASES` ``trimmed_seconds`` and ``untrimmed_seconds`` per time
        unit, ``saved``, their difference over the cost of the untrimmed run, and the relative
        ``..._change`` of each of `RATES` with its ``..._error``; ``dilute`` with
        ``core_seconds`` and the ``pairs`` of contact points listed there.

    Raises
    ------
    SoftslipError
        When there is no such scene, or a run fails.
    """
    tell(f"making {particles} aged and sheared particles at fidelity {fidelity}")
    close = dense_scene(particles, fidelity, ageing, shearing)
    apart = dilute_scene(particles, fidelity)
    tell(f"running both scenes for {duration:g} time units")
    dense, dilute = Trimmed(close, duration), Trimmed(apart, duration)
    tell("running with the outer gap of the paper")
    rows = {"outer gap": _outer_gap(dense, duration)}
    works: dict[str, Callable[[], Row]] = {
        "1D profile": lambda: _profile(dense, budget),
        "2D fields": lambda: _fields(dense, budget),
        "contact points": lambda: contacts_row(dilute, budget, keep=True),
        "contact search": lambda: contacts_row(dilute, budget, keep=False),
        "rigid pairs": lambda: _rigid(dense, budget),
        "shared list": lambda: shared_list_row(dense, budget),
    }
    for name, work in works.items():
        tell(f"comparing with and without: {name}")
        rows[name] = work()
    tables = {name: row.figures() for name, row in rows.items()}
    run = dense.run
    listed = own_contacts(dilute).listed(dilute.evaluation.positions)
    return {
        "bench": "trimming",
        "particles": particles,
        "fidelity": fidelity,
        "errors": "; ".join(f"{name}: {basis}" for name, basis in BASES.items()),
        "core_seconds": run.core_seconds,
        "steps": run.steps,
        "evaluations": run.evaluations,
        "samples": run.samples,
        "searches": run.searches,
        "dilute": {"core_seconds": dilute.run.core_seconds, "pairs": listed},
        **{key: {name: tables[name][key] for name in BASES} for key in tables["outer gap"]},
    }


def _outer_gap(dense: Trimmed, duration: float) -> Row:
    scene, particles = dense.scene, dense.scene.layout.particles
    given = scene.parameters
    recording = {"bulk_margin": MARGIN}
    wide = scenes.parameters_of(
        particles,
        given.fidelity,
        gap=scenes.nearest_gap(given.channel.height),
        recording=recording,
    )
    fine = scenes.parameters_of(
        particles,
        given.fidelity,
        recording=recording,
        time_stepping={"tolerance": FINER * given.time_stepping.tolerance},
    )
    untrimmed, finer = (run_of(same_state(scene, each), duration) for each in (wide, fine))
    steps, sums = relative_change(dense.run.rates, finer.rates), dense.sum_error()
    return Row(
        trimmed=dense.run.core_seconds,
        untrimmed=untrimmed.core_seconds,
        whole=dense.run.core_seconds,
        change=relative_change(dense.run.rates, untrimmed.rates),
        error={key: steps[key] + sums[key] for key in RATES},
    )


def _profile(dense: Trimmed, budget: float) -> Row:
    scene, evaluation = dense.scene, dense.evaluation
    flow, heights = assembly.mean_flow(scene.parameters), dense.heights
    columns = dense.solver().shape[0]

    def along_lines() -> FloatArray:
        density = flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0])
        return flow.velocity(density)[: heights.size]

    def over_columns() -> FloatArray:
        x = np.arange(columns) * (scene.parameters.channel.length / columns)
        points = np.stack(np.meshgrid(x, heights), axis=-1).reshape(-1, 2)
        field = scene.suspension.velocities_at(points, evaluation)
        profile: FloatArray = field[:, 0].reshape(heights.size, columns).mean(axis=1)
        return profile

    seconds = alternately({"lines": along_lines, "columns": over_columns}, budget)
    return Row(
        trimmed=dense.run.samples * seconds["lines"],
        untrimmed=dense.run.samples * seconds["columns"],
        whole=dense.run.core_seconds,
        change=relative_change(dense.of_profile(along_lines()), dense.of_profile(over_columns())),
        error=dense.field_error(),
    )


def _fields(dense: Trimmed, budget: float) -> Row:
    scene = dense.scene
    points = field_points(scene.parameters)
    before = dense.measured()
    seconds = alternately(
        {"field": lambda: scene.suspension.velocities_at(points, dense.evaluation)}, budget
    )
    return Row(
        trimmed=0.0,
        untrimmed=FIELDS * seconds["field"],
        whole=dense.run.core_seconds,
        change=relative_change(before, dense.measured()),
        error=dense.sum_error(),
    )


def field_points(parameters: Parameters) -> FloatArray:
    """Return the points of a kept velocity field, shape (points, 2) [length unit]."""
    channel = parameters.channel
    spacing = parameters.recording.field_spacing * parameters.suspension.mean_radius
    sides = [
        (np.arange(count) + 0.5) * (size / count)
        for size in (channel.length, channel.height)
        for count in [max(round(size / spacing), 1)]
    ]
    return np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)


def _rigid(dense: Trimmed, budget: float) -> Row:
    positions, forces = dense.evaluation.positions, dense.evaluation.forces
    once, every = dense.solver(), dense.solver(rigid=False)
    seconds = alternately(
        {
            "once": lambda: once._near(positions, forces),
            "every": lambda: every._near(positions, forces),
        },
        budget,
    )
    return Row(
        trimmed=dense.run.evaluations * seconds["once"],
        untrimmed=dense.run.evaluations * seconds["every"],
        whole=dense.run.core_seconds,
        change=relative_change(
            dense.measured(assembled(dense.scene, once)),
            dense.measured(assembled(dense.scene, every)),
        ),
        error=dense.sum_error(),
    )
