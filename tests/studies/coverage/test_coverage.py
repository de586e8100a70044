"""Verdicts err, and intervals hold the truth, as often as they claim: few draws here, many slow."""

import numpy as np
import pytest
import xarray as xr

from softslip.analysis.fits import FITTED
from softslip.analysis.observables.verdicts import DRIFTING
from softslip.studies.coverage.coverage_markdown import coverage_tables
from softslip.studies.coverage.made_up_curves import CURVES
from softslip.studies.coverage.made_up_series import KINDS, RECORDS, red_noise
from softslip.studies.coverage.measured_coverage import (
    Tally,
    curve_tallies,
    measure_coverage,
    series_tally,
)

CLAIMED = (0.68, 0.95)

FEW, MANY = 80, 500


def off(tally):
    """By how much the coverage differs from what is claimed, beyond three errors of its own."""
    return [
        max(abs(found - claimed) - 3 * np.sqrt(claimed * (1 - claimed) / tally.intervals), 0)
        for found, claimed in zip(tally.coverage(), CLAIMED, strict=True)
    ]


@pytest.fixture(scope="module")
def small():
    return measure_coverage(1)


@pytest.mark.parametrize("kind", ["stationary", "zero", "negative", "relaxing", "yielding"])
@pytest.mark.parametrize(("noise", "memory"), [(0.1, 2.0), (0.2, 10.0), (0.4, 50.0)])
def test_means_of_steady_series_are_covered(kind, noise, memory):
    tally = series_tally(kind, noise, memory, FEW, 1)
    assert max(off(tally)) < 0.05, f"intervals hold {tally.coverage()}"


@pytest.mark.parametrize("kind", ["stationary", "zero", "yielding"])
def test_few_steady_series_are_called_drifting(kind):
    tally = series_tally(kind, 0.2, 10.0, FEW, 2)
    assert tally.share(DRIFTING) < 0.15, f"{tally.share(DRIFTING):.0%} are called drifting"


@pytest.mark.parametrize("kind", ["creep", "slow creep", "unfinished"])
def test_few_unfinished_series_are_called_steady(kind):
    tally = series_tally(kind, 0.1, 10.0, FEW, 3)
    assert tally.share(DRIFTING) > 0.8, f"only {tally.share(DRIFTING):.0%} are called drifting"


@pytest.mark.parametrize("kind", ["paper", "imposed rate"])
def test_parameters_of_laws_are_covered(kind):
    for name, tally in curve_tallies(CURVES[kind], 40, 1).items():
        assert tally.share(FITTED) > 0.8, name
        assert max(off(tally)) < 0.05, f"intervals of {name} hold {tally.coverage()}"


@pytest.mark.parametrize(
    ("kind", "unknown"),
    [
        ("no yield stress", ["pooled_yield_stress", "slip_coefficient", "yielding_exponent"]),
        ("no slip", ["slip_exponent", "slip_yield_stress"]),
        ("plateau", ["pooled_yield_stress", "pooled_flow_index", "slip_coefficient"]),
        ("falling", ["pooled_yield_stress", "pooled_flow_index", "slip_coefficient"]),
    ],
)
def test_what_cannot_be_known_is_rarely_said_to_be_fitted(kind, unknown):
    tallies = curve_tallies(CURVES[kind], 20, 2)
    for name in unknown:
        tally = tallies.get(name, tallies.get(f"pooled_{name}"))
        assert tally.share(FITTED) <= 0.2, (
            f"{name} is said to be fitted in {tally.share(FITTED):.0%}"
        )


def test_noise_has_the_memory_that_it_says():
    noise = red_noise(20000, 10.0, np.random.default_rng(5))
    assert noise.std() == pytest.approx(1.0, rel=0.1)
    together = np.mean(noise[10:] * noise[:-10]) / noise.var()
    assert together == pytest.approx(np.exp(-1), abs=0.06)


def test_a_tally_counts_what_is_said_and_what_is_held():
    tally = Tally()
    ends = np.array([[0.0, 1.0], [-1.0, 2.0]])
    tally.add("a", ends, 1.5)
    tally.add("b", ends, 0.5)
    tally.add("b", None, 0.5)
    tally.add("b", ends * np.nan, 0.5)
    assert tally.coverage() == [0.5, 1.0]
    assert tally.intervals == 2
    assert tally.share("b") == 0.75


def test_every_kind_is_in_the_tables(small):
    text = coverage_tables(small)
    for made in (*KINDS.values(), *CURVES.values()):
        assert made.words in text
    assert f"of {RECORDS} records" in text
    assert np.allclose(small["verdict_share"].sum("verdict"), 1.0)


def test_the_same_draws_give_the_same_numbers(small):
    again = measure_coverage(1)
    xr.testing.assert_identical(again, small)


@pytest.mark.slow
def test_all_intervals_hold_the_truth_within_five_points():
    found = measure_coverage(MANY)
    for coverage, intervals in (
        (found["series_coverage"], found["series_intervals"]),
        (found["estimate_coverage"], found["estimate_intervals"]),
    ):
        known = intervals.values >= MANY / 2
        for number, claimed in enumerate(CLAIMED):
            apart = np.abs(coverage.values[known, number] - claimed)
            doubt = 2 * np.sqrt(claimed * (1 - claimed) / intervals.values[known])
            assert (apart < 0.05 + doubt).all(), apart.max()
