"""Eq. A1 over wall separations, and trends with the channel's size, on curves of known truth."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from softslip.analysis.fits import FITTED, finite_size, fit_laws
from softslip.analysis.fits.finite_size import (
    LENGTH,
    MISMATCH,
    MOONEY_BULK,
    MOONEY_SLIP,
    NO_STRESS,
    ONE_SIZE,
    SEPARATION,
    SIZES,
    trend_name,
)
from softslip.config.sweep import label_of

HEIGHTS = (0.11, 0.165, 0.22, 0.33, 0.44)
SLIP, BULK = 0.01, 0.3
TRENDS = [trend_name(name, size) for size in SIZES for name in ("shear_rate_bulk", "slip_velocity")]
MESSAGES = [f"{name}_message" for name in (MOONEY_SLIP, *TRENDS)]


def made_up(
    sizes=HEIGHTS,
    along=SEPARATION,
    *,
    slip=SLIP,
    bulk=BULK,
    error=0.05,
    together=0.0,
    trend=0.0,
    draws=1,
    seeds=1,
    seen=0.0,
    key=0,
):
    """Steady channels of known slip, independent of each other, along ``draw`` and ``seed`` too.

    Parameters
    ----------
    sizes, along
        Values of the dimension that is swept; all other channels have H = 0.22.
    error
        Of γ̇_bulk and V_s, over their values.
    together
        Correlation of the two.
    trend
        Relative change of both with each doubling of the size.
    seen
        What profiles add to the slip velocity, and so take from the bulk rate.
    """
    random = np.random.default_rng(np.random.SeedSequence((key, 21)))
    height = np.array(sizes if along == SEPARATION else [0.22] * len(sizes))[:, None, None]
    doublings = np.log2(np.array(sizes) / np.exp(np.mean(np.log(sizes))))[:, None, None]
    normal = random.standard_normal((2, len(sizes), draws, seeds))
    normal[1] = together * normal[0] + np.sqrt(1 - together**2) * normal[1]
    wide = error * abs(bulk), error * abs(slip)
    rate = bulk * (1 + trend * doublings) + wide[0] * normal[0]
    speed = slip * (1 + trend * doublings) + wide[1] * normal[1] + seen
    rate = rate - 2 * seen / height
    power = wide[0] ** 2 + (2 / height * wide[1]) ** 2 + 4 / height * together * wide[0] * wide[1]
    columns = {
        "shear_rate_wall": (rate + 2 * speed / height, power**0.5),
        "shear_rate_bulk": (rate, wide[0]),
        "slip_velocity": (speed, wide[1]),
    }
    dims = (along, "draw", "seed")
    curve = xr.Dataset(coords={along: list(sizes), "draw": range(draws), "seed": range(seeds)})
    for name, (values, errors) in columns.items():
        curve[name] = dims, values
        curve[f"{name}_error"] = dims, np.broadcast_to(errors, values.shape).copy()
    for flag in ("steady_wall", "steady_bulk", "steady_slip"):
        curve[flag] = dims, np.ones(rate.shape, dtype=bool)
    curve["status"] = dims, np.full(rate.shape, "done")
    curve = curve.assign_coords(stress=0.3)
    return curve.isel(seed=0, drop=True) if seeds == 1 else curve


def covered(fits, name, truth):
    """The share of intervals that hold the truth, for 68 and 95 %."""
    ends = fits[f"{name}_interval"].values.reshape(-1, 2, 2)
    assert np.isfinite(ends).all(), name
    return np.mean((ends[..., 0] <= truth) & (truth <= ends[..., 1]), axis=0)


def said(fits, name):
    return set(fits[f"{name}_message"].values.ravel().tolist())


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.05, 0.05), st.floats(-2.0, 2.0))
def test_slope_and_intercept_are_found_whatever_their_sign(slip, bulk):
    slip, bulk = round(slip, 4), round(bulk, 3)
    assume(slip or bulk)
    found = finite_size(made_up(slip=slip, bulk=bulk, error=1e-9))
    largest = max(abs(bulk), 2 * abs(slip) / min(HEIGHTS), 1e-9)
    assert found[MOONEY_SLIP].item() == pytest.approx(slip, abs=1e-4 * largest)
    assert found[MOONEY_BULK].item() == pytest.approx(bulk, abs=1e-4 * largest)


def test_what_is_exactly_zero_is_found_with_its_error():
    curve = made_up(bulk=0.0, error=0.0)
    found = finite_size(curve)
    assert said(found, MOONEY_SLIP) == {FITTED}
    assert abs(found[MOONEY_BULK].item()) < 1e-6
    assert 0 < found[f"{MOONEY_BULK}_error"].item() < 0.01
    name = trend_name("slip_velocity", SEPARATION)
    assert said(found, name) == {FITTED}
    assert abs(found[name].item()) < 1e-6
    assert 0 < found[f"{name}_error"].item() < 0.02


@pytest.mark.parametrize(("seeds", "key"), [(1, 1), (3, 2)])
def test_intervals_of_slope_and_intercept_cover_as_often_as_they_claim(seeds, key):
    found = finite_size(made_up(draws=300, seeds=seeds, key=key))
    assert said(found, MOONEY_SLIP) == {FITTED}
    for name, truth in ((MOONEY_SLIP, SLIP), (MOONEY_BULK, BULK)):
        share = covered(found, name, truth)
        assert 0.63 < share[0] < 0.76, f"68 % of {name} cover {share[0]:.0%} with {seeds} seeds"
        assert share[1] > 0.92, f"95 % of {name} cover {share[1]:.0%} with {seeds} seeds"
        bias = float(found[name].mean() - truth) / float(found[name].std() / 300**0.5)
        assert abs(bias) < 3, f"the mean of {name} is off by {bias:.1f} standard errors"


@pytest.mark.parametrize("together", [0.0, -0.7])
def test_the_mismatch_is_in_standard_errors_of_the_difference(together):
    found = finite_size(made_up(together=together, draws=300, key=3))[MISMATCH].values
    assert abs(np.mean(found)) < 0.2
    assert 0.85 < np.std(found) < 1.15, f"standard deviation {np.std(found):.2f} of 1"


def test_profiles_that_see_another_slip_than_the_walls_are_noticed():
    found = finite_size(made_up(seen=0.3 * SLIP, error=0.02, draws=20))
    assert found[MOONEY_SLIP].values == pytest.approx(np.full(20, SLIP), rel=0.25)
    assert (found[MISMATCH] < -2).all(), found[MISMATCH].values


def test_rates_that_do_not_follow_the_law_are_not_fitted():
    found = finite_size(made_up(trend=0.5, error=0.01))
    (message,) = said(found, MOONEY_SLIP)
    assert message.startswith("the law does not describe the points")
    assert np.isnan(found[MOONEY_SLIP]).all()
    assert np.isnan(found[MISMATCH]).all()


def test_two_separations_are_too_few_for_the_law_but_not_for_a_trend():
    curve = made_up(HEIGHTS[:2], error=0.01, trend=0.2)
    found = finite_size(curve)
    assert said(found, MOONEY_SLIP) == {"too few steady points: 2 of at least 3 wall separations"}
    assert found[f"{MOONEY_SLIP}_points"].values.tolist() == [2]
    assert np.isnan(found[MOONEY_SLIP]).all()
    name = trend_name("shear_rate_bulk", SEPARATION)
    assert said(found, name) == {FITTED}
    assert found[name].item() == pytest.approx(0.2, abs=3 * found[f"{name}_error"].item())
    assert np.isnan(found[f"{name}_reduced_chi_square"]).all()


def test_drifting_channels_are_left_out():
    curve = made_up(error=1e-3)
    for flag in ("steady_wall", "steady_bulk", "steady_slip"):
        curve[flag][0] = False
    for name in ("shear_rate_wall", "shear_rate_bulk", "slip_velocity"):
        curve[name][0] *= 7
    found = finite_size(curve)
    assert found[f"{MOONEY_SLIP}_points"].values.tolist() == [len(HEIGHTS) - 1]
    assert found[MOONEY_SLIP].item() == pytest.approx(SLIP, rel=0.02)
    assert abs(found[MISMATCH].item()) < 4


def test_the_mismatch_needs_no_steady_bulk():
    curve = made_up(draws=300, key=4)
    curve["steady_bulk"][:] = False
    found = finite_size(curve)[MISMATCH].values
    assert 0.85 < np.std(found) < 1.15, f"standard deviation {np.std(found):.2f} of 1"


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("trend", [0.0, -0.2])
def test_trends_are_found_and_their_intervals_cover(size, trend):
    curve = made_up((0.125, 0.25, 0.5, 1.0), size, trend=trend, draws=200, key=5)
    found = finite_size(curve)
    for series in ("shear_rate_bulk", "slip_velocity"):
        name = trend_name(series, size)
        assert said(found, name) == {FITTED}
        share = covered(found, name, trend)
        assert 0.61 < share[0] < 0.77, f"68 % cover {share[0]:.0%}"
        assert share[1] > 0.91, f"95 % cover {share[1]:.0%}"
        assert abs(float(found[name].mean()) - trend) < 0.01


def test_the_trend_of_what_may_be_zero_is_not_known():
    random = np.random.default_rng(6)
    curve = made_up(draws=40)
    curve["slip_velocity"][:] = 0.05 * SLIP * random.standard_normal(curve["slip_velocity"].shape)
    messages = finite_size(curve)[f"{trend_name('slip_velocity', SEPARATION)}_message"].values
    unknown = np.mean(messages == "the points do not determine the relative change")
    assert unknown > 0.7, f"{unknown:.0%} say that it is not known"


def test_a_scenario_without_swept_sizes_says_what_to_sweep():
    curve = made_up(draws=4).isel({SEPARATION: 2})
    for one in (curve, curve.drop_vars(SEPARATION), curve.expand_dims(SEPARATION)):
        found = finite_size(one)
        for name in (MOONEY_SLIP, *TRENDS):
            size = LENGTH if "length" in name else SEPARATION
            assert said(found, name) == {ONE_SIZE[size]}
            assert np.isnan(found[name]).all()
            assert (found[f"{name}_points"] == 0).all()
        assert found[MOONEY_SLIP].dims == ("draw",)
        assert np.isnan(found[MISMATCH]).all()
    assert ONE_SIZE[SEPARATION] == "one wall separation only: sweep channel.height"


def test_sizes_are_the_dimensions_that_swept_keys_become():
    assert label_of("channel.height") == SEPARATION
    assert label_of("channel.length") == LENGTH


def test_each_combination_of_all_other_dimensions_has_a_fit_of_its_own():
    stresses, roughnesses = [0.1, 0.3], [0.0, 0.59]
    parts = [
        [made_up(slip=0.1 * stress / (1 + roughness), error=1e-6) for roughness in roughnesses]
        for stress in stresses
    ]
    curve = xr.concat(
        [xr.concat(row, xr.Variable("roughness", roughnesses)) for row in parts],
        xr.Variable("stress", stresses),
    ).squeeze("draw", drop=True)
    lengths = xr.concat([curve, curve], xr.Variable(LENGTH, [0.25, 0.5]))
    found = finite_size(lengths)
    assert found[MOONEY_SLIP].dims == (LENGTH, "stress", "roughness")
    assert found[trend_name("slip_velocity", LENGTH)].dims == ("stress", "roughness", SEPARATION)
    truth = [[0.1 * stress / (1 + rough) for rough in roughnesses] for stress in stresses]
    assert found[MOONEY_SLIP].values == pytest.approx(np.array([truth, truth]), rel=1e-4)
    every = fit_laws(lengths.assign({name: lengths["slip_velocity"] for name in POWERS}))
    xr.testing.assert_identical(every[MOONEY_SLIP], found[MOONEY_SLIP])
    assert every["slip_coefficient"].dims == (LENGTH, "roughness", SEPARATION)


POWERS = [f"{name}{end}" for name in ("heterogeneity", "yielding_time", "slip_time")
          for end in ("", "_error")]  # fmt: skip


def test_imposed_rates_share_no_stress_between_separations():
    driven = made_up().drop_vars("stress").rename(draw="imposed_shear_rate")
    found = finite_size(driven.assign_coords(imposed_shear_rate=[0.1]))
    assert said(found, MOONEY_SLIP) == {NO_STRESS}
    assert said(found, trend_name("slip_velocity", SEPARATION)) == {NO_STRESS}
    lengths = made_up((0.25, 0.5), LENGTH).drop_vars("stress").rename(draw="imposed_shear_rate")
    found = finite_size(lengths.assign_coords(imposed_shear_rate=[0.1]))
    assert said(found, trend_name("shear_rate_bulk", LENGTH)) == {FITTED}


@settings(max_examples=15, deadline=None)
@given(st.floats(-6, 6), st.floats(-6, 6))
def test_fits_do_not_depend_on_units(length_power, rate_power):
    length, rate = 10.0**length_power, 10.0**rate_power
    curve = made_up(key=7)
    other = curve.assign_coords({SEPARATION: curve[SEPARATION] * length})
    for name, factor in (
        ("shear_rate_wall", rate),
        ("shear_rate_bulk", rate),
        ("slip_velocity", rate * length),
    ):
        for end in ("", "_error"):
            other[f"{name}{end}"] = other[f"{name}{end}"] * factor
    here, there = finite_size(curve), finite_size(other)
    for name, factor in ((MOONEY_SLIP, rate * length), (MOONEY_BULK, rate), (MISMATCH, 1.0)):
        assert there[name].item() == pytest.approx(here[name].item() * factor, rel=1e-4)
    for name in TRENDS[:2]:
        assert there[name].item() == pytest.approx(here[name].item(), rel=1e-4, abs=1e-6)
