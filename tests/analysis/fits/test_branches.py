"""How far the deviance of a law of two branches scatters where it is true."""

import numpy as np
import pytest
from scipy import optimize

from softslip.analysis.fits.branches import _least, quantile_factors

STRESS = np.array([0.02, 0.04, 0.08, 0.16, 0.3, 0.5])

ONSET, COEFFICIENT, NEWTONIAN = 0.06, 2.0, 1.2
"""The branches cross at σ = 0.15."""


def speeds(stress, onset, coefficient, newtonian):
    """Return the slip velocity of the faster branch."""
    return np.maximum(newtonian * stress, coefficient * (stress - onset))


def searched(drawn, error, onset=None):
    """Return the least deviance by a search from many places, slow and without any case."""

    def deviance(parameters):
        start = parameters[2] if onset is None else onset
        z = drawn - speeds(STRESS, start, *parameters[:2]) / error
        return float(z @ z)

    starts = [
        np.array([slope, film, begin])
        for slope in (1.5, 2.0, 3.0)
        for film in (0.9, 1.2, 1.5)
        for begin in ((0.0, 0.05, 0.1) if onset is None else (0.0,))
    ]
    ends = (
        optimize.minimize(
            deviance,
            start if onset is None else start[:2],
            method="Nelder-Mead",
            options={"xatol": 1e-9, "fatol": 1e-10, "maxiter": 4000, "maxfev": 4000},
        )
        for start in starts
    )
    return min(end.fun for end in ends)


@pytest.mark.parametrize("onset", [None, ONSET, 0.1])
def test_the_least_deviance_is_that_of_a_search(onset):
    random = np.random.default_rng(5)
    error = 0.06 * speeds(STRESS, ONSET, COEFFICIENT, NEWTONIAN)
    drawn = speeds(STRESS, ONSET, COEFFICIENT, NEWTONIAN) / error + random.normal(size=(12, 6))
    least = _least(drawn, STRESS, error, onset)
    for deviance, values in zip(least, drawn, strict=True):
        assert deviance == pytest.approx(searched(values, error, onset), abs=1e-5)


def test_where_the_crossing_is_plain_the_quantiles_are_those_of_chi_square():
    stress = np.array([0.01, 0.02, 0.03, 0.04, 0.4, 0.6, 0.8, 1.0])
    error = 1e-3 * speeds(stress, ONSET, COEFFICIENT, NEWTONIAN)
    factors = quantile_factors(stress, error, np.array([ONSET, COEFFICIENT, NEWTONIAN]))
    # Quantiles of 1000 draws: 5 % of χ² at 68 %, 8 % at 95 %.
    assert factors == pytest.approx([1.0, 1.0], abs=0.16)


def test_where_points_may_belong_to_either_branch_they_are_larger():
    stress = np.array([0.01, 0.02, 0.03, 0.04, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5])
    error = 0.1 * speeds(stress, ONSET, COEFFICIENT, NEWTONIAN)
    factors = quantile_factors(stress, error, np.array([ONSET, COEFFICIENT, NEWTONIAN]))
    assert factors[0] > 1.15


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e4])
def test_they_do_not_depend_on_units(unit):
    error = 0.1 * speeds(STRESS, ONSET, COEFFICIENT, NEWTONIAN)
    parameters = np.array([ONSET, COEFFICIENT, NEWTONIAN])
    once = quantile_factors(STRESS, error, parameters)
    scaled = quantile_factors(STRESS * unit, error * unit, parameters * [unit, 1.0, 1.0])
    assert scaled == pytest.approx(once, rel=1e-6)
