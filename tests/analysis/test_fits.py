import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from softslip.analysis.fits import (
    FITTED,
    critical_roughness,
    fit_laws,
    flow_law,
    herschel_bulkley,
    slip_law,
)
from softslip.analysis.fits.likelihood import CONFIDENCE
from softslip.files.storage import read_dataset, write_dataset

STRESSES = np.array([0.01, 0.05, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5])


FILM, LAYERS = 0.004, 0.02
"""Slip velocity over stress by a film of solvent, and over stress above yield by layers."""


def made_up(
    yield_stress=0.055,
    consistency=0.6,
    index=0.57,
    error=0.03,
    seed=0,
    roughnesses=(0.0, 0.59),
    power=1.0,
    film=FILM,
):
    """A flow curve with Gaussian relative errors of the rate, below yield not steady.

    Walls slip by a film, and above yield as a power of the stress once that is faster.
    """
    random = np.random.default_rng(np.random.SeedSequence((seed, 11)))
    rows = []
    for _ in roughnesses:
        rate = (np.maximum(STRESSES - yield_stress, 0) / consistency) ** (1 / index)
        rows.append(np.where(rate > 0, rate * (1 + error * random.standard_normal(8)), 1e-6))
    rates = np.array(rows).T
    flowing = np.broadcast_to((yield_stress < STRESSES)[:, None], rates.shape)
    excess = np.where(flowing, (STRESSES - yield_stress)[:, None], 0)
    largest = excess.max()
    slip = np.maximum(LAYERS * largest * (excess / largest) ** power, film * STRESSES[:, None])
    slip = slip * (1 + error * random.standard_normal(slip.shape))
    dims = ("stress", "roughness")
    return xr.Dataset(
        {
            "shear_rate_bulk": (dims, rates),
            "shear_rate_bulk_error": (dims, error * rates),
            "steady_bulk": (dims, flowing),
            "slip_velocity": (dims, slip),
            "slip_velocity_error": (dims, error * slip),
            "steady_slip": (dims, np.ones_like(flowing)),
            "status": (dims, np.full(rates.shape, "done")),
            **powers_of(excess, flowing, error, random),
        },
        coords={"stress": STRESSES, "roughness": list(roughnesses)},
    )


def powers_of(excess, flowing, error, random):
    """Heterogeneity and times that are powers of the stress."""
    dims = ("stress", "roughness")
    time = np.where(flowing, np.where(flowing, excess, 1.0) ** -1.3, np.nan)
    true = {
        "heterogeneity": np.broadcast_to(0.02 * STRESSES[:, None] ** -0.8, flowing.shape),
        "yielding_time": time,
        "slip_time": 0.1 * time,
    }
    found = {}
    for name, values in true.items():
        noise = 1 + error * random.standard_normal(flowing.shape)
        found[name] = dims, values * noise
        found[f"{name}_error"] = dims, error * values
    return found


@settings(max_examples=25, deadline=None)
@given(st.floats(0.01, 0.07), st.floats(0.1, 2.0), st.floats(0.3, 1.2))
def test_exact_flow_curve_gives_back_its_parameters(yield_stress, consistency, index):
    found = herschel_bulkley(made_up(yield_stress, consistency, index, error=1e-9))
    values = [float(found[f"pooled_{n}"]) for n in ("yield_stress", "consistency", "flow_index")]
    assert values == pytest.approx([yield_stress, consistency, index], rel=1e-3)


def test_errors_cover_the_truth_as_often_as_they_claim():
    truth = {"yield_stress": 0.055, "consistency": 0.6, "flow_index": 0.57}
    samples = [herschel_bulkley(made_up(seed=number)) for number in range(120)]
    for name, value in truth.items():
        pulls = np.array(
            [float((s[f"pooled_{name}"] - value) / s[f"pooled_{name}_error"]) for s in samples]
        )
        covered = np.mean(np.abs(pulls) < 1)
        assert 0.58 < covered < 0.88, f"one error of {name} covers {covered:.0%}, 68-80 % expected"
        assert abs(pulls.mean()) < 0.3, f"{name} is biased by {pulls.mean():.2f} errors"


def test_scatter_beyond_the_errors_enlarges_them():
    curve = made_up(error=0.1, seed=3)
    doubtful = curve.assign(shear_rate_bulk_error=curve["shear_rate_bulk_error"] / 1.4)
    found, trusted = herschel_bulkley(doubtful), herschel_bulkley(curve)
    assert 1 < float(found["pooled_reduced_chi_square"]) < 6
    ratio = found["pooled_flow_index_error"] / trusted["pooled_flow_index_error"]
    assert float(ratio) > 0.8


def test_scatter_far_beyond_the_errors_is_no_fit():
    curve = made_up(error=0.1, seed=3)
    found = herschel_bulkley(
        curve.assign(shear_rate_bulk_error=curve["shear_rate_bulk_error"] / 10)
    )
    assert str(found["pooled_fit_message"].item()).startswith(
        "the law does not describe the points"
    )
    assert np.isnan(found["pooled_yield_stress"])


def test_too_few_points_are_said():
    curve = made_up().isel(stress=slice(0, 5))
    found = herschel_bulkley(curve)
    assert found["fit_message"].values.tolist() == ["too few steady points: 3 of at least 4"] * 2
    assert found["points"].values.tolist() == [3, 3]
    assert np.isnan(found["yield_stress"]).all()
    assert np.isnan(found["yield_stress_error"]).all()
    assert str(found["pooled_fit_message"].item()) == (
        "too few steady points: 6, at 3 stresses, of at least 4"
    )


def test_missing_and_drifting_points_are_left_out_and_no_others():
    curve = made_up()
    spoiled = curve.copy(deep=True)
    spoiled["shear_rate_bulk"][7, 0] = np.nan
    spoiled["steady_bulk"][7, 0] = False
    spoiled["shear_rate_bulk"][2, 0] = -1e-4
    spoiled["shear_rate_bulk_error"][2, 0] = 1e-3
    found = herschel_bulkley(spoiled)
    assert found["points"].values.tolist() == [5, 6]
    assert int(found["pooled_points"]) == 11
    clean = herschel_bulkley(curve)
    same = float(abs(found["yield_stress"] - clean["yield_stress"])[1])
    assert same == 0, f"a gap at one roughness changed the fit at another by {same:.1e}"


@settings(max_examples=15, deadline=None)
@given(st.floats(-12, 12), st.floats(-12, 12))
def test_fits_do_not_depend_on_units(stress_power, rate_power):
    stress, rate = 10.0**stress_power, 10.0**rate_power
    curve = made_up(seed=5)
    other = curve.assign_coords(stress=curve["stress"] * stress)
    for name in ("shear_rate_bulk", "shear_rate_bulk_error"):
        other[name] = other[name] * rate
    here, there = herschel_bulkley(curve), herschel_bulkley(other)
    assert (
        str(here["pooled_fit_message"].item()) == str(there["pooled_fit_message"].item()) == FITTED
    )
    for suffix in ("", "_error", "_interval"):
        np.testing.assert_allclose(
            there[f"pooled_yield_stress{suffix}"],
            here[f"pooled_yield_stress{suffix}"] * stress,
            rtol=2e-2,
        )
        np.testing.assert_allclose(
            there[f"pooled_flow_index{suffix}"], here[f"pooled_flow_index{suffix}"], rtol=2e-2
        )


def test_other_dimensions_are_fitted_one_by_one():
    low, high = made_up(yield_stress=0.03, error=1e-6), made_up(yield_stress=0.06, error=1e-6)
    both = xr.concat(
        [low, high], xr.DataArray([0.84, 0.9], dims="area_fraction", name="area_fraction")
    )
    found = herschel_bulkley(both)
    assert found["yield_stress"].dims == ("area_fraction", "roughness")
    assert found["pooled_yield_stress"].values == pytest.approx([0.03, 0.06], rel=1e-3)


def test_seeds_are_averaged_before_the_fit():
    seeds = xr.concat(
        [made_up(seed=1), made_up(seed=2)], xr.DataArray([1, 2], dims="seed", name="seed")
    )
    found = herschel_bulkley(seeds)
    assert "seed" not in found.dims
    assert int(found["pooled_points"]) == 12


def test_curve_without_a_stress_axis_has_too_few_points():
    found = herschel_bulkley(made_up().isel(stress=4))
    assert "too few steady points: 1 of at least 4" in found["fit_message"].values.tolist()


def test_a_yield_stress_that_cannot_be_told_from_zero_is_said():
    said = [
        str(herschel_bulkley(made_up(yield_stress=0.0, seed=n))["pooled_fit_message"].item())
        for n in range(20)
    ]
    assert (
        np.mean([each.startswith("the yield stress cannot be told from 0") for each in said]) > 0.8
    )


@pytest.mark.parametrize("rates", [[1e-2] * 8, 1e-2 / np.arange(1, 9)])
def test_rates_that_are_no_flow_curve_are_not_fitted_nor_used(rates):
    curve = made_up()
    rates = np.broadcast_to(np.array(rates)[:, None], (8, 2)).copy()
    flat = curve.assign(
        shear_rate_bulk=(curve["shear_rate_bulk"].dims, rates),
        shear_rate_bulk_error=(curve["shear_rate_bulk"].dims, 0.03 * rates),
        steady_bulk=xr.ones_like(curve["steady_bulk"]),
    )
    found = fit_laws(flat)
    assert FITTED not in found["fit_message"].values.tolist()
    assert str(found["pooled_fit_message"].item()) != FITTED
    assert set(found["slip_coefficient_message"].values) == {"the yield stress is not known"}


def test_creep_below_yield_is_no_flow():
    curve = made_up()
    assert int(herschel_bulkley(curve)["pooled_points"]) == 2 * int(
        curve["steady_bulk"][:, 0].sum()
    )


def test_measured_stresses_at_imposed_rates_are_fitted_by_their_errors():
    covered = []
    rate = np.geomspace(1e-3, 1.0, 8)
    for seed in range(40):
        random = np.random.default_rng(np.random.SeedSequence((seed, 12)))
        true = flow_law(rate, 0.055, 0.6, 0.57)
        curve = xr.Dataset(
            {
                "shear_rate_bulk": ("imposed_shear_rate", rate),
                "shear_rate_bulk_error": ("imposed_shear_rate", 1e-3 * rate),
                "shear_stress": (
                    "imposed_shear_rate",
                    true * (1 + 0.02 * random.standard_normal(8)),
                ),
                "shear_stress_error": ("imposed_shear_rate", 0.02 * true),
                "steady_bulk": ("imposed_shear_rate", np.ones(8, dtype=bool)),
            },
            coords={"imposed_shear_rate": rate},
        )
        low, high = herschel_bulkley(curve)["yield_stress_interval"].values[0]
        covered.append(low <= 0.055 <= high)
    assert 0.5 < np.mean(covered) < 0.85, f"68 % cover {np.mean(covered):.0%}"


def test_flow_law_is_the_papers():
    assert flow_law(np.array([0.0, 1.0, 4.0]), 1.0, 2.0, 0.5).tolist() == [1.0, 3.0, 5.0]


def test_slip_law_gives_back_both_coefficients():
    pulls = []
    for seed in range(60):
        found = slip_law(made_up(seed=seed), 0.055)
        for name, truth in (("slip_coefficient", LAYERS), ("newtonian_slip_coefficient", FILM)):
            pulls.extend(((found[name] - truth) / found[f"{name}_error"]).values)
    covered = np.mean(np.abs(pulls) < 1)
    assert 0.6 < covered < 0.92, f"one standard error covers {covered:.0%}, 68-80 % expected"


def test_error_of_the_yield_stress_adds_to_that_of_the_slip_coefficient():
    curve = made_up(seed=4)
    exact, doubtful = slip_law(curve, 0.055), slip_law(curve, 0.055, 0.004)
    assert (doubtful["slip_coefficient_error"] > exact["slip_coefficient_error"]).all()


def noise_about_zero(seed):
    """Six slip velocities whose true value is zero, all steady, at stresses above yield."""
    random = np.random.default_rng(np.random.SeedSequence((seed, 13)))
    stress = np.arange(1, 7) / 10
    flags = np.ones(6, dtype=bool)
    return xr.Dataset(
        {
            "slip_velocity": ("stress", 1e-3 * random.standard_normal(6)),
            "slip_velocity_error": ("stress", np.full(6, 1e-3)),
            "steady_slip": ("stress", flags),
            "steady_bulk": ("stress", flags),
        },
        coords={"stress": stress},
    )


def test_slip_that_is_zero_is_not_found_to_be_positive():
    found = [slip_law(noise_about_zero(seed), 0.05) for seed in range(200)]
    values = np.array([float(each["slip_coefficient"]) for each in found])
    errors = np.array([float(each["slip_coefficient_error"]) for each in found])
    assert {int(each["slip_coefficient_points"]) for each in found} == {6}
    assert 0.4 < np.mean(values > 0) < 0.6, f"{np.mean(values > 0):.0%} are positive"
    assert np.mean(np.abs(values) > 2 * errors) < 0.12
    intervals = np.array([each["slip_coefficient_interval"].values[0] for each in found])
    covered = np.mean((intervals[:, 0] <= 0) & (intervals[:, 1] >= 0))
    assert 0.6 < covered < 0.76, f"68 % cover {covered:.0%}"


def test_the_exponent_of_no_slip_is_not_known():
    said = [
        str(slip_law(noise_about_zero(n), 0.05)["slip_exponent_message"].item()) for n in range(20)
    ]
    assert np.mean([each == FITTED for each in said]) < 0.4


def test_linear_slip_is_told_from_quadratic():
    assert (slip_law(made_up(seed=6), 0.055)["slip_linear_evidence"] > 3).all()
    found = slip_law(made_up(seed=6, power=2.0), 0.055)
    assert (found["slip_linear_evidence"] < -3).all()
    assert found["slip_exponent"].values == pytest.approx([2.0, 2.0], abs=0.15)


def test_a_film_is_slipped_by_until_layers_flow_faster():
    curve = made_up(seed=8, error=0.01, film=0.6 * LAYERS)
    with_film = slip_law(curve, 0.055, 0.002)
    assert set(with_film["slip_coefficient_points"].values) == {len(STRESSES)}
    above = slip_law(curve.isel(stress=STRESSES > 0.055), 0.055, 0.002)
    said = above["slip_coefficient_message"].values.tolist()
    assert all(each.startswith("the law does not describe the points") for each in said), said
    assert with_film["slip_coefficient"].values == pytest.approx([LAYERS] * 2, rel=0.05)


def test_what_slip_tells_of_the_yield_stress_is_no_evidence_for_its_exponent():
    found = slip_law(
        made_up(seed=9), np.nan, np.nan, linear_yield_stress=0.055, linear_yield_stress_error=0.01
    )
    assert set(found["slip_coefficient_message"].values) == {FITTED}
    assert set(found["slip_exponent_message"].values) == {"the yield stress is not known"}
    assert np.isnan(found["slip_linear_evidence"]).all()


def test_powers_of_the_stress_are_found():
    found = fit_laws(made_up(seed=7))
    for name, truth in (
        ("pooled_heterogeneity_exponent", -0.8),
        ("pooled_yielding_exponent", -1.3),
        ("slip_time_exponent", -1.3),
    ):
        low, high = (found[f"{name}_interval"].isel(confidence=1, end=n) for n in (0, 1))
        assert (low <= truth).all(), name
        assert (high >= truth).all(), name
        assert (found[f"{name}_message"] == FITTED).all()


def test_heterogeneity_of_a_bulk_that_creeps_enters_no_power():
    curve = made_up(seed=7)
    flowing = int(curve["steady_bulk"].sum())
    spoiled = curve.copy(deep=True)
    spoiled["heterogeneity"] = curve["heterogeneity"].where(curve["steady_bulk"], 10.0)
    names = [name for name in fit_laws(curve) if "heterogeneity" in str(name)]
    before, after = fit_laws(curve)[names], fit_laws(spoiled)[names]
    xr.testing.assert_identical(after, before)
    assert 0 < flowing < curve["steady_bulk"].size
    assert int(before["pooled_heterogeneity_exponent_points"]) == flowing


def test_slip_is_halved_between_roughnesses():
    coefficients = np.array([2.0, 1.6, 0.4, 0.0])
    reach = 0.1 * stats.norm.ppf(0.5 * (1 + np.array(CONFIDENCE)))
    ends = coefficients[:, None, None] + reach[:, None] * np.array([-1.0, 1.0])
    slip = xr.Dataset(
        {
            "slip_coefficient": ("roughness", coefficients),
            "slip_coefficient_interval": (("roughness", "confidence", "end"), ends),
            "slip_coefficient_message": ("roughness", [FITTED] * 4),
        },
        coords={"roughness": [0.0, 0.2, 0.4, 0.6]},
    )
    found = critical_roughness(slip)
    assert float(found["critical_roughness"]) == pytest.approx(0.3)
    assert found["critical_roughness_bracket"].values.tolist() == [0.2, 0.4]
    low, high = found["critical_roughness_interval"].values[0]
    assert 0.27 < low < 0.3 < high < 0.33
    # Intervals of few samples, which are wider than their errors say, make a wider one.
    wider = slip.assign(slip_coefficient_interval=slip["slip_coefficient_interval"] * 1.0)
    wider["slip_coefficient_interval"][:, 1] += np.array([-0.3, 0.3])
    few = critical_roughness(wider)["critical_roughness_interval"].values
    known = found["critical_roughness_interval"].values
    assert few[0].tolist() == known[0].tolist()
    assert np.ptp(few[1]) > 1.5 * np.ptp(known[1])
    smooth = np.array([2.0, 1.9, 1.8, 1.7])
    ends = slip["slip_coefficient_interval"] + (smooth - coefficients)[:, None, None]
    never = critical_roughness(
        slip.assign(slip_coefficient=("roughness", smooth), slip_coefficient_interval=ends)
    )
    assert "not halved" in str(never["critical_roughness_message"].item())


def test_slip_law_says_where_it_has_no_points():
    found = slip_law(made_up().isel(stress=slice(1, None)), 0.055)
    assert str(found["newtonian_slip_coefficient_message"].values[0]) == (
        "too few steady points: 1 of at least 2"
    )
    unknown = slip_law(made_up(), xr.DataArray([np.nan, 0.055], dims="roughness"))
    assert unknown["slip_coefficient_message"].values.tolist() == [
        "the yield stress is not known",
        "fitted",
    ]


def test_slip_law_uses_the_fitted_yield_stress():
    curve = made_up(seed=2)
    found = fit_laws(curve)
    offset, error = found["pooled_yield_stress"], found["pooled_yield_stress_error"]
    expected = slip_law(curve, offset, error)["slip_coefficient"]
    xr.testing.assert_identical(found["slip_coefficient"], expected)
    bare = fit_laws(curve.isel(stress=slice(0, 5)).assign(steady_slip=curve["steady_bulk"]))
    assert set(bare["slip_coefficient_message"].values) == {"the yield stress is not known"}


def test_fits_survive_a_file(tmp_path):
    found = fit_laws(made_up(seed=2).isel(stress=slice(0, 6)))
    found["roughness"].attrs["units"] = "1"
    write_dataset(found, tmp_path / "fits.nc", stage="fits", run="demo", title="Fits")
    back = read_dataset(tmp_path / "fits.nc", stage="fits")
    xr.testing.assert_equal(back, found)
    for name, variable in back.data_vars.items():
        assert {"units", "long_name"} <= set(variable.attrs), f"{name} lacks unit or meaning"
