"""Clusters of nodes: slots, and pairs of clusters against pairs of nodes."""

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.solver.clusters import SIZE, Slots
from softslip.solver.neighbours import find_pairs


def slots_of(sizes):
    return Slots(np.append(0, np.cumsum(sizes)))


groups = st.lists(st.integers(0, 14), min_size=1, max_size=4)


@given(groups)
def test_no_cluster_has_nodes_of_both_groups(sizes):
    slots = slots_of(sizes)
    group = np.repeat(np.arange(len(sizes)), sizes)
    for cluster in range(slots.clusters):
        assert len(np.unique(group[slots.of_nodes // SIZE == cluster])) == 1
    assert np.all(np.diff(slots.of_nodes.astype(int)) > 0)
    assert slots.clusters == sum(-(-size // SIZE) for size in sizes)


@given(groups, st.integers(0, 2**31))
def test_values_come_back_from_their_slots(sizes, seed):
    slots, random = slots_of(sizes), scenes.generator(seed)
    values, others = random.random((2, slots.nodes, 2))
    one, other = slots.values(), slots.values()
    slots.fill(values, 1.0, one)
    slots.fill(others, 0.5, other)
    found = np.empty_like(values)
    slots.sum_of(one, other, 4.0, found)
    assert np.array_equal(found, values + 4.0 * (0.5 * others))
    slots.add(other, -4.0, found)
    assert found == pytest.approx(values, abs=1e-15)
    empty = np.ones(slots.count, bool)
    empty[slots.of_nodes] = False
    assert not one[:, empty].any()


@given(groups)
def test_slots_without_a_node_are_out_of_every_reach(sizes):
    slots = slots_of(sizes)
    places = slots.places()
    slots.fill(np.zeros((slots.nodes, 2)), 1.0, places)
    empty = np.flatnonzero(places[0])
    apart = np.abs(places[:, empty, None] - places[:, None, :]).min(axis=0)
    apart[np.arange(empty.size), empty] = np.inf
    assert np.all(apart > 1e6)


@given(groups, st.integers(0, 2**31), st.sampled_from([0.05, 0.3, 2.0]))
def test_pairs_of_clusters_are_those_of_their_nodes(sizes, seed, reach):
    slots = slots_of(sizes)
    positions = scenes.generator(seed).random((slots.nodes, 2))
    listed = find_pairs(positions, np.arange(slots.nodes), slots.nodes, 1.0, reach)
    starts, partners = slots.pairs(*listed)
    wanted = set()
    for i in range(slots.nodes):
        for j in listed[1][listed[0][i] : listed[0][i + 1]]:
            wanted.add((slots.of_nodes[i] // SIZE, slots.of_nodes[j] // SIZE))
    assert len(starts) == slots.clusters + 1
    first = np.repeat(np.arange(slots.clusters), np.diff(starts))
    found = list(zip(first.tolist(), partners.tolist(), strict=True))
    assert found == sorted(wanted)


@pytest.mark.parametrize("count", [0, 1])
def test_a_node_alone_has_no_pair(count):
    slots = Slots([0, count])
    starts, partners = slots.pairs(*find_pairs(np.zeros((count, 2)), np.arange(count), 1, 1.0, 0.1))
    assert starts.tolist() == [0] * (slots.clusters + 1)
    assert not partners.size
