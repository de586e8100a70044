import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from softslip.analysis.fits import fit_laws, flow_law, herschel_bulkley, slip_law
from softslip.files.storage import read_dataset, write_dataset

STRESSES = np.array([0.01, 0.05, 0.08, 0.1, 0.15, 0.2, 0.3, 0.5])


def made_up(
    yield_stress=0.055, consistency=0.6, index=0.57, error=0.03, seed=0, roughnesses=(0.0, 0.59)
):
    """A flow curve with Gaussian relative errors of the rate, below yield not steady."""
    random = np.random.default_rng(np.random.SeedSequence((seed, 11)))
    rows = []
    for _ in roughnesses:
        rate = (np.maximum(STRESSES - yield_stress, 0) / consistency) ** (1 / index)
        rows.append(np.where(rate > 0, rate * (1 + error * random.standard_normal(8)), 1e-6))
    rates = np.array(rows).T
    flowing = np.broadcast_to((yield_stress < STRESSES)[:, None], rates.shape)
    excess = np.where(flowing, 0.02 * (STRESSES - yield_stress)[:, None], 0)
    slip = np.where(flowing, excess, 0.004 * STRESSES[:, None])
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
        },
        coords={"stress": STRESSES, "roughness": list(roughnesses)},
    )


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
    doubtful = curve.assign(shear_rate_bulk_error=curve["shear_rate_bulk_error"] / 10)
    found = herschel_bulkley(doubtful)
    assert float(found["pooled_reduced_chi_square"]) > 5
    off = abs(float(found["pooled_flow_index"]) - 0.57)
    assert off < 4 * float(found["pooled_flow_index_error"])


def test_too_few_points_are_said():
    curve = made_up().isel(stress=slice(0, 5))
    found = herschel_bulkley(curve)
    assert found["fit_message"].values.tolist() == ["too few steady points: 3 of at least 4"] * 2
    assert found["points"].values.tolist() == [3, 3]
    assert np.isnan(found["yield_stress"]).all()
    assert np.isnan(found["yield_stress_error"]).all()
    assert str(found["pooled_fit_message"].item()) == "too few stresses: 3 of at least 4"


def test_missing_unsteady_and_negative_points_are_left_out():
    curve = made_up()
    spoiled = curve.copy(deep=True)
    spoiled["shear_rate_bulk"][7, 0] = np.nan
    spoiled["steady_bulk"][7, 0] = False
    spoiled["shear_rate_bulk"][6, 0] = -1.0
    found = herschel_bulkley(spoiled)
    assert found["points"].values.tolist() == [4, 6]
    assert int(found["pooled_points"]) == 10
    clean = herschel_bulkley(curve)
    same = float(abs(found["yield_stress"] - clean["yield_stress"])[1])
    assert same == 0, f"a gap at one roughness changed the fit at another by {same:.1e}"


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


def test_parameter_at_its_bound_has_no_error():
    curve = made_up(yield_stress=0.0, index=0.5, error=1e-3)
    rate = (np.maximum(STRESSES, 0) / 0.6) ** 2 + 0.02
    pushed = curve.copy(deep=True)
    pushed["shear_rate_bulk"][:] = np.broadcast_to(rate[:, None], (8, 2))
    pushed["shear_rate_bulk_error"][:] = 0.01 * pushed["shear_rate_bulk"].values
    found = herschel_bulkley(pushed)
    message = str(found["pooled_fit_message"].item())
    if "yield stress at its bound" in message:
        assert np.isnan(float(found["pooled_yield_stress_error"]))
    else:
        assert "flow index at its bound" in message, message
        assert np.isnan(float(found["pooled_flow_index_error"]))


def test_flow_law_is_the_papers():
    assert flow_law(np.array([0.0, 1.0, 4.0]), 1.0, 2.0, 0.5).tolist() == [1.0, 3.0, 5.0]


def test_slip_law_gives_back_both_coefficients():
    pulls = []
    for seed in range(60):
        found = slip_law(made_up(seed=seed), 0.055)
        for name, truth in (("slip_coefficient", 0.02), ("newtonian_slip_coefficient", 0.004)):
            pulls.extend(((found[name] - truth) / found[f"{name}_error"]).values)
    covered = np.mean(np.abs(pulls) < 1)
    assert 0.6 < covered < 0.92, f"one standard error covers {covered:.0%}, 68-80 % expected"


def test_error_of_the_yield_stress_adds_to_that_of_the_slip_coefficient():
    curve = made_up(seed=4)
    step = 1e-5
    exact = slip_law(curve, 0.055)
    shifted = slip_law(curve, 0.055 + step)
    slope = (shifted["slip_coefficient"] - exact["slip_coefficient"]) / step
    doubtful = slip_law(curve, 0.055, 0.004)
    expected = np.hypot(exact["slip_coefficient_error"], slope * 0.004)
    np.testing.assert_allclose(doubtful["slip_coefficient_error"], expected, rtol=1e-2)


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
    bare = fit_laws(curve.isel(stress=slice(0, 5)))
    assert set(bare["slip_coefficient_message"].values) == {"the yield stress is not known"}


def test_fits_survive_a_file(tmp_path):
    found = fit_laws(made_up(seed=2).isel(stress=slice(0, 6)))
    found["roughness"].attrs["units"] = "1"
    write_dataset(found, tmp_path / "fits.nc", stage="fits", run="demo", title="Fits")
    back = read_dataset(tmp_path / "fits.nc", stage="fits")
    xr.testing.assert_equal(back, found)
    for name, variable in back.data_vars.items():
        assert {"units", "long_name"} <= set(variable.attrs), f"{name} lacks unit or meaning"
