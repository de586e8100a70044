"""Whether walls slip by a film, and intervals of laws that have branches."""

import numpy as np
import pytest

from softslip.analysis.fits.likelihood import Optimum, Problem, optimum, profile_interval
from softslip.analysis.fits.measured_points import Points
from softslip.analysis.fits.slip import has_film

STRESS = np.array([0.01, 0.02, 0.03, 0.04])


def slipping(coefficient: float, error: float, freedom: float) -> Points:
    """Return points V = ν_N σ that all have one error."""
    every = np.full(len(STRESS), error), np.full(len(STRESS), freedom)
    return Points(
        STRESS, 0 * STRESS, coefficient * STRESS, *every, common=float(freedom * len(STRESS))
    )


@pytest.mark.parametrize(("freedom", "clear"), [(1e6, True), (1.0, False)])
def test_a_film_counts_how_few_samples_its_errors_are_known_from(freedom: float, clear: bool):
    # The coefficient is 2.5 of its errors.
    error = 1.2e-3 * np.sqrt(STRESS @ STRESS) / 2.5
    assert has_film(slipping(1.2e-3, error, freedom)) is clear


@pytest.mark.parametrize("coefficient", [0.0, -1.2e-3])
def test_there_is_no_film_where_walls_do_not_slip(coefficient: float):
    assert not has_film(slipping(coefficient, 1e-6, 1e6))


def test_there_is_no_film_without_points():
    assert not has_film(slipping(1.2e-3, 1e-6, 1e6).where(STRESS < 0))


def two_valleys() -> Problem:
    """Return a problem with parameters (a, b): for each a there are minima at b near 1 and −1.

    That near −1 is the least for a < 0, and rises less steeply.
    """

    def deviations(parameters):
        a, b = parameters
        deep, flat = 10 * (b - 1), 10 * (b + 1)
        ways = np.array([[deep, 3 * a], [flat, a + 0.5]])
        return ways[np.argmin((ways**2).sum(axis=1))]

    return Problem(deviations, np.full(2, 1e6), 2e6)


def test_an_interval_of_a_law_with_branches_reaches_into_the_other_one():
    problem = two_valleys()
    found = optimum(problem, [np.array([0.1, 0.9])])
    assert isinstance(found, Optimum)
    direction = np.array([1.0, 0.0])
    one_way = profile_interval(problem, found, direction, 0.6827, 1.0)
    both = profile_interval(problem, found, direction, 0.6827, 1.0, [np.array([0.0, -0.9])])
    assert one_way[0] == pytest.approx(-1 / 3, abs=0.02)
    # The other valley is as deep as that at a = −1.5.
    assert both[0] == pytest.approx(-1.5, abs=0.02)
    assert both[1] >= one_way[1] - 1e-6
