import numpy as np
import pytest
import scenes

from softslip import health, shear
from softslip.errors import NumericalError
from softslip.state import State

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


def check(state, layout, film=RANGE, reference=None):
    areas = np.pi * np.array([0.008 * 0.006, 0.009 * 0.007]) if reference is None else reference
    health.check_state(state, layout, areas, film, height=HEIGHT, contact_range=RANGE)


def refused(state, layout, **others):
    with pytest.raises(NumericalError) as caught:
        check(state, layout, **others)
    assert "\n" not in str(caught.value)
    assert f"{caught.value.field}[{caught.value.index}] at step 37" in str(caught.value)
    return caught.value


def test_a_healthy_state_passes(scene):
    check(*scene)
    check(*scene, film=np.inf)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["node_position", "tether", "wall_displacement", "wall_speed"])
def test_every_array_must_be_finite(scene, name, value):
    state, layout = scene
    getattr(state, name).flat[1] = value
    error = refused(state, layout)
    index = {"node_position": 1, "tether": 2 * state.particle_nodes + 1}
    index |= {"wall_displacement": state.vector.size - 3, "wall_speed": state.vector.size - 1}
    assert (error.field, error.index) == ("state", index[name])


@pytest.mark.parametrize("height", [-1e-9, HEIGHT + 1e-9])
def test_no_node_may_lie_behind_a_wall(scene, height):
    state, layout = scene
    state.node_position[51, 1] = height
    error = refused(state, layout)
    assert (error.field, error.index) == ("node_position", 51)
    assert "behind a wall" in str(error)


@pytest.mark.parametrize("factor", [0.94, 1.06])
def test_no_area_may_leak(scene, factor):
    state, layout = scene
    areas = np.pi * np.array([0.008 * 0.006, 0.009 * 0.007 * factor])
    error = refused(state, layout, reference=areas)
    assert (error.field, error.index) == ("area", 1)
    assert "area_correction" in str(error)


def test_no_film_may_vanish(scene):
    check(*scene, film=0.21 * RANGE)
    error = refused(*scene, film=0.19 * RANGE)
    assert (error.field, error.index) == ("film_thickness", 0)
    assert f"{0.19 * RANGE:.3g}" in str(error)


def test_a_membrane_turned_inside_out_is_seen(scene):
    state, layout = scene
    state.node_position[40:] = state.node_position[40:][::-1].copy()
    assert refused(state, layout).field == "area"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.51 * RANGE / 0.002])
def test_no_node_may_jump_over_a_contact(value):
    rate = np.full((9, 2), 0.49 * RANGE / 0.002)
    health.check_move(rate, 0.002, RANGE, 5)
    rate[6, 1] = value
    with pytest.raises(NumericalError, match=r"node_velocity\[6\] at step 5: .*time_stepping"):
        health.check_move(rate, 0.002, RANGE, 5)


@pytest.mark.parametrize("name", ["node_position", "tether", "wall_displacement", "wall_speed"])
def test_a_run_stops_at_the_step_that_a_number_is_lost(foam, smooth, name):
    """Within the guards' interval, whichever array the fault is in."""
    suspension, state = scenes.of_foam(foam, smooth)
    getattr(state, name).flat[0] = np.nan
    with pytest.raises(NumericalError) as caught:
        shear.advance(suspension, state, 1, smooth, foam["area"].values, nothing, nothing)
    assert caught.value.step == 0


def nothing(*_):
    """See and report nothing."""


def test_a_time_step_too_long_ends_in_an_error_that_says_so(foam):
    given = scenes.parameters(time_stepping={"step": 0.1}, rheometer={"stress": 0.5})
    suspension, state = scenes.of_foam(foam, given)
    with pytest.raises(NumericalError, match=r"time_stepping\.step"):
        shear.advance(suspension, state, 200, given, foam["area"].values, nothing, nothing)
