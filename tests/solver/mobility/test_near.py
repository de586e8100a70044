"""The near functions against their integrals, and their table against the near functions."""

import math

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import j0, j1

from softslip.solver.mobility import near as module
from softslip.solver.neighbours import find_pairs

REACH = 22.0


def far(wavenumber, epsilon):
    return module.far_factor(np.array([wavenumber]), epsilon, REACH)[0]


@pytest.mark.parametrize("epsilon", [0.07, 0.8, 3.0])
def test_far_factor_has_the_moments_of_the_regularisation(epsilon):
    small = 1e-3 / REACH
    assert far(0.0, epsilon) == pytest.approx(1.0, rel=1e-13)
    curvature = (math.exp(-((epsilon * small) ** 2)) - far(small, epsilon)) / small**2
    # Near is O(k⁴): w₂ is about R²/16, so what is left is some k² R⁴/300.
    assert abs(curvature) < 1e-2 * small**2 * REACH**4 + 1e-9 * REACH**2


def test_far_mesh_leaves_out_little():
    beyond = np.linspace(module.MESH_REACH, 3 * module.MESH_REACH, 200) / REACH
    # In velocities these modes are divided by (kR)² > 100 more.
    assert np.abs(module.far_factor(beyond, 0.8, REACH)).max() < 1e-2


@pytest.mark.parametrize("distance", [0.3, 1.0, 4.0, 12.0, 20.0])
@pytest.mark.parametrize("epsilon", [0.8, 2.5])
def test_near_profiles_are_the_hankel_integrals(distance, epsilon):
    def near(k):
        return (math.exp(-((epsilon * k) ** 2)) - far(k, epsilon)) / k

    highest = 150 / REACH

    def transform(bessel):
        return quad(lambda k: near(k) * bessel(k * distance), 1e-9, highest, limit=2000)[0]

    ratio = transform(lambda x: j1(x) / x)
    plain = transform(j0)
    tangential, excess = module.near_profiles(np.array([distance]), epsilon, REACH)
    # Beyond the highest wavenumber the corner of the blob has an oscillating tail of 4e-3/(kR),
    # whose integral is below this.
    left_out = 4e-3 / 150
    assert tangential[0] == pytest.approx(plain - ratio, abs=left_out)
    assert excess[0] == pytest.approx(2 * ratio - plain, abs=left_out)


@pytest.mark.parametrize("epsilon", [0.05, 0.8, 2.0])
def test_near_sum_ends_at_the_reach_by_itself(epsilon):
    profiles = module.near_profiles(np.array([REACH]), epsilon, REACH)
    # What the regularised force itself has beyond the reach, at most.
    left = math.exp(-((0.5 * REACH / epsilon) ** 2))
    assert np.abs(profiles).max() < 1e-13 + left


@pytest.mark.parametrize("epsilon", [0.01, 0.8, 3.0])
def test_near_profiles_meet_the_value_at_zero_distance(epsilon):
    tangential, excess = module.near_profiles(np.array([1e-3 * epsilon]), epsilon, REACH)
    assert tangential[0] == pytest.approx(module.near_on_itself(epsilon, REACH), rel=1e-5)
    assert abs(excess[0]) < 1e-5


@given(st.floats(0.003, 0.9).map(lambda ratio: ratio * REACH / 5.5), st.integers(0, 2**31))
def test_table_is_the_closed_forms_at_any_distance(epsilon, seed):
    random = scenes.generator(seed)
    wide = REACH * np.sqrt(random.random(500))
    tiny = epsilon * 10 ** random.uniform(-6, 1, 500)
    distance = np.concatenate((wide, tiny[tiny < REACH]))
    table, first = module.near_table(epsilon, REACH)
    functions = np.empty((len(distance), 2))
    module._look_up(distance**2, len(distance), table, first, functions.reshape(-1))
    tangential, excess = module.near_profiles(np.maximum(distance, 1e-3 * epsilon), epsilon, REACH)
    for found, exact in (
        (functions[:, 0], tangential),
        (functions[:, 1] * distance**2, np.where(distance > 1e-3 * epsilon, excess, 0.0)),
    ):
        error = np.abs(found - exact)
        # Two leading terms of the parabolas' error; in the last cell the blob ends in a corner.
        assert error[distance < 0.99 * REACH].max() < 5e-6, f"{error.max():.1e}"
        assert error.max() < 1e-4, f"{error.max():.1e}"


def test_table_starts_at_the_value_on_itself():
    table, first = module.near_table(0.8, REACH)
    functions = np.empty(2)
    module._look_up(np.zeros(1), 1, table, first, functions)
    assert functions[0] == pytest.approx(module.near_on_itself(0.8, REACH), rel=1e-6)


def twin(positions, forces, pairs, length, epsilon):
    velocities = np.zeros_like(forces)
    for i, j in pairs:
        arm = positions[j] - positions[i]
        arm[0] -= length * np.round(arm[0] / length)
        distance = math.hypot(*arm)
        if distance < REACH:
            tangential, excess = module.near_profiles(np.array([distance]), epsilon, REACH)
            block = tangential * np.eye(2) + excess * np.outer(arm, arm) / distance**2
            velocities[i] += block @ forces[j]
            velocities[j] += block @ forces[i]
    return velocities


@pytest.mark.parametrize("count", [2, 7, 60])
def test_pairs_are_those_of_a_plain_sum(count):
    random, length = scenes.generator(count), 100.0
    positions = random.random((count, 2)) * (3 * length, 60.0) - (length, 0.0)
    forces = random.standard_normal((count, 2))
    starts, partners = find_pairs(positions, np.arange(count), count, length, 1.3 * REACH)
    pairs = list(zip(np.repeat(np.arange(count), np.diff(starts)), partners, strict=True))
    exact = twin(positions, forces, pairs, length, 0.8)
    found = np.zeros_like(forces)
    table = module.near_table(0.8, REACH)
    listed = starts, partners.astype(np.uint32)
    number = module.add_near(positions, forces, *listed, length, REACH, *table, 1.0, found)
    # The table's own error, a few terms of it.
    assert np.abs(found - exact).max() < 1e-4 * max(1.0, np.abs(exact).max())
    assert number <= len(partners)
    rigid = np.zeros_like(forces)
    close = find_pairs(positions, np.arange(count), count, length, REACH)
    operator = module.RigidPairs(positions, *close, length, *table, 1.0)
    operator.add(forces, rigid)
    assert number == operator.pairs
    assert np.abs(rigid - found).max() < 1e-11
