"""Times of yielding and of slip, drawn by how well they are decided."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from softslip.analysis.figures.markers import ALL_STEADY, DRIFTING, STEADY, WITHIN_ERROR
from softslip.analysis.figures.panels import Family
from softslip.analysis.figures.shown import shown
from softslip.analysis.figures.timescale_panels import DECIDED, decided, draw_times, explained_times
from softslip.analysis.fits import FITTED

STRESS = [0.02, 0.23, 0.3, 0.4, 0.5]
TIME = [90.0, 30.0, 20.0, 10.0, np.nan]
CHANGE = [np.inf, 4.0, 6.0, np.inf, np.nan]
WINDOW = 10**0.1 - 1


@pytest.fixture
def cell():
    """Of one roughness; each time has an error of 5."""
    dims = ("roughness", "stress")
    values = {
        "yielding_time": (dims, [TIME]),
        "yielding_time_error": (dims, [[5.0] * 5]),
        "yielding_time_smoothing": (dims, [CHANGE]),
    }
    return xr.Dataset(values, coords={"roughness": [0.0], "stress": STRESS})


def drawn(cell, yield_stress):
    figure = Figure()
    axes = figure.subplots()
    family = Family("roughness", (0.0,))
    return figure, axes, draw_times(axes, "d", cell, family, "yielding_time", yield_stress)


def test_a_time_is_as_decided_as_other_smoothings_bear_it_out(cell):
    found = decided(cell, "yielding_time").tolist()
    assert found[:4] == [DRIFTING, STEADY, WITHIN_ERROR, DRIFTING]


@pytest.mark.parametrize(("share", "state"), [(0.99, STEADY), (1.01, WITHIN_ERROR)])
def test_a_change_within_the_smoothing_window_says_nothing(cell, share, state):
    """As of slip, whose bars are small: 0.1 decades are a quarter of a time."""
    cell["yielding_time_error"] *= 0.01
    cell["yielding_time_smoothing"] = share * WINDOW * cell["yielding_time"]
    assert set(decided(cell, "yielding_time")[:4]) == {state}


def test_times_are_filled_half_filled_and_open(cell):
    figure, axes, seen = drawn(cell, 0.1)
    looks = {}
    for container in axes.containers:
        marker, _, bars = container.lines
        dashed = bars[0].get_linestyle()[0][1] is not None
        half = marker.get_fillstyle() == "bottom"
        looks[float(marker.get_ydata()[0])] = (marker.get_markerfacecolor(), half, dashed)
    blue = looks[30.0][0]
    assert blue not in ("white", "none")
    assert looks == {
        30.0: (blue, False, False),
        20.0: (blue, True, False),
        10.0: ("white", False, True),
    }
    assert seen == {STEADY, WITHIN_ERROR, DRIFTING}
    (series,) = (one for one in shown(figure) if one.name == "yielding time")
    assert series.points["yielding_time_smoothing"].values.tolist() == [4.0, 6.0, np.inf]


def test_only_what_is_drawn_is_explained(cell):
    _, _, seen = drawn(cell.isel(stress=slice(0, 2)), 0.1)
    assert seen == {STEADY}
    assert explained_times(seen) == f"(d, e) {ALL_STEADY}"
    words = explained_times({STEADY, DRIFTING})
    assert words == f"(d, e) {ALL_STEADY}; {DECIDED[STEADY]}; {DECIDED[DRIFTING]}"
    _, _, nothing = drawn(cell, np.nan)
    assert nothing == set()
    assert explained_times(nothing) == ""


def test_a_fitted_power_is_drawn_with_its_error(cell):
    name = "pooled_yielding_exponent"
    laws = xr.Dataset({name: -0.9, f"{name}_error": 0.12, f"{name}_message": FITTED})
    axes, family = Figure().subplots(), Family("roughness", (0.0,))
    draw_times(axes, "d", cell, family, "yielding_time", 0.1, laws)
    _, labels = axes.get_legend_handles_labels()
    assert labels[0] == r"fitted: power −0.90 $\pm$ 0.12"
    x, y = np.log(axes.lines[-3].get_xydata()).T
    assert abs((y[1] - y[0]) / (x[1] - x[0]) + 0.9) < 1e-9
    (kept,) = (one for one in shown(axes.figure) if one.name.startswith("power fitted"))
    assert kept.points[name].values.tolist() == [-0.9]
