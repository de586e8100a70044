from dataclasses import replace

import numpy as np
import pytest
import scenes

from softslip.errors import NumericalError
from softslip.simulation import trajectory
from softslip.solver import health
from softslip.solver.geometry import polygon_area
from softslip.solver.membrane import ORDERS
from softslip.solver.state import State

RANGE = 9 / 8192
HEIGHT = 0.109375


@pytest.fixture
def scene():
    given = scenes.parameters()
    rings = [
        scenes.ellipse((0.02, 0.03), (0.008, 0.006), 40),
        scenes.ellipse((0.04, 0.07), (0.009, 0.007), 44),
    ]
    layout = scenes.layout_of_rings(rings, given)
    state = State.at_rest(np.concatenate(rings), layout)
    return state.replace(state.vector.copy(), 0.4, 37), layout


def guard(layout, **limits):
    limits = {"length": 0.1, "height": HEIGHT, "order": 2, "contact_range": RANGE} | limits
    return health.Guard(layout, **limits)


def check(state, layout, film=RANGE, order=2):
    guard(layout, order=order).check_state(state, film)


def with_reference_areas(layout, factors):
    """The same layout, of particles that should have so many times their areas."""
    return replace(layout, spacing=layout.spacing * np.sqrt(factors))


def refused(state, layout, **others):
    with pytest.raises(NumericalError) as caught:
        check(state, layout, **others)
    assert "\n" not in str(caught.value)
    assert f"{caught.value.field}[{caught.value.index}] at step 37" in str(caught.value)
    return caught.value


def test_a_healthy_state_passes(scene):
    check(*scene)
    check(*scene, film=np.inf)


ARRAYS = ["node_position", "tether", "wall_displacement", "wall_speed"]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("place", [1, -1])
def test_every_array_must_be_finite(scene, name, value, place):
    state, layout = scene
    array = getattr(state, name)
    array.flat[place] = value
    error = refused(state, layout)
    row = np.arange(array.size)[place] // (1 if array.ndim == 1 else 2)
    assert (error.field, error.index) == (name, row)


def test_an_error_about_a_vector_is_told_about_the_array(scene):
    state, _ = scene
    error = health.named(NumericalError("state", 2 * 50 + 1, 0, "stiff"), state)
    assert (error.field, error.index, error.step) == ("node_position", 50, 37)
    error = health.named(NumericalError("step_size", 3, 0, "short"), state)
    assert (error.field, error.index, error.step, error.message) == ("step_size", 3, 37, "short")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_every_force_must_be_finite(value):
    forces = np.ones((9, 2))
    health.check_forces(forces, 3)
    forces[6, 1] = value
    with pytest.raises(NumericalError, match=r"force\[6\] at step 3: is not finite.*node_spacing"):
        health.check_forces(forces, 3)


@pytest.mark.parametrize("height", [-1e-9, HEIGHT + 1e-9])
def test_no_node_may_lie_behind_a_wall(scene, height):
    state, layout = scene
    state.node_position[51, 1] = height
    error = refused(state, layout)
    assert (error.field, error.index) == ("node_position", 51)
    assert "behind a wall" in str(error)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("factor", [0.94, 1.06])
def test_no_area_may_leak(scene, factor, order):
    state, layout = scene
    check(state, with_reference_areas(layout, [1.0, np.sqrt(factor)]), order=order)
    error = refused(state, with_reference_areas(layout, [1.0, factor]), order=order)
    assert (error.field, error.index) == ("area", 1)
    assert "area_correction" in str(error)


def test_areas_are_taken_at_the_order_of_the_run(scene):
    """A dozen nodes: the polygon lacks 4.5 % of the ellipse, the six-point area 0.01 %."""
    _, full = scene
    ring = scenes.ellipse((0.02, 0.03), (0.008, 0.006), 12)
    true = np.pi * 0.008 * 0.006
    spacing = np.array([2 * np.sqrt(np.pi * true) / 12])
    layout = replace(full, offsets=np.array([0, 12]), spacing=spacing)
    state = State.at_rest(ring, layout)
    assert polygon_area(*ring.T) / true == pytest.approx(0.955, abs=1e-3)
    layout = with_reference_areas(layout, [1.01])
    check(state, layout, order=6)
    with pytest.raises(NumericalError, match="area"):
        check(state, layout, order=2)


def test_no_film_may_vanish(scene):
    check(*scene, film=0.21 * RANGE)
    error = refused(*scene, film=0.19 * RANGE)
    assert (error.field, error.index) == ("film_thickness", 0)
    assert f"{0.19 * RANGE:.3g}" in str(error)


def test_a_membrane_turned_inside_out_is_seen(scene):
    state, layout = scene
    state.node_position[40:] = state.node_position[40:][::-1].copy()
    assert refused(state, layout).field == "area"


@pytest.mark.parametrize("name", ["node_position", "tether", "wall_displacement", "wall_speed"])
def test_a_run_stops_at_the_step_that_a_number_is_lost(foam, smooth, name):
    """Within the guards' interval, whichever array the fault is in."""
    suspension, state = scenes.of_foam(foam, smooth)
    getattr(state, name).flat[0] = np.nan
    with pytest.raises(NumericalError) as caught:
        trajectory.advance(suspension, state, np.array([0.002]), smooth)
    assert caught.value.step == 0


def test_a_time_step_too_long_ends_in_an_error_that_says_so(foam):
    given = scenes.parameters(time_stepping={"step": 0.1}, rheometer={"stress": 0.5})
    suspension, state = scenes.of_foam(foam, given)
    with pytest.raises(NumericalError, match=r"time_stepping\.step"):
        trajectory.advance(suspension, state, np.array([20.0]), given)


def test_no_film_may_be_thinner_than_what_forces_are_spread_over(scene):
    state, layout = scene
    spreading = guard(layout, regularisation=RANGE)
    sheets = 2 / np.sqrt(np.pi) * RANGE
    spreading.check_state(state, 1.01 * sheets)
    with pytest.raises(NumericalError, match=r"film_thickness\[0\] at step 37: .*regularisation"):
        spreading.check_state(state, 0.99 * sheets)


def test_no_film_may_be_thinner_than_nodes_resolve(scene):
    state, layout = scene
    spaced = guard(layout, node_spacing=0.6 * RANGE)
    spaced.check_state(state, 0.86 * 0.6 * RANGE)
    with pytest.raises(NumericalError, match=r"film_thickness\[0\] at step 37: .*node_spacing"):
        spaced.check_state(state, 0.84 * 0.6 * RANGE)


def test_the_printed_control_may_not_run_away_from_the_walls():
    wall = np.array([-0.2, 0.1])
    health.check_control(np.zeros(2), wall, 4)
    health.check_control(wall * [1.4, 0.6], wall, 4)
    with pytest.raises(NumericalError, match=r"wall_speed\[1\] at step 4: .*control 'exact'"):
        health.check_control(wall * [1.4, 1.6], wall, 4)
    with pytest.raises(NumericalError, match=r"wall_speed\[0\]"):
        health.check_control(-wall, wall, 4)


@pytest.mark.parametrize("integrator", ["euler", "rkc2"])
def test_a_run_under_the_printed_control_stops_before_it_means_nothing(foam, integrator):
    # Short steps, or Euler would refuse what grows fast as well as what decays fast.
    stepping = {"integrator": integrator, "step": 5e-4}
    given = scenes.parameters(
        rheometer={"control": "printed", "stress": 0.3}, time_stepping=stepping
    )
    suspension, state = scenes.of_foam(foam, given)
    stress = []

    def look(state, evaluation):
        stress.append(evaluation.stress)

    with pytest.raises(NumericalError, match=r"wall_speed\[\d\].*rheometer\.control 'exact'"):
        trajectory.advance(
            suspension, suspension.load(state), np.array([0.2]), given, trajectory.Callbacks(look)
        )
    assert stress == pytest.approx(np.full(len(stress), 0.3), rel=0.01)


class Faulty:
    """A suspension whose evaluations are spoilt from some number on."""

    def __init__(self, suspension, spoil, first):
        self._suspension, self._spoil, self._first = suspension, spoil, first
        self._count = 0

    def __getattr__(self, name):
        return getattr(self._suspension, name)

    def evaluate(self, state):
        self._count += 1
        evaluation = self._suspension.evaluate(state)
        return self._spoil(evaluation) if self._count >= self._first else evaluation


def lost_force(evaluation):
    forces = evaluation.forces.copy()
    forces[7, 0] = np.inf
    return replace(evaluation, forces=forces)


def no_film(evaluation):
    return replace(evaluation, film_thickness=1e-9)


def crossed(evaluation):
    positions = evaluation.positions.copy()
    positions[[20, 21]] = positions[[21, 20]]
    return replace(evaluation, positions=positions)


@pytest.mark.parametrize(
    ("spoil", "field"),
    [(lost_force, "force[7]"), (no_film, "film_thickness[0]"), (crossed, "node_position")],
)
def test_a_run_stops_at_the_step_of_a_fault_in_its_evaluation(foam, smooth, spoil, field):
    suspension, state = scenes.of_foam(foam, smooth)
    seen = []
    with pytest.raises(NumericalError) as caught:
        trajectory.advance(
            Faulty(suspension, spoil, 40),
            state,
            np.array([0.2]),
            smooth,
            trajectory.Callbacks(lambda state, _: seen.append(state.step)),
        )
    assert field in str(caught.value)
    assert caught.value.step == seen[-1] + 1 > 10


@pytest.mark.parametrize("ratio", [0.8, 1.3])
def test_a_run_of_euler_steps_begins_only_below_its_limit(foam, ratio):
    stiff = {"rheometer": {"stress": 0.0}, "wall": {"stiffness": 2e6}}
    given = scenes.parameters(**stiff, time_stepping={"step": 1e-4})
    suspension, state = scenes.of_foam(foam, given)
    done = trajectory.advance(suspension, state, np.array([1e-4]), given)
    step = ratio * 2 / done.state.memory.spectral_radius
    given = scenes.parameters(**stiff, time_stepping={"step": step})
    suspension, state = scenes.of_foam(foam, given)
    if ratio < 1:
        trajectory.advance(suspension, state, 5 * np.array([step]), given)
        return
    # The walls' tethers are the stiffest here, and the error says so.
    with pytest.raises(NumericalError, match=r"tether\[\d+\] at step 0: .*time_stepping.step"):
        trajectory.advance(suspension, state, 5 * np.array([step]), given)
