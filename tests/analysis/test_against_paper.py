"""Our numbers beside the paper's."""

import json

import numpy as np
import pytest
import xarray as xr
from synthetic import FLOW_INDEX, YIELD_STRESS, shear_run

from softslip.analysis.against_paper import COMPARED, SEPARATION, _mean, against_paper
from softslip.analysis.comparable import unlike
from softslip.analysis.comparison_markdown import comparison_table
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.tables import flow_curve
from softslip.config.paper_material import MATERIAL, departures
from softslip.config.sweep import label_of
from softslip.files.dataset_check import check_dataset
from softslip.files.table_schemas import COMPARED as DECLARED

STRESSES = (0.15, 0.2, 0.3, 0.4, 0.5)


@pytest.fixture(scope="module")
def curve():
    """Of fluids that flow as the paper's, at its area fraction and at another one."""
    runs = [
        (
            {"area_fraction": fraction, "roughness": roughness, "stress": stress},
            shear_run(stress, roughness, duration=1500.0, noise=0.02, profiles=4),
        )
        for fraction in (0.84, 0.9)
        for roughness in (0.0, 0.59)
        for stress in STRESSES
    ]
    return flow_curve(runs)


@pytest.fixture(scope="module")
def compared(curve):
    return against_paper(curve, fit_laws(curve))


def test_a_fluid_that_flows_as_the_papers_agrees_with_it(compared):
    here = compared.sel(area_fraction=0.84)
    for name, true in (("yield_stress", YIELD_STRESS), ("flow_index", FLOW_INDEX)):
        assert str(here[f"{name}_remark"].item()) == ""
        assert float(here[name]) == pytest.approx(true, abs=4 * float(here[f"{name}_error"]))
        assert abs(float(here[f"{name}_difference"])) < 4


def test_a_difference_is_over_the_errors_of_both(compared):
    here = compared.sel(area_fraction=0.84)
    error = np.hypot(float(here["flow_index_error"]), 0.03)
    wanted = (float(here["flow_index"]) - 0.57) / error
    assert float(here["flow_index_difference"]) == pytest.approx(wanted, rel=1e-12)
    # The paper gives no error of it.
    gap = (float(here["yielding_time"]) - 17.5) / float(here["yielding_time_error"])
    assert float(here["yielding_time_difference"]) == pytest.approx(gap, rel=1e-12)


def test_another_material_has_numbers_and_no_differences(compared):
    here = compared.sel(area_fraction=0.9)
    assert np.isfinite(float(here["yield_stress"]))
    for name in COMPARED:
        assert np.isnan(float(here[f"{name}_difference"]))
    assert str(here["yield_stress_remark"].item()) == "area_fraction 0.9 is not the paper's"


def test_runs_are_counted(compared):
    assert compared["runs_done"].values.tolist() == [10, 10]


def test_what_could_not_be_measured_says_why(curve):
    few = curve.sel(stress=[0.15, 0.2])
    found = against_paper(few, fit_laws(few)).sel(area_fraction=0.84)
    assert np.isnan(float(found["yield_stress"]))
    assert "too few" in str(found["yield_stress_remark"].item())
    assert str(found["yielding_time_remark"].item()) == "no run at stress 0.5"
    assert str(found["separation_effect_remark"].item()) == "one wall separation only"


def test_every_number_has_a_value_or_says_why_not(compared):
    for name in COMPARED:
        for value, gap, remark in zip(
            np.ravel(compared[name]),
            np.ravel(compared[f"{name}_difference"]),
            np.ravel(compared[f"{name}_remark"]),
            strict=True,
        ):
            assert (np.isfinite(value) and np.isfinite(gap)) == (str(remark) == ""), name


def test_the_schema_has_the_numbers_and_what_they_are_about():
    assert {name: number.pooled for name, number in COMPARED.items()} == DECLARED


def test_the_separation_is_the_dimension_that_a_swept_height_becomes():
    assert label_of("channel.height") == SEPARATION


def separations(*rates):
    """Return a flow curve with a steady bulk at three wall separations and two stresses."""
    found = xr.Dataset(
        {
            "shear_rate_bulk": ((SEPARATION, "stress"), np.outer(rates, [1.0, 3.0])),
            "shear_rate_bulk_error": ((SEPARATION, "stress"), 0.02 * np.outer(rates, [1.0, 3.0])),
            "steady_bulk": ((SEPARATION, "stress"), np.full((len(rates), 2), True)),
        },
        coords={SEPARATION: [0.2, 0.3, 0.44][: len(rates)], "stress": [0.2, 0.4]},
    )
    return COMPARED["separation_effect"].measured(found, xr.Dataset())


def test_only_wide_channels_show_the_effect_of_their_width():
    found = separations(5.0, 1.0, 1.1)
    assert found.value == pytest.approx(0.1, rel=1e-12)
    # Of two stresses, each with 2 % at either separation.
    assert found.error == pytest.approx(1.1 * 0.02 * 2**0.5 / 2**0.5, rel=1e-12)
    assert separations(1.0, 1.0).remark == "fewer than two wall separations from 0.3 on"


def test_channels_of_a_sweep_are_held_against_one_another():
    runs = [
        ({"stress": stress, SEPARATION: height}, shear_run(stress, height=height, noise=0.03))
        for stress in STRESSES
        for height in (0.3125, 0.4375)
    ]
    curve = flow_curve(runs)
    compared = against_paper(curve, fit_laws(curve))
    check_dataset(compared, "comparison")
    # What this number is about, and a dimension of all others.
    found, error = (float(compared[f"separation_effect{end}"]) for end in ("", "_error"))
    assert 0 < error < 0.5
    assert abs(found) < 4 * error
    assert compared["flow_index"].dims == (SEPARATION,)


def test_values_that_scatter_more_than_their_errors_have_a_larger_one():
    values = xr.DataArray([1.0, 2.0, np.nan, 5.0])
    errors = xr.DataArray([0.1, 0.1, 0.1, np.inf])
    found = _mean(values, errors, "none")
    assert found.value == pytest.approx(1.5)
    assert found.error == pytest.approx(0.5)
    assert _mean(values[2:], errors[2:], "none").remark == "none"


def test_smooth_walls_are_needed_for_their_slip_length(curve):
    rough = curve.sel(roughness=[0.59])
    found = against_paper(rough, fit_laws(rough)).sel(area_fraction=0.84)
    assert str(found["newtonian_slip_length_remark"].item()) == "no run with smooth walls"


def test_the_table_has_a_line_for_each_number(compared):
    text = comparison_table(compared.assign_attrs(run="desk"))
    assert text.count("Scenario desk, 10 finished runs, area_fraction 0.84:") == 1
    lines = [line for line in text.splitlines() if "$" in line]
    assert len(lines) == 2 * len(COMPARED)
    assert all(line.count("|") == 7 for line in lines)
    assert "| 0.055 ± 0.004 |" in text


def test_every_parameter_of_the_material_counts():
    assert list(departures({})) == []
    for path in MATERIAL:
        assert list(departures({path: 7.0})) == [(path, 7.0)]
    assert list(departures({"suspension.mean_radius": 0.00846})) == [], "the paper gives 0.0085"


def test_a_value_of_the_base_or_of_an_axis_makes_a_material_another_one(curve):
    assert unlike(curve, {"area_fraction": 0.84}) == ()
    assert unlike(curve, {"area_fraction": 0.7}) == (("area_fraction", 0.7),)
    base = {"membrane": {"elastic_constant": 2.0}}
    told = curve.assign_attrs(parameters=json.dumps({"base": base, "axes": {}}))
    assert unlike(told) == (("elastic_constant", 2.0),)
    # An axis of the same name that belongs to another section says nothing of the membrane.
    axes = {"expansion.elastic_constant": [1.0, 3.0]}
    other = curve.assign_attrs(parameters=json.dumps({"base": {}, "axes": axes}))
    assert unlike(other, {"elastic_constant": 3.0}) == ()
