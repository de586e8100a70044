"""Finished runs correct the estimates of their likes most, and of all others by their mean."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softslip.config.parameters import Parameters
from softslip.operations.correction import FEWEST_RUNS, FinishedRun, condition_of, correction_by

MODEL_FACTOR = 3.0

ROUGHNESSES = st.sampled_from([0.0, 0.12, 0.35, 0.59, 0.9, 1.5])


def run_at(stress: float = 0.1, roughness: float = 0.0, **rheometer: object) -> Parameters:
    given = {"stress": stress} | rheometer
    return Parameters.from_mapping({"rheometer": given, "wall": {"roughness": roughness}})


def finished(stress: float, ratio: float, roughness: float = 0.0, size: float = 1.0) -> FinishedRun:
    condition = condition_of(run_at(stress, roughness))
    return FinishedRun(condition, math.log(ratio), math.log(size))


def test_without_runs_nothing_is_corrected() -> None:
    found = correction_by([], MODEL_FACTOR)
    assert (found.runs, found.core_seconds, found.size, found.factor) == (0, 1.0, 1.0, MODEL_FACTOR)
    assert found.at(run_at()) == found


@given(
    st.lists(st.tuples(st.floats(1e-3, 1.0), ROUGHNESSES), min_size=1, max_size=8),
    st.floats(0.1, 10.0),
    st.floats(1e-3, 1.0),
    ROUGHNESSES,
)
def test_a_machine_slower_by_a_factor_is_corrected_by_it_everywhere(
    done: list[tuple[float, float]], slower: float, stress: float, roughness: float
) -> None:
    runs = [finished(where, slower, walls) for where, walls in done]
    found = correction_by(runs, MODEL_FACTOR)
    for each in (found, found.at(run_at(stress, roughness))):
        assert each.core_seconds == pytest.approx(slower, rel=1e-12)
    if len(runs) >= FEWEST_RUNS:
        assert found.factor == pytest.approx(1.0, abs=1e-7)


@given(st.lists(st.floats(0.2, 5.0), min_size=1, max_size=8), st.floats(1e-3, 1.0))
def test_no_correction_is_beyond_what_was_measured(ratios: list[float], stress: float) -> None:
    runs = [finished(0.02 * 1.5**place, ratio) for place, ratio in enumerate(ratios)]
    found = correction_by(runs, MODEL_FACTOR).at(run_at(stress)).core_seconds
    assert min(ratios) * (1 - 1e-12) <= found <= max(ratios) * (1 + 1e-12)


def test_runs_at_the_same_condition_count_most() -> None:
    runs = [finished(0.02, 1.0), finished(0.5, 4.0)]
    found = correction_by(runs, MODEL_FACTOR)
    assert found.core_seconds == pytest.approx(2.0, rel=1e-12)
    slow, fast = (found.at(run_at(stress)).core_seconds for stress in (0.5, 0.02))
    assert 2.5 < slow < 4
    assert 1 < fast < 1.6
    assert found.factor == MODEL_FACTOR, "two runs tell little of their scatter"


def test_far_from_all_runs_their_mean_counts() -> None:
    runs = [finished(0.02, 1.0), finished(0.5, 4.0)]
    for far in (run_at(1e4), run_at(0.1, roughness=3.0), run_at(0.0)):
        assert correction_by(runs, MODEL_FACTOR).at(far).core_seconds == pytest.approx(2, rel=1e-3)


def test_imposed_rates_tell_nothing_special_of_imposed_stresses() -> None:
    by_rate = run_at(mode="rate", stress=None, shear_rate=0.02)
    rate = FinishedRun(condition_of(by_rate), math.log(4.0), 0.0)
    found = correction_by([rate, finished(0.02, 1.0)], MODEL_FACTOR)
    expected = math.exp((0.0 + 0.5 * math.log(2.0)) / 1.5)
    assert found.at(run_at(0.02)).core_seconds == pytest.approx(expected, rel=1e-12)


def test_the_factor_is_how_well_others_tell_each_run() -> None:
    """Samples of few conditions are told well by their likes, though conditions differ."""
    generator = np.random.default_rng(5)
    scatter = 0.1
    runs = [
        finished(stress, ratio * math.exp(scatter * generator.standard_normal()))
        for stress, ratio in ((0.01, 1.0), (0.1, 2.0), (1.0, 4.0))
        for _ in range(40)
    ]
    found = correction_by(runs, MODEL_FACTOR)
    assert math.log(found.factor) == pytest.approx(2 * scatter, rel=0.15)


def test_sizes_are_corrected_by_their_mean() -> None:
    runs = [finished(0.02, 1.0, size=0.5), finished(0.5, 1.0, size=2.0)]
    assert correction_by(runs, MODEL_FACTOR).at(run_at(0.5)).size == pytest.approx(1.0, rel=1e-12)
