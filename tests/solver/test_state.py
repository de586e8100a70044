from dataclasses import replace

import numpy as np
import pytest
import scenes

from softslip.solver.integrators import Memory
from softslip.solver.state import State


@pytest.fixture
def state():
    given = scenes.parameters()
    rings = [scenes.ellipse((0.02, 0.05), (0.008, 0.006), 20)]
    return scenes.of_rings(rings, given)[1]


def test_every_number_of_the_vector_belongs_to_one_array(state):
    vector = np.arange(state.vector.size, dtype=float)
    view = state.like(vector)
    arrays = [view.node_position, view.tether, view.wall_displacement, view.wall_speed]
    assert np.concatenate([array.ravel() for array in arrays]).tolist() == vector.tolist()


def test_arrays_are_views_of_the_vector(state):
    copy = state.replace(state.vector.copy(), 0.0, 0)
    for value, name in enumerate(("node_position", "tether", "wall_displacement", "wall_speed")):
        getattr(copy, name)[:] = value + 10
    assert set(copy.vector) == {10.0, 11.0, 12.0, 13.0}
    assert copy.node_position.shape == (20, 2)
    assert copy.tether.shape == (2, state.wall_nodes, 2)


def test_a_state_at_rest_has_its_membranes_and_nothing_else(state):
    assert state.node_position[:, 1].mean() == pytest.approx(0.05, rel=1e-12)
    assert not state.tether.any()
    assert not state.wall_displacement.any()
    assert not state.wall_speed.any()
    assert (state.time, state.step) == (0.0, 0)


def test_a_state_at_rest_is_a_copy():
    given = scenes.parameters()
    ring = scenes.ellipse((0.02, 0.05), (0.008, 0.006), 20)
    state = State.at_rest(ring, scenes.layout_of_rings([ring], given))
    state.node_position[:] = 0
    assert ring.any()


def test_replacing_changes_the_numbers_and_keeps_the_shape(state):
    other = state.replace(state.vector + 1, 2.5, 7)
    assert (other.time, other.step) == (2.5, 7)
    assert other.node_position == pytest.approx(state.node_position + 1)
    assert state.step == 0


def test_replacing_keeps_what_the_stepper_remembers(state):
    direction = np.arange(3.0)
    told = replace(state, memory=Memory(0.3, 40.0, 6, direction))
    other = told.replace(told.vector + 1, 2.5, 7).memory
    assert (other.step_size, other.spectral_radius, other.radius_age) == (0.3, 40.0, 6)
    assert other.direction is direction


def test_a_state_at_rest_remembers_no_steps(state):
    memory = state.memory
    assert (memory.step_size, memory.spectral_radius, memory.radius_age) == (0.0, 0.0, 0)
    assert memory.direction.shape == (0,)


def test_a_state_is_frozen(state):
    with pytest.raises(AttributeError):
        state.step = 3


@pytest.mark.parametrize("name", ["node_position", "tether", "wall_displacement", "wall_speed"])
def test_a_component_is_found_in_the_array_that_it_belongs_to(state, name):
    array = getattr(state.like(np.arange(state.vector.size)), name)
    rows = array.reshape(-1, 2) if array.ndim > 1 else array[:, None]
    for row, components in enumerate(rows):
        assert [state.located(component) for component in components] == [(name, row)] * rows.shape[
            1
        ]


def test_a_component_beyond_the_vector_is_refused(state):
    with pytest.raises(IndexError, match="has none"):
        state.located(state.vector.size)
