import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.solver.contact_list import ContactList
from softslip.solver.geometry import Layout
from softslip.solver.steric import ContactForces
from softslip.solver.verlet_list import SKIN

REACH = 0.1

seeds = st.integers(0, 2**31)


def layout_of(bodies, per_body, walls):
    return Layout(
        np.arange(bodies + 1) * per_body, np.full(bodies, 0.01), np.zeros((2, walls, 2)), 0.01
    )


def forces_of(contacts, positions, layout, length, reach):
    forces = np.zeros_like(positions)
    law = ContactForces(layout.chains, layout.weights, length, reach, 1.0)
    film = law.add(positions, contacts.pairs(positions), forces)
    return forces, film


@given(seeds)
def test_forces_do_not_depend_on_when_the_list_was_built(seed):
    layout, length = layout_of(6, 15, 15), 0.5
    random = scenes.generator(seed)
    positions = random.uniform(0, 1, (layout.nodes, 2)) * (length, 0.5)
    old = ContactList(layout, length, REACH)
    old.pairs(positions)
    for step in range(12):
        positions = positions + 0.1 * SKIN * REACH * random.uniform(-1, 1, positions.shape)
        # Whole particles are wrapped into the period while the list lives on.
        positions[:15, 0] += length * (-1) ** step
        kept, film = forces_of(old, positions, layout, length, REACH)
        fresh, fresh_film = forces_of(
            ContactList(layout, length, REACH), positions, layout, length, REACH
        )
        assert kept.tobytes() == fresh.tobytes(), f"step {step}: {np.abs(kept - fresh).max():.1e}"
        assert film == fresh_film


def test_list_is_kept_while_nodes_stay_within_half_the_skin():
    layout = layout_of(2, 10, 10)
    positions = scenes.generator(3).uniform(0, 0.3, (layout.nodes, 2))
    contacts = ContactList(layout, 0.5, REACH)
    first = contacts.pairs(positions)
    apart = np.where(np.arange(layout.nodes) % 2, 1.0, -1.0)[:, None] * (0.0, SKIN * REACH)
    assert contacts.pairs(positions + 0.49 * apart) is first
    assert contacts.pairs(positions + 0.51 * apart) is not first


def test_list_is_kept_while_nodes_move_in_a_uniform_shear():
    """What counts is how much two nodes in reach move against each other."""
    layout = layout_of(2, 10, 10)
    positions = scenes.generator(3).uniform(0, 0.3, (layout.nodes, 2))
    contacts = ContactList(layout, 0.5, REACH)
    first = contacts.pairs(positions)
    limit = SKIN / (1 + SKIN)
    for share, kept in ((0.99, True), (1.01, False)):
        moved = positions.copy()
        moved[:, 0] += 0.02 + share * limit * positions[:, 1]
        assert np.abs(moved - positions).max() > 2 * SKIN * REACH
        assert (contacts.pairs(moved) is first) == kept


@given(seeds, st.floats(-0.4, 0.4))
def test_a_kept_list_lacks_no_pair_after_shear_and_noise(seed, shear):
    layout, length = layout_of(6, 15, 15), 0.5
    random = scenes.generator(seed)
    positions = random.uniform(0, 1, (layout.nodes, 2)) * (length, 0.5)
    old = ContactList(layout, length, REACH)
    old.pairs(positions)
    for _ in range(4):
        positions = positions + 0.1 * SKIN * REACH * random.uniform(-1, 1, positions.shape)
        positions[:, 0] += 0.25 * shear * positions[:, 1]
        kept, film = forces_of(old, positions, layout, length, REACH)
        fresh, fresh_film = forces_of(
            ContactList(layout, length, REACH), positions, layout, length, REACH
        )
        assert kept.tobytes() == fresh.tobytes()
        assert film == fresh_film


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_list_is_rebuilt_when_a_node_is_lost(value):
    layout = layout_of(2, 10, 10)
    positions = scenes.generator(3).uniform(0, 0.3, (layout.nodes, 2))
    contacts = ContactList(layout, 0.5, REACH)
    first = contacts.pairs(positions)
    lost = positions.copy()
    lost[4, 0] = value
    assert contacts.pairs(lost) is not first
