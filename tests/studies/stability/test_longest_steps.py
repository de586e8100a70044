import numpy as np
import pytest
from scipy.optimize import brentq
from studies_small import SMALL_MAP

from softslip.errors import NumericalError
from softslip.solver.integrators.chebyshev import fixed_step, reach
from softslip.studies.stability import longest_steps

RATES = np.geomspace(1.0, 80.0, 30)
"""Decay rates of a problem whose limits are known."""

STIFF = np.append(np.zeros(29), 1.0) * np.sqrt(30)


def rate(vector, time):
    return -RATES * vector


def euler_step(vector, dt):
    return vector + dt * rate(vector, 0.0)


def test_bisection_finds_the_limit_of_euler():
    found = longest_steps.longest_stable(euler_step, np.ones(30), STIFF, np.ones(30), 2 / 75)
    assert found == pytest.approx(2 / 80, rel=longest_steps.WIDTH)


def exact_reach(stages):
    """Stiffness at which one step amplifies a mode by more than one, from the step itself."""

    def excess(stiffness):
        mode = fixed_step(lambda y, t: -stiffness * y, np.ones(1), 0.0, 1.0, stages)
        return abs(float(mode[0])) - 1.0

    return brentq(excess, reach(stages), 1.4 * reach(stages))


@pytest.mark.parametrize("stages", [2, 3, 8, 20])
def test_bisection_finds_the_limit_of_each_number_of_stages(stages):
    """That of the stability polynomial; the asymptotic theory's is shorter, by 18 % at three."""

    def step(vector, dt):
        return fixed_step(rate, vector, 0.0, dt, stages)

    found = longest_steps.longest_stable(step, np.ones(30), STIFF, np.ones(30), reach(stages) / 80)
    assert found == pytest.approx(exact_reach(stages) / 80, rel=2 * longest_steps.WIDTH)


def test_a_theory_that_is_far_off_is_no_result():
    with pytest.raises(NumericalError, match="not between"):
        longest_steps.longest_stable(euler_step, np.ones(30), STIFF, np.ones(30), 2 / 10)


def test_what_refuses_or_leaves_the_numbers_has_grown():
    def refuses(vector, dt):
        raise NumericalError("film", 0, 0, "closed")

    for step in (refuses, lambda vector, dt: vector * np.nan):
        assert longest_steps.grows(step, np.ones(30), STIFF, np.ones(30), 1e-3)


@pytest.fixture(scope="module")
def measured():
    small = SMALL_MAP.model_copy(update={"stages": (2, 6)})
    return longest_steps.measure_limits(small)


def test_the_limit_of_euler_steps_is_that_of_theory(measured):
    """To 2 %: the width of the bracket, and a spectral radius from below."""
    ratio = measured["euler_limit"].values / measured["euler_theory"].values
    assert np.abs(ratio - 1).max() < 0.02, ratio


def test_the_limit_of_fixed_stages_is_that_of_theory(measured):
    """To 2 %, of the stability polynomial."""
    exact = [exact_reach(int(s)) / float(reach(int(s))) for s in measured["stages"].values]
    ratio = measured["rkc2_limit"].values / measured["rkc2_theory"].values
    assert ratio == pytest.approx(np.array(exact), rel=0.02)


def test_stiff_tethers_are_what_limits_the_step(measured):
    stiff = measured["stiffness"].values > measured["stiffness"].values.min()
    assert measured["euler_limit"].values[stiff].max() < (
        measured["euler_limit"].values[~stiff].min()
    )


def test_every_variable_has_a_unit(measured):
    for name in measured.variables:
        assert measured[name].attrs["units"], name
        assert measured[name].attrs["long_name"], name
