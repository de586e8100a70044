"""Faults that no guard sees on purpose, to see that the verdict does."""

from dataclasses import replace

import numpy as np
import pytest
import scenes
from studies_small import SMALL_MAP

from softslip.simulation import assembly
from softslip.solver import health
from softslip.solver.integrators import INTEGRATORS
from softslip.studies.boxes import merged
from softslip.studies.stability import exact_geometry, verdict
from softslip.studies.stability.axes import GROUPS
from softslip.studies.stability.cells import Cell
from softslip.studies.stability.map_scenes import dense, in_scheme, scene_of

DESIGN = SMALL_MAP.model_copy(update={"duration": 0.05, "stresses": (0.3,)})


@pytest.fixture
def cell():
    return next(cell for cell in GROUPS["stress"](DESIGN) if cell.scheme == "literal")


@pytest.fixture
def state_and_layout():
    scene = scene_of(dense(DESIGN), dense(DESIGN))
    state = scene.state.replace(scene.state.vector.copy(), 0.0, 0)
    return state, scene.layout, scene.parameters


def test_a_sound_cell_is_correct_and_brings_evidence(cell):
    judgement = verdict.judge(cell)
    assert (judgement.verdict, judgement.message) == ("correct", "")
    evidence = judgement.evidence
    assert evidence.time == cell.duration
    assert evidence.crossings == 0
    assert 0 < evidence.position_error < verdict.POSITION_ERROR
    assert 0 < evidence.rate_error < verdict.RATE_ERROR
    assert evidence.stress_error < 1e-9


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time_stepping": {"step": 0.1}}, "NumericalError"),
        ({"hydrodynamics": {"node_spacing": 9.0}}, "ConfigError: hydrodynamics.node_spacing"),
    ],
)
def test_a_cell_that_says_no_has_stopped(cell, changes, message):
    judgement = verdict.judge(replace(cell, tree=merged(cell.tree, changes), duration=0.8))
    assert judgement.verdict == "stopped"
    assert message in judgement.message


def test_a_packing_that_is_not_found_has_stopped(cell):
    full = merged(cell.start, {"suspension": {"area_fraction": 0.95}})
    judgement = verdict.judge(replace(cell, start=full, tree=full))
    assert judgement.verdict == "stopped"
    assert "ExpansionError" in judgement.message


def spoilt(spoil):
    """Explicit Euler whose every step is spoilt by a function of where it began and ended."""
    euler = INTEGRATORS["euler"]

    def step(rate, vector, *rest):
        sound = euler(rate, vector, *rest)
        return replace(sound, vector=spoil(vector, sound.vector))

    return step


def test_a_stepper_that_drifts_is_wrong(cell, monkeypatch):
    """Steps 10 % too long leave everything finite, whole and apart."""
    drifting = spoilt(lambda before, after: before + 1.1 * (after - before))
    monkeypatch.setitem(INTEGRATORS, "euler", drifting)
    judgement = verdict.judge(replace(cell, duration=0.4))
    assert judgement.verdict == "wrong"
    assert "shear rate is off by" in judgement.message


def test_areas_that_leak_are_wrong(cell, monkeypatch):
    """A membrane that loses 3 % of its area, less than what the run's own guard stops."""
    steps = cell.duration / 0.002
    count = scene_of(cell.start, cell.tree).layout.offsets[1]

    def shrink(before, after):
        shrunk = after.copy()
        nodes = shrunk[: 2 * count].reshape(-1, 2)
        nodes -= 0.015 / steps * (nodes - nodes.mean(axis=0))
        return shrunk

    monkeypatch.setitem(INTEGRATORS, "euler", spoilt(shrink))
    judgement = verdict.judge(cell)
    assert judgement.verdict == "wrong"
    assert "area is off" in judgement.message


def test_a_stress_that_is_not_the_imposed_one_is_wrong(cell, monkeypatch):
    assemble = assembly.assemble

    def other(parameters, layout, *, stress, **rest):
        return assemble(parameters, layout, stress=1.01 * stress, **rest)

    monkeypatch.setattr(assembly, "assemble", other)
    judgement = verdict.judge(cell)
    assert judgement.verdict == "wrong"
    assert "stress is off" in judgement.message


def test_a_run_without_a_finer_one_to_compare_with_is_wrong(cell, monkeypatch):
    def refuses(*_):
        raise health.NumericalError("film", 0, 0, "closed")

    # Made before, so that only the finer runs are refused.
    scene_of(cell.start, cell.tree)
    monkeypatch.setitem(INTEGRATORS, "rkc2", refuses)
    judgement = verdict.judge(cell)
    assert judgement.verdict == "wrong"
    assert "no finer run" in judgement.message


def test_no_crossing_is_seen_where_there_is_none(state_and_layout):
    assert exact_geometry.crossing_of(*state_and_layout) == ""


@pytest.mark.parametrize("periods", [0, 3])
def test_membranes_that_overlap_are_seen(state_and_layout, periods):
    state, layout, given = state_and_layout
    first, second = (slice(*layout.offsets[k : k + 2]) for k in (0, 1))
    shift = (0.004 + periods * given.channel.length, 0.0)
    state.node_position[second] = state.node_position[first] + shift
    assert "cross or overlap" in exact_geometry.crossing_of(state, layout, given)


def test_a_membrane_that_crosses_itself_is_seen(state_and_layout):
    state, layout, given = state_and_layout
    state.node_position[[10, 14]] = state.node_position[[14, 10]]
    assert "membrane 0 crosses itself" in exact_geometry.crossing_of(state, layout, given)


@pytest.mark.parametrize("wall", [0, 1])
def test_a_membrane_behind_a_wall_is_seen(state_and_layout, wall):
    state, layout, given = state_and_layout
    heights = state.node_position[: layout.offsets[1], 1]
    heights += given.channel.height - heights.max() + 1e-5 if wall else -heights.min() - 1e-5
    assert f"into wall {wall}" in exact_geometry.crossing_of(state, layout, given)


def test_walls_are_looked_for_where_they_are_now():
    rough = {"wall": {"roughness": 0.59}}
    given = scenes.parameters(**rough)
    between = scenes.ellipse((0.0, 0.0075), (0.006, 0.006), 60)
    layout = scenes.layout_of_rings([between], given)
    tip = layout.wall_reference[0, np.argmax(layout.wall_reference[0, :, 1]), 0]
    _, state = scenes.of_rings([between + np.array([tip, 0.0])], given)
    assert "into wall 0" in exact_geometry.crossing_of(state, layout, given)
    bumps = round(given.channel.length / given.wall.roughness / given.suspension.mean_radius / 5)
    state.wall_displacement[0] = 0.5 * given.channel.length / max(bumps, 1)
    assert exact_geometry.crossing_of(state, layout, given) == ""


def test_what_moves_at_rest_is_wrong():
    cells = GROUPS["rest"](SMALL_MAP.model_copy(update={"rests": (500,)}))
    cell = next(cell for cell in cells if cell.scheme == "literal")
    assert verdict.judge(cell).verdict == "correct"
    pushed = replace(cell, tree=merged(cell.tree, {"rheometer": {"stress": 0.01}}))
    judgement = verdict.judge(pushed)
    assert judgement.verdict == "wrong"
    assert "at rest moved" in judgement.message


def test_a_cell_of_few_nodes_has_a_reference_on_its_own_nodes():
    """Where twice the nodes are refused, the same nodes serve: 'rates' asks for them only."""
    start = dense(DESIGN)
    tree = in_scheme(DESIGN, start, "literal")
    cell = Cell("stress", "0.3", 0.3, "literal", tree, start, 0.02, "rates")
    evidence = verdict.judge(cell).evidence
    assert evidence.rate_error < verdict.RATE_ERROR
    assert np.isnan(evidence.position_error)
