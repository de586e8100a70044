"""Estimates follow from what was measured, and grow with what there is to do."""

import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest

from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES
from softslip.operations import costs as module
from softslip.operations import workload
from softslip.operations.costs import TABLE, Costs, Measured, read_table, shipped
from softslip.operations.workload import evaluations
from softslip.simulation.expansion import membrane_node_counts
from softslip.simulation.record import interval_edges
from softslip.simulation.sample import wall_contour
from softslip.solver.geometry import wall_positions

DEMO: dict[str, Any] = {
    "fidelity": "preview",
    "channel": {"length": 0.125, "height": 0.21875, "outer_gap": 0.03125},
    "time_stepping": {"ageing_time": 50, "shear_time": 300},
    "recording": {"snapshots": [50.0]},
}

STANDARD_DEMO = {
    # stress: evaluations and bytes of twelve runs of a hundred particles to t = 300 at the
    # mesh's regularisation, which are not in the table: between smooth walls, then rough ones.
    0.02: [(9255, 559780), (9275, 556026)],
    0.05: [(9252, 557693), (9269, 548500)],
    0.1: [(9498, 551613), (9301, 545311)],
    0.2: [(12689, 537489), (9908, 540206)],
    0.3: [(13122, 535756), (11965, 538409)],
    0.5: [(15374, 534360), (14389, 535911)],
}


def parameters(**groups: Any) -> Parameters:
    tree = dict(DEMO)
    for name, values in groups.items():
        both = isinstance(values, dict) and name in tree
        tree[name] = {**tree[name], **values} if both else values
    return Parameters.from_mapping(tree)


def table() -> list[Measured]:
    return read_table(TABLE)


def test_the_table_says_how_it_was_made_and_has_every_stage_and_scheme() -> None:
    words = json.loads(TABLE.read_text())
    assert words["measured_by"] == "softslip calibrate"
    assert words["machine"]["processor"]
    assert {run.stage for run in table()} == set(STAGES)
    assert {run.parameters.fidelity for run in table()} >= {
        "preview",
        "standard",
        "paper",
        "converged",
        None,
    }
    assert {run.parameters.hydrodynamics.mobility for run in table()} == {"ewald", "grid"}


@pytest.mark.parametrize("stage", STAGES)
def test_the_stated_uncertainty_is_that_of_the_table(stage: str) -> None:
    """Its runs lie within it, as two standard deviations hold nearly all."""
    factor = shipped().factors[stage]
    assert 1.05 < factor < 1.5
    ratios = [
        run.core_seconds / shipped().estimate(stage, run.parameters).core_seconds
        for run in table()
        if run.stage == stage
    ]
    inside = [ratio for ratio in ratios if 1 / factor <= ratio <= factor]
    assert len(inside) >= 0.85 * len(ratios), sorted(ratios)


def test_evaluations_are_those_of_the_table() -> None:
    """The laws of step and radius are not fitted again: they must hold for what was measured.

    Runs of a few dozen evaluations take as long as their start, however many they are.
    """
    ratios = [
        evaluations(run.stage, run.parameters) / run.evaluations
        for run in table()
        if run.evaluations > 100
    ]
    assert len(ratios) > 25
    assert math.exp(abs(np.log(ratios)).max()) < 1.3, sorted(ratios)


EXPLICIT = {"integrator": "rkc2", "tolerance": 1e-2, "longest_step": 1.0}
"""The steps of 'standard' when its runs were counted, with records of a time unit."""


@pytest.mark.parametrize("stress", STANDARD_DEMO)
@pytest.mark.parametrize("place", [0, 1], ids=["smooth", "rough"])
def test_runs_that_are_not_in_the_table_are_estimated_as_well(stress: float, place: int) -> None:
    """They are longer, larger and at other stresses than those of the table.

    All are within the factor that is stated. Walls differ by up to 30 % at the same stress, and
    the estimate knows nothing of their roughness.
    """
    run = parameters(
        fidelity="standard",
        hydrodynamics={"regularisation": None},
        steric={"refinement": 2},
        suspension={"area_reference": "free"},
        wall={"roughness": (0.0, 0.59)[place]},
        rheometer={"stress": stress},
        time_stepping=EXPLICIT,
        recording={"longest_interval": 1.0},
    )
    counted, size = STANDARD_DEMO[stress][place]
    factor = shipped().factors["shear"]
    assert 1 / factor < evaluations("shear", run) / counted < factor
    assert shipped().estimate("shear", run).size == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("roughness", [0.0, 0.59])
@pytest.mark.parametrize("fidelity", ["preview", "converged", None])
def test_nodes_are_counted_to_a_per_cent(roughness: float, fidelity: str | None) -> None:
    run = parameters(fidelity=fidelity, wall={"roughness": roughness})
    membranes = int(membrane_node_counts(run).sum())
    assert workload.membrane_nodes(run) == pytest.approx(membranes, rel=0.01)
    spacing = run.hydrodynamics.node_spacing / run.hydrodynamics.resolution
    walls = wall_positions(wall_contour(run), run.channel.height, spacing)
    assert workload.nodes(run) == pytest.approx(membranes + 2 * walls.shape[1], rel=0.01)


@pytest.mark.parametrize("end", [0.5, 20.0, 300.0])
def test_records_are_counted_as_they_are_made(end: float) -> None:
    run = parameters(time_stepping={"shear_time": end}, recording={"snapshots": []})
    step, recording = run.time_stepping.step, run.recording
    longest = round(recording.longest_interval / step)
    edges = interval_edges(round(end / step), recording.samples_per_decade, longest)
    lengths, counts = workload._records(run)
    # The last of the longest may be cut short, and counts in part.
    assert len(edges) - 1 <= counts.sum() + 1e-9 <= len(edges) + 1e-9
    assert lengths @ counts == pytest.approx(end, rel=1e-12)


def test_euler_takes_one_evaluation_a_step() -> None:
    steps = {"integrator": "euler", "step": 0.002, "shear_time": 7}
    run = parameters(time_stepping=steps, recording={"snapshots": []})
    assert evaluations("shear", run) == pytest.approx(3500, rel=1e-12)


def test_no_time_takes_no_evaluations() -> None:
    assert evaluations("ageing", parameters(time_stepping={"ageing_time": 0})) == 0


def test_preparations_take_none() -> None:
    assert evaluations("packing", parameters()) == 0
    assert evaluations("expansion", parameters()) == 0


MORE = {
    "packing": {"packing": {"equilibration_steps": 10**6}},
    "expansion": {"expansion": {"ramp_steps": 50_000}},
    "ageing": {"time_stepping": {"ageing_time": 5000}},
    "shear": {"time_stepping": {"shear_time": 3000}},
}


@pytest.mark.parametrize("stage", STAGES)
def test_more_work_takes_longer(stage: str) -> None:
    little = shipped().estimate(stage, parameters())
    much = shipped().estimate(stage, parameters(**MORE[stage]))
    assert much.core_seconds > 3 * little.core_seconds
    larger = shipped().estimate(stage, parameters(channel={"length": 0.25}))
    assert larger.core_seconds > little.core_seconds
    assert larger.size > little.size


@pytest.mark.parametrize(
    "groups",
    [
        {"rheometer": {"stress": 0.5}},
        {"time_stepping": {"tolerance": 1e-4}},
        {"time_stepping": {"longest_step": 0.1}},
        {"solvent": {"viscosity": 0.5}},
    ],
    ids=str,
)
@pytest.mark.parametrize("integrator", ["rkc2", "imex_rkc2"])
def test_what_shortens_or_stiffens_steps_takes_more_evaluations(
    groups: dict[str, Any], integrator: str
) -> None:
    groups = {"rheometer": {"stress": 0.1}, **groups}
    stepping = {"integrator": integrator, **groups.pop("time_stepping", {})}
    plain = parameters(rheometer={"stress": 0.1}, time_stepping={"integrator": integrator})
    harder = parameters(**groups, time_stepping=stepping)
    assert evaluations("shear", harder) > 1.1 * evaluations("shear", plain)


@pytest.mark.parametrize("flow", [{"node_spacing": 3.0}, {"regularisation": 0.06}], ids=str)
def test_closer_nodes_and_shorter_regularisation_stiffen_explicit_steps_only(
    flow: dict[str, float],
) -> None:
    plain = parameters(rheometer={"stress": 0.1}, time_stepping=EXPLICIT)
    harder = parameters(rheometer={"stress": 0.1}, time_stepping=EXPLICIT, hydrodynamics=flow)
    assert evaluations("shear", harder) > 1.1 * evaluations("shear", plain)


def test_snapshots_take_room() -> None:
    without = shipped().estimate("shear", parameters(recording={"snapshots": []}))
    several = shipped().estimate("shear", parameters(recording={"snapshots": [1.0, 2.0, 3.0]}))
    one = shipped().estimate("shear", parameters())
    assert several.size - without.size == pytest.approx(3 * (one.size - without.size))


def test_an_imposed_rate_is_estimated() -> None:
    run = parameters(rheometer={"mode": "rate", "stress": None, "shear_rate": 0.01})
    usual = parameters(rheometer={"stress": workload.USUAL_STRESS})
    assert shipped().estimate("shear", run) == shipped().estimate("shear", usual)


def test_no_particles_cost_next_to_nothing() -> None:
    run = parameters(suspension={"area_fraction": 0.0}, recording={"bulk_margin": None})
    for stage in STAGES:
        estimate = shipped().estimate(stage, run)
        assert 0 < estimate.core_seconds < 60
        assert estimate.size > 0


def measured(stress: float, factor: float, size: float = 1.0) -> Measured:
    run = parameters(rheometer={"stress": stress})
    estimate = shipped().estimate("shear", run)
    return Measured("shear", run, factor * estimate.core_seconds, round(size * estimate.size))


def test_finished_runs_correct_the_estimate() -> None:
    found = shipped().correction("shear", [measured(0.1, 2.0, 0.5), measured(0.5, 8.0, 0.5)])
    assert found.runs == 2
    assert found.core_seconds == pytest.approx(4.0, rel=1e-9)
    assert found.size == pytest.approx(0.5, rel=1e-4)
    assert found.factor == shipped().factors["shear"], "two runs tell little of their scatter"


def test_without_finished_runs_nothing_is_corrected() -> None:
    found = shipped().correction("shear", [])
    assert (found.runs, found.core_seconds, found.size) == (0, 1.0, 1.0)
    assert found.factor == shipped().factors["shear"]


def test_a_machine_that_is_slower_by_a_factor_gives_a_table_that_is() -> None:
    slower = [
        dataclasses.replace(run, core_seconds=3 * run.core_seconds, size=2 * run.size)
        for run in table()
    ]
    ours, theirs = shipped(), Costs(slower)
    for stage in STAGES:
        one, other = (costs.estimate(stage, parameters()) for costs in (ours, theirs))
        assert other.core_seconds == pytest.approx(3 * one.core_seconds, rel=1e-9)
        assert other.size == pytest.approx(2 * one.size, rel=1e-9)


def test_an_exact_line_is_found_again() -> None:
    line = module.fitted_line([(load, 2.0 + 3.0 * load) for load in (0.0, 1.0, 10.0)])
    assert line == pytest.approx((2.0, 3.0), rel=1e-9)


@pytest.mark.parametrize(
    ("points", "line"),
    [
        ([(1.0, 1.0), (2.0, 4.0)], (0.0, (1 / 1 + 2 / 4) / (1 / 1 + 4 / 16))),
        ([(1.0, 4.0), (2.0, 2.0)], ((1 / 4 + 1 / 2) / (1 / 16 + 1 / 4), 0.0)),
    ],
    ids=["start", "slope"],
)
def test_nothing_costs_less_than_nothing(
    points: list[tuple[float, float]], line: tuple[float, float]
) -> None:
    """What would be negative is 0, and the rest fits best by itself."""
    assert module.fitted_line(points) == pytest.approx(line, rel=1e-9)
