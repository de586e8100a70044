import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from softslip.analysis.explorer.thinning import TOLERANCES, thinned

X = np.geomspace(0.01, 1000, 60)


def curves(number, runs=5):
    random = np.random.default_rng(number)
    return np.exp(np.cumsum(random.normal(0, 0.1, (runs, len(X))), axis=1)) * X**-0.7


def on_axes(x, y):
    """Places on two axes that are 1 long each."""
    placed = [np.log(x), np.log(y)]
    return [
        (each - np.nanmin(whole)) / np.ptp(whole)
        for each, whole in zip(placed, (np.log(X), np.log(y)), strict=True)
    ]


def test_nothing_is_left_out_of_few_curves():
    found = thinned(X, curves(1), logarithmic=True)
    assert (found.tolerance, found.share) == (0.0, 1.0)
    assert all(kept.tolist() == list(range(len(X))) for kept in found.kept)


@given(st.integers(0, 1000), st.integers(10, 300))
def test_what_is_left_out_lies_within_the_tolerance_of_the_line(number, most):
    values = curves(number)
    found = thinned(X, values, logarithmic=True, most=most)
    assert sum(map(len, found.kept)) <= most or found.tolerance == TOLERANCES[-1]
    x, y = on_axes(X, values)
    for kept, height in zip(found.kept, y, strict=True):
        assert kept[0] == 0
        assert kept[-1] == len(X) - 1
        assert (np.diff(kept) > 0).all()
        line = shapely.linestrings(np.column_stack((x[kept], height[kept])))
        apart = shapely.distance(line, shapely.points(x, height)).max()
        assert apart <= found.tolerance * (1 + 1e-9), f"{apart} > {found.tolerance}"


@pytest.mark.parametrize("most", [1, 10_000])
@pytest.mark.parametrize("hole", [np.nan, -1.0, 0.0])
def test_a_gap_stays_a_gap_on_logarithmic_axes(hole, most):
    values = curves(2, runs=1)
    values[0, 20:25] = hole
    values[0, 40:] = np.nan
    (kept,) = thinned(X, values, logarithmic=True, most=most).kept
    drawn = [point for point in kept if values[0, point] > 0]
    assert {0, 19, 25, 39} <= set(drawn), "the ends of a stretch are left out"
    assert [point for point in kept if point not in drawn] == [20, 40]


def test_a_curve_without_any_number_has_one_gap():
    found = thinned(X, np.full((1, len(X)), np.nan), logarithmic=True)
    assert found.kept[0].tolist() == [0]
