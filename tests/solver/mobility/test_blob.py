"""The blob against its integrals, and what it leaves to the near sum against the definition."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import j0, j1

from softslip.solver.mobility import blob as module
from softslip.solver.mobility.blob import Blob

ratios = st.floats(1e-4, 0.18)
"""ε/R: a reach is at least 5.5 times 1.5 ε."""


@given(ratios)
def test_far_factor_has_the_moments_of_the_regularisation(ratio):
    small = 1e-2
    strength, far = Blob.fitted(ratio).far_factor(np.array([0.0, small]))
    assert strength == pytest.approx(1.0, rel=1e-13)
    # Near is O(k⁴), with a coefficient well below one.
    assert abs(math.exp(-((ratio * small) ** 2)) - far) < 0.1 * small**4 + 1e-14


@given(ratios)
def test_far_mesh_leaves_out_little(ratio):
    beyond = np.linspace(module.MESH_REACH, 3 * module.MESH_REACH, 200)
    # In velocities these modes are divided by (kR)² > 100 more.
    assert np.abs(Blob.fitted(ratio).far_factor(beyond)).max() < 1e-2


@given(ratios)
def test_the_density_has_the_transform_that_is_used(ratio):
    blob = Blob.fitted(ratio)
    density = np.polynomial.Legendre(blob.weights)
    for k in (0.5, 4.0, 9.0, 17.0):
        # Within R: 2π r dr of density/πR² is density dx.
        found = quad(lambda x, k=k: density(1 - 2 * x) * j0(k * math.sqrt(x)), 0, 1)[0]
        assert blob.far_factor(np.array([k]))[0] == pytest.approx(found, abs=1e-9)


@pytest.mark.parametrize("x", [0.0005, 0.003, 0.05, 0.3, 0.8])
@pytest.mark.parametrize("ratio", [0.04, 0.12])
def test_profiles_are_the_hankel_integrals(x, ratio):
    blob, distance = Blob.fitted(ratio), math.sqrt(x)

    def near(k):
        return (math.exp(-((ratio * k) ** 2)) - blob.far_factor(np.array([k]))[0]) / k

    highest = 150

    def transform(bessel):
        return quad(lambda k: near(k) * bessel(k * distance), 1e-9, highest, limit=2000)[0]

    ratio_of_bessel = transform(lambda z: j1(z) / z)
    plain = transform(j0)
    tangential, excess = blob.profiles(np.array([x]))
    # Beyond the highest wavenumber the edge of the blob has an oscillating tail of 0.1/k^1.5.
    left_out = 0.1 / highest**1.5
    assert tangential[0] == pytest.approx(plain - ratio_of_bessel, abs=left_out)
    assert excess[0] == pytest.approx(2 * ratio_of_bessel - plain, abs=left_out)


@given(ratios)
def test_near_sum_ends_at_the_reach_by_itself(ratio):
    profiles = Blob.fitted(ratio).profiles(np.array([1.0]))
    # What the regularised force itself has beyond the reach, at most.
    left = math.exp(-((0.5 / ratio) ** 2))
    assert np.abs(profiles).max() < 1e-13 + left


@given(ratios)
def test_profiles_meet_the_value_at_zero_distance(ratio):
    blob = Blob.fitted(ratio)
    tangential, excess = blob.profiles(np.array([(1e-3 * ratio) ** 2]))
    assert tangential[0] == pytest.approx(blob.on_itself(), rel=1e-5, abs=1e-6)
    assert abs(excess[0]) < 1e-5
