"""Figures of one run show the numbers that the tables have of it."""

import numpy as np
import pytest
from synthetic import shear_run

from softslip.analysis.figures.shown import shown
from softslip.analysis.figures.single_run import creep_curve, velocity_profile
from softslip.analysis.observables import mean_profile, steady_state, yielding_time
from softslip.analysis.observables.tables import creep


@pytest.fixture(scope="module")
def run():
    return shear_run(0.3, duration=600.0, profiles=6)


def of(figure, panel, name):
    (found,) = [each for each in shown(figure) if (each.panel, each.name) == (panel, name)]
    return {key: np.asarray(each.values) for key, each in found.points.items()}


@pytest.mark.parametrize("name", ["shear_rate_wall", "shear_rate_bulk", "slip_velocity"])
def test_creep_shows_series_and_averages(run, name):
    figure = creep_curve(run)
    series, steady = creep([({}, run)]), steady_state(run)
    drawn = of(figure, name, "series")
    positive = series[name].values > 0
    np.testing.assert_array_equal(drawn[name][positive], series[name].values[positive])
    assert np.isnan(drawn[name][~positive]).all()
    average = of(figure, name, "average")
    assert set(average[name]) == {float(steady[name])}
    np.testing.assert_array_equal(average["time"], [steady["steady_from"], run["time"][-1]])


def test_creep_marks_where_the_bulk_yields(run):
    time = float(yielding_time(run)["yielding_time"])
    assert np.isfinite(time)
    assert of(creep_curve(run), "shear_rate_bulk", "yielding")["time"] == [time]


def test_a_run_without_a_bulk_has_the_speed_of_its_walls_alone(run):
    names = [name for name in run if str(name).startswith(("shear_rate_bulk", "slip_velocity"))]
    figure = creep_curve(run.drop_vars(names))
    assert {each.panel for each in shown(figure)} == {"shear_rate_wall"}


def test_values_below_zero_leave_gaps_and_are_mentioned(run):
    spoilt = run.copy(deep=True)
    spoilt["shear_rate_wall"][:40] = -1e-4
    figure = creep_curve(spoilt)
    assert np.isnan(of(figure, "shear_rate_wall", "series")["shear_rate_wall"]).any()
    assert "gaps" in figure.get_supxlabel()
    assert "gaps" not in creep_curve(run).get_supxlabel()


def test_the_profile_is_the_mean_one(run):
    drawn, mean = of(velocity_profile(run), "", "profile"), mean_profile(run)
    for name in ("normalised_position", "normalised_velocity"):
        np.testing.assert_array_equal(drawn[name], mean[name].values)


def test_walls_at_rest_have_no_profile_and_it_is_said(run):
    still = run.copy(deep=True)
    still["wall_velocity"][:] = 0.0
    assert "do not move" in velocity_profile(still).get_supxlabel()
