import numpy as np
import pytest
import scenes
import twins
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from softslip.solver.geometry import Layout
from softslip.solver.neighbours import SKIN, ContactList, find_pairs
from softslip.solver.steric import ContactForces

REACH = 0.1

seeds = st.integers(0, 2**31)


def configuration(seed, length, bodies=5, per_body=12, height=0.6):
    """Random nodes of some bodies and two walls, x well beyond one period."""
    random = scenes.generator(seed)
    count = (bodies + 2) * per_body
    positions = random.uniform(0, 1, (count, 2)) * (3 * length, height) - (length, 0)
    return positions, np.repeat(np.arange(bodies + 2), per_body), bodies


def listed(starts, partners):
    return np.repeat(np.arange(len(starts) - 1), np.diff(starts)), partners


def assert_same_pairs(found, wanted):
    found, wanted = (set(zip(*pairs, strict=True)) for pairs in (found, wanted))
    assert found == wanted, f"missing {wanted - found}, too many {found - wanted}"


@given(seeds, st.sampled_from([0.08, 0.11, 0.19, 0.21, 0.29, 0.31, 0.39, 0.41, 1.7]))
def test_pairs_are_those_of_brute_force(seed, length):
    """Boxes of one, two, three and many cell columns."""
    positions, body, walls_from = configuration(seed, length)
    found = find_pairs(positions, body, walls_from, length, REACH)
    wanted = twins.close_pairs(positions, body, walls_from, length, REACH)
    assert_same_pairs(listed(*found), wanted)


@given(seeds, st.floats(1e-3, 0.3))
@settings(max_examples=10)
def test_pairs_are_those_of_a_k_d_tree(seed, reach):
    """Of thousands of nodes, across the period too, but not within a body or between walls."""
    positions, body, walls_from = configuration(seed, 1.0, bodies=40, per_body=60)
    tree = cKDTree(positions % (1.0, np.inf), boxsize=(1.0, 0.0))
    close = tree.query_pairs(reach, output_type="ndarray")
    first, second = body[close].T
    close = close[(first != second) & (np.minimum(first, second) < walls_from)]
    starts, partners = find_pairs(positions, body, walls_from, 1.0, reach)
    assert len(partners) == len(close)
    assert_same_pairs(listed(starts, partners), np.sort(close, axis=1).T)


@given(seeds, st.floats(1e-3, 0.5))
def test_flat_configurations_are_searched_too(seed, height):
    positions, body, walls_from = configuration(seed, 0.7, height=height)
    found = find_pairs(positions, body, walls_from, 0.7, REACH)
    assert_same_pairs(listed(*found), twins.close_pairs(positions, body, walls_from, 0.7, REACH))


@given(seeds)
def test_partners_come_in_ascending_order_above_their_node(seed):
    starts, partners = find_pairs(*configuration(seed, 0.5), 0.5, REACH)
    for i in range(len(starts) - 1):
        own = partners[starts[i] : starts[i + 1]]
        assert np.all(np.diff(own, prepend=i) > 0), f"node {i}: {own}"


def test_crowded_nodes_are_all_found():
    """More partners than the first buffer holds, and more pairs than the first list."""
    random = scenes.generator(2)
    positions = random.uniform(0, 0.01, (300, 2))
    body = np.arange(300) % 2
    starts, _ = find_pairs(positions, body, 2, 1.0, REACH)
    assert starts[-1] == 150 * 150


def test_no_nodes_make_no_pairs():
    starts, partners = find_pairs(np.empty((0, 2)), np.empty(0, np.int64), 0, 1.0, REACH)
    assert starts.tolist() == [0]
    assert not len(partners)


def test_a_node_that_is_no_number_does_not_crash_the_search():
    positions, body, walls_from = configuration(1, 0.5)
    positions[7] = np.nan
    starts, partners = find_pairs(positions, body, walls_from, 0.5, REACH)
    assert starts[-1] == len(partners)
    assert np.all((partners >= 0) & (partners < len(positions)))


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
