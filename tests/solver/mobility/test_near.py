"""The near sum over clusters against its functions in closed form, pair by pair."""

import numpy as np
import pytest
import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from softslip.solver.clusters import Slots
from softslip.solver.mobility import near as module
from softslip.solver.mobility.blob import Blob
from softslip.solver.mobility.rigid import RigidPairs
from softslip.solver.neighbours import find_pairs

ERROR = 3e-7
"""What the polynomials for the logarithm and for close pairs miss of 2πη T."""

ratios = st.floats(1e-4, 0.18)


class Sum:
    """A near sum with all that it needs, in units of the reach."""

    def __init__(self, ratio, positions, length, *, second=0, skin=0.1):
        count = len(positions)
        self.blob, self.length = Blob.fitted(ratio), length
        self.slots = Slots([0, count - second, count])
        self.sum = module.NearSum(self.blob, self.slots, length)
        self.listed = find_pairs(positions, np.arange(count), count - second, length, 1 + skin)
        self.places = self.slots.places()
        self.slots.fill(positions, 1.0, self.places)

    def velocities(self, forces):
        """Return the near velocities and the number of pairs."""
        given, found = self.slots.values(), self.slots.values()
        self.slots.fill(forces, 1.0, given)
        number = self.sum.fill(self.places, given, self.listed, found)
        result = np.empty_like(forces)
        self.slots.sum_of(found, found, 0.0, result)
        return result, number


def twin(positions, forces, length, blob):
    """Return the same from every pair within the reach, one by one."""
    velocities, number = blob.on_itself() * forces, 0
    for i in range(len(positions)):
        for j in range(i):
            arm = positions[j] - positions[i]
            arm[0] -= length * np.round(arm[0] / length)
            x = float(arm @ arm)
            if x >= 1:
                continue
            number += 1
            if x == 0:
                block = blob.on_itself() * np.eye(2)
            else:
                tangential, excess = blob.profiles(np.array([x]))
                block = tangential * np.eye(2) + excess * np.outer(arm, arm) / x
            velocities[i] += block @ forces[j]
            velocities[j] += block @ forces[i]
    return velocities, number


def cloud(seed, count, length, height=3.0):
    random = scenes.generator(seed)
    positions = random.random((count, 2)) * (3 * length, height) - (length, 0.0)
    return positions, random.standard_normal((count, 2))


@given(ratios, st.integers(0, 2**31))
def test_functions_are_the_closed_forms_at_any_distance(ratio, seed):
    """From a millionth of ε to the reach, where it ends; accuracies stated in the module."""
    random = scenes.generator(seed)
    x = np.concatenate((random.random(300), (ratio * 10 ** random.uniform(-6, 2, 300)) ** 2))
    x = np.concatenate((x[x < 1], [1 - 1e-15]))
    positions = np.zeros((2 * len(x), 2))
    # Pairs of nodes far from all others, along x; a force along it or across it.
    positions[:, 1] = 10.0 * np.repeat(np.arange(len(x)), 2)
    positions[1::2, 0] = np.sqrt(x)
    sums, blob = Sum(ratio, positions, 50.0), Blob.fitted(ratio)
    kept = np.maximum(positions[1::2, 0] ** 2, (1e-4 * ratio) ** 2)
    tangential, excess = blob.profiles(kept)
    for axis, wanted in ((0, tangential + excess), (1, tangential)):
        forces = np.zeros_like(positions)
        forces[::2, axis] = 1.0
        found, number = sums.velocities(forces)
        assert number == np.sum(positions[1::2, 0] ** 2 < 1)
        assert np.abs(found[1::2, axis] - wanted).max() < ERROR
        assert np.abs(found[1::2, 1 - axis]).max() < ERROR


@settings(max_examples=30)
@given(
    ratios,
    st.integers(0, 2**31),
    st.integers(1, 60),
    st.sampled_from([3.0, 4.5, 20.0]),
)
def test_pairs_are_those_of_a_plain_sum(ratio, seed, count, length):
    positions, forces = cloud(seed, count, length)
    exact, number = twin(positions, forces, length, Blob.fitted(ratio))
    found, counted = Sum(ratio, positions, length).velocities(forces)
    assert counted == number
    assert np.abs(found - exact).max() < 2 * ERROR * np.abs(forces).sum(axis=0).max()


def test_pairs_are_as_many_as_a_tree_finds():
    positions, forces = cloud(1, 3000, 30.0, height=40.0)
    inside = positions % (30.0, np.inf)
    tree = cKDTree(inside, boxsize=(30.0, 1e4))
    assert Sum(0.01, positions, 30.0).velocities(forces)[1] == len(tree.query_pairs(1.0))


@given(ratios, st.integers(0, 2**31), st.integers(2, 40))
def test_the_sum_is_symmetric(ratio, seed, count):
    """What one node's force does to another is what the other's does to it."""
    positions, forces = cloud(seed, count, 4.5)
    others = scenes.generator(seed, 1).standard_normal((count, 2))
    sums = Sum(ratio, positions, 4.5)
    left = np.sum(others * sums.velocities(forces)[0])
    right = np.sum(forces * sums.velocities(others)[0])
    assert abs(left - right) < 1e-12 * count**2


@pytest.mark.parametrize("seed", range(5))
def test_an_old_list_gives_the_same_bytes(seed):
    """Pairs beyond the reach add nothing, wherever they stand in the list."""
    positions, forces = cloud(seed, 90, 4.5)
    plain, number = Sum(0.02, positions, 4.5, skin=0.0).velocities(forces)
    for skin in (0.05, 0.2, 0.5):
        found, counted = Sum(0.02, positions, 4.5, skin=skin).velocities(forces)
        assert found.tobytes() == plain.tobytes()
        assert counted == number


def test_nodes_in_one_place_move_alike():
    positions, forces = np.zeros((7, 2)), scenes.generator(3).standard_normal((7, 2))
    found, number = Sum(0.1, positions, 3.0).velocities(forces)
    assert number == 21
    wanted = Blob.fitted(0.1).on_itself() * forces.sum(axis=0)
    assert np.abs(found - wanted).max() < 20 * ERROR


def test_two_groups_leave_out_pairs_of_the_second():
    positions, forces = cloud(4, 50, 4.5)
    every, _ = Sum(0.05, positions, 4.5).velocities(forces)
    some, _ = Sum(0.05, positions, 4.5, second=13).velocities(forces)
    rigid = np.zeros((13, 2))
    blob, listed = Blob.fitted(0.05), find_pairs(positions[37:], np.arange(13), 13, 4.5, 1.0)
    operator = RigidPairs(positions[37:], *listed, 4.5, blob, 1.0, 1.0)
    operator.add(forces[37:], rigid)
    assert operator.pairs > 5
    some[37:] += rigid
    assert np.abs(every - some).max() < 2 * ERROR * 50


@pytest.mark.parametrize("count", [1, 3, 4, 5])
def test_a_node_alone_has_its_own_velocity_only(count):
    positions = np.column_stack((np.zeros(count), 5.0 * np.arange(count)))
    forces = scenes.generator(count).standard_normal((count, 2))
    found, number = Sum(0.05, positions, 3.0).velocities(forces)
    assert number == 0
    assert found.tobytes() == (Blob.fitted(0.05).on_itself() * forces).tobytes()
