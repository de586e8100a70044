import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.simulation.known_mean import BATCHES, GROWTH, is_known, look_times, relative_error

EDGES = np.arange(0.0, 1001.0)


def fluctuating(seed, correlation, noise, mean=2.0, edges=EDGES):
    """Records whose fluctuations forget themselves in ``correlation`` records."""
    kept = np.exp(-1 / correlation)
    kicks = scenes.generator(seed).standard_normal(edges.size - 1)
    values = np.empty(kicks.size)
    values[0] = kicks[0]
    for index in range(1, kicks.size):
        values[index] = kept * values[index - 1] + np.sqrt(1 - kept**2) * kicks[index]
    return mean * (1 + noise * values)


@pytest.mark.parametrize("correlation", [0.5, 2, 5])
@pytest.mark.parametrize("noise", [0.1, 0.4])
def test_stated_errors_are_those_of_the_mean(correlation, noise):
    """Over 600 runs; those with a trend by chance, a twentieth, state none."""
    draws = [fluctuating(seed, correlation, noise) for seed in range(600)]
    stated = np.array([relative_error(EDGES, draw) for draw in draws])
    true = np.array([draw[500:].mean() / 2.0 - 1 for draw in draws])
    known = np.isfinite(stated)
    assert known.mean() > 0.85
    assert np.sqrt(np.mean(stated[known] ** 2)) == pytest.approx(true[known].std(), rel=0.15)


@pytest.mark.parametrize(("correlation", "wanted"), [(1.0, 0.03), (3.0, 0.03), (10.0, 0.05)])
def test_a_run_that_ends_by_its_error_knows_its_mean_as_well_as_it_says(correlation, wanted):
    """Looking again and again finds errors that are small by luck: a fifth too small at most."""
    edges = np.arange(0.0, 2501.0)
    looks, found = look_times(edges), []
    for seed in range(200):
        series = fluctuating(seed, correlation, 0.2, edges=edges)
        for look in looks:
            if is_known(looks, edges, series, look, wanted):
                found.append(series[int(look) // 2 : int(look)].mean() / 2.0 - 1)
                break
    assert len(found) > 195
    assert 0.5 * wanted < np.std(found) < 1.3 * wanted


def test_a_mean_is_known_at_looks_only_and_at_the_second_at_the_earliest():
    looks, series = look_times(EDGES), np.full(1000, 0.3)
    known = [time for time in EDGES if is_known(looks, EDGES, series, time, 0.01)]
    assert known == looks[1:].tolist()


@pytest.mark.parametrize(
    "shape",
    [
        lambda time: 1 + time / 300,
        lambda time: time**-0.7,
        lambda time: np.where(time < 800, 1.0, 3.0),
    ],
    ids=["rises", "creeps as a power", "yields late"],
)
def test_what_still_changes_has_no_error(shape):
    noise = fluctuating(3, 2.0, 0.05, mean=1.0)
    middles = 0.5 * (EDGES[1:] + EDGES[:-1])
    assert relative_error(EDGES, shape(middles) * noise) == np.inf


def test_constants_are_known_exactly_and_zero_never():
    assert relative_error(EDGES, np.full(1000, 0.3)) == 0
    assert relative_error(EDGES, np.full(1000, 1e-30)) == 0
    assert relative_error(EDGES, np.zeros(1000)) == np.inf
    around_zero = fluctuating(1, 0.5, 0.3) - 2.0
    assert relative_error(EDGES, around_zero) > 0.3


@given(st.floats(1e-12, 1e12), st.floats(1e-6, 1e6), st.integers(0, 99))
def test_it_does_not_depend_on_units(unit, time_unit, seed):
    series = fluctuating(seed, 2.0, 0.2)
    wanted = relative_error(EDGES, series)
    assert relative_error(time_unit * EDGES, unit * series) == pytest.approx(wanted, rel=1e-9)


@given(st.lists(st.floats(1e-3, 5.0), min_size=1, max_size=900))
def test_looks_grow_geometrically_and_have_enough_records(widths):
    edges = np.concatenate(([0.0], np.cumsum(widths)))
    looks = look_times(edges)
    assert np.all(looks[1:] >= GROWTH * looks[:-1])
    for look in looks:
        inside = (edges > 0.5 * look) & (edges <= look)
        assert inside.sum() >= 4 * BATCHES


@given(st.integers(1, 1000), st.integers(0, 1000))
def test_looks_do_not_depend_on_how_long_a_run_is(records, more):
    edges = np.arange(records + more + 1.0)
    longer = look_times(edges)
    assert look_times(edges[: records + 1]).tolist() == longer[longer <= records].tolist()
