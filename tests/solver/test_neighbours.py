import numpy as np
import scenes
import twins
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from softslip.solver.neighbours import find_pairs

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
