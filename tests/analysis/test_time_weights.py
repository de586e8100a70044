"""Means over snapshots that are not evenly spread in time."""

import numpy as np
import pytest
import xarray as xr
from synthetic import generator

from softslip.analysis.observables.time_weights import snapshots_from, weighted


def taken(*times):
    return xr.Dataset({"snapshot_time": ("snapshot", np.array(times, dtype=float))})


def test_each_snapshot_stands_for_the_time_that_is_nearest_to_it():
    numbers, weights = snapshots_from(taken(1, 2, 4, 10, 100), 2.0)
    assert numbers.tolist() == [1, 2, 3, 4]
    # From 1 to 3, from 3 to 7, from 7 to 55 and from 55 to 145.
    assert weights == pytest.approx(np.array([2, 4, 48, 90]) / 144)


def test_evenly_spread_ones_weigh_alike():
    _, weights = snapshots_from(taken(*range(500, 1001, 100)), 450.0)
    assert weights == pytest.approx(np.full(6, 1 / 6))


@pytest.mark.parametrize(("start", "count"), [(150.0, 0), (80.0, 1)])
def test_none_and_one(start, count):
    numbers, weights = snapshots_from(taken(1, 2, 100), start)
    assert (len(numbers), weights.tolist()) == (count, [1.0] * count)
    mean, error, equal = weighted(np.full(count, 3.0), weights)
    assert float(equal) == count
    assert np.isnan(float(error))
    assert np.isnan(float(mean)) if count == 0 else float(mean) == 3.0


def test_without_snapshots_there_are_none():
    numbers, weights = snapshots_from(xr.Dataset(), 0.0)
    assert len(numbers) == len(weights) == 0


def test_equal_weights_give_the_usual_mean_and_error():
    values = generator(3).normal(size=(7, 2))
    values[2, 1] = np.nan
    mean, error, count = weighted(values, np.full(7, 0.2))
    for column, number in ((0, 7), (1, 6)):
        known = values[np.isfinite(values[:, column]), column]
        assert mean[column] == pytest.approx(known.mean())
        assert error[column] == pytest.approx(known.std(ddof=1) / np.sqrt(number))
        assert count[column] == pytest.approx(number)


def test_the_error_is_that_of_a_weighted_mean():
    """Of 4000 sets of independent values."""
    weights = np.array([0.3, 0.3, 0.1, 0.1, 0.1, 0.1])
    sets = generator(8).normal(size=(4000, 6))
    means, errors, count = zip(*(weighted(each, weights) for each in sets), strict=True)
    assert count[0] == pytest.approx(1 / np.sum(weights**2))
    true = np.sqrt(np.sum(weights**2))
    assert np.std(means) == pytest.approx(true, rel=0.04)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(true, rel=0.06)


def test_a_short_transient_weighs_as_little_as_it_lasts():
    """The list of the demo: a series that is 0 up to 20 and 1 from then on."""
    times = [2.5, 5, 7.5, 10, 12.5, 15, 17.5, 20, 25, 30, 40, 50, *range(500, 1001, 100)]
    numbers, weights = snapshots_from(taken(*times), 0.0)
    mean, _, _ = weighted(np.where(np.array(times)[numbers] <= 20, 0.0, 1.0), weights)
    assert float(mean) == pytest.approx(1 - 22.5 / (2.5 + 1047.5 - 2.5), abs=2e-3)
