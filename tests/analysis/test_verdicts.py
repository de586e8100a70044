"""Correlation, transients, creep and the verdicts on series."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import generator, red_noise

from softslip.analysis.observables.correlation import change_of, correlation_time, mean_of
from softslip.analysis.observables.falling import falls_as_power
from softslip.analysis.observables.truncation import steady_start, truncation
from softslip.analysis.observables.verdicts import (
    DRIFTING,
    STEADY,
    TOO_SHORT,
    WITHIN_ERROR,
    has_not_flowed,
    judged,
)

TIME = np.arange(1000) + 0.5


def verdict(values, falls=True):
    return judged(values, values, falls)[1]


@pytest.mark.parametrize("memory", [2, 10])
def test_correlation_time_is_that_of_the_noise(memory):
    keep = np.exp(-1 / memory)
    true = (1 + keep) / (1 - keep)
    found = [correlation_time(red_noise(4000, memory, generator(n, 1))) for n in range(30)]
    assert np.mean(found) == pytest.approx(true, rel=0.15)


def test_correlation_time_of_independent_values_is_one():
    found = [correlation_time(generator(n, 2).standard_normal(500)) for n in range(30)]
    assert np.median(found) == pytest.approx(1.0, abs=0.1)
    assert correlation_time(np.ones(50)) == 1.0


def test_a_constant_series_has_no_error():
    assert mean_of(np.full(100, 3.0)).error == 0
    found = change_of(np.full(100, 3.0))
    assert (found.value, found.error, found.chance) == (0.0, 0.0, 1.0)


def test_the_change_of_a_line_is_known_exactly():
    found = change_of(2.0 - TIME / 1000)
    assert found.value == pytest.approx(-1.0)
    assert found.chance < 1e-6


@settings(max_examples=30, deadline=None)
@given(st.floats(1e-12, 1e12), st.integers(0, 1000))
def test_verdicts_do_not_depend_on_units(scale, number):
    values = (1 + 3 * np.exp(-TIME / 15)) * (1 + 0.1 * red_noise(1000, 5, generator(number, 3)))
    assert judged(values * scale, values * scale, True) == judged(values, values, True)


def test_mser_is_the_minimum_of_the_marginal_standard_error():
    values = (1 + 3 * np.exp(-TIME / 15)) * (1 + 0.1 * red_noise(1000, 2, generator(4)))
    for length in (1, 5, 7):
        left = 1000 % length
        batches = values[left:].reshape(-1, length).mean(axis=1)
        count = len(batches)
        error = [batches[d:].var() / (count - d) for d in range(count // 2 + 1)]
        best = int(np.argmin(error))
        assert truncation(values, length) == (left + best * length if best else 0)


def test_a_transient_is_cut_off_and_nothing_else():
    start = steady_start(
        (1 + 3 * np.exp(-TIME / 15)) * (1 + 0.05 * red_noise(1000, 2, generator(1)))
    )
    assert 20 < start < 150
    cuts = [steady_start(1 + 0.2 * red_noise(1000, 20, generator(n, 5))) for n in range(40)]
    assert np.mean(np.array(cuts) == 0) > 0.7


def test_a_power_falls_and_a_plateau_does_not():
    noise = 1 + 0.1 * red_noise(1000, 5, generator(6))
    assert falls_as_power(TIME**-0.5 * noise, 500)
    assert not falls_as_power((1 + 3 * np.exp(-TIME / 15)) * noise, 100)
    assert not falls_as_power(-(TIME**-0.5) * noise, 500)


def test_the_four_verdicts():
    noise = red_noise(1000, 5, generator(7))
    assert verdict(1 + 0.1 * noise) == STEADY
    assert verdict(1 + 0.8 * noise) == WITHIN_ERROR
    assert verdict(TIME**-0.5 * (1 + 0.2 * noise)) == DRIFTING
    assert verdict((1 + TIME / 1000) * (1 + 0.1 * noise)) == DRIFTING
    assert verdict(1 + 0.1 * noise[:15]) == TOO_SHORT


def test_noise_about_zero_is_steady_within_its_error():
    noise = red_noise(1000, 5, generator(8))
    assert judged(noise, np.ones(1000))[1] == WITHIN_ERROR
    assert judged(0.1 * noise, np.ones(1000))[1] == STEADY


def test_a_bulk_that_has_only_strained_elastically_has_not_flowed():
    creep = 0.1 * np.exp(-TIME / 5) + 1e-6
    flow = 0.1 * np.exp(-TIME / 5) + 1e-2
    assert has_not_flowed(creep, 100, mean_of(creep[100:]), 1.0)
    assert not has_not_flowed(flow, 100, mean_of(flow[100:]), 1.0)


@pytest.mark.parametrize("length", [1e-6, 1.0, 5e3])
def test_steady_creep_in_which_no_particle_changes_its_neighbours_is_no_flow(length):
    quiet, noise = np.zeros(100), 1 + 0.1 * red_noise(900, 5, generator(9))
    for strain, flows in ((0.02, False), (0.2, True)):
        rate = np.concatenate((quiet, strain / 900 / length * noise))
        assert has_not_flowed(rate, 100, mean_of(rate[100:]), length) is not flows
        assert judged(rate, rate, flows=length)[1] == (STEADY if flows else DRIFTING)
        assert judged(rate, rate)[1] == STEADY


PYMSER = {
    1: [49, 52, 68, 46, 43, 55, 46, 48, 48, 54, 40, 50, 47, 55, 46, 126, 56, 55, 51, 62],
    5: [985, 55, 70, 55, 65, 55, 40, 70, 50, 55, 40, 50, 55, 75, 55, 110, 70, 55, 55, 65],
}
"""Starts that pymser 1.0.22 finds in twenty series by batches of one and five:
`pymser.equilibrate(series, LLM=False, batch_size=length, ADF_test=False)["t0"]`."""


@pytest.mark.parametrize("length", PYMSER)
def test_the_start_is_the_one_that_pymser_finds(length):
    shape = 1 + 3 * np.exp(-TIME / 15)
    series = [shape * (1 + 0.1 * red_noise(1000, 2, generator(n, 9))) for n in range(20)]
    for values, theirs in zip(series, PYMSER[length], strict=True):
        # Theirs is also looked for in the last half, where a window may look quiet by chance.
        assert truncation(values, length) == theirs or theirs > 500
