"""Slip lengths are drawn as they are in the datasets, beside the laws and the paper."""

import matplotlib
import numpy as np
import pytest
from synthetic import sweep

from softslip.analysis import figures, paper
from softslip.analysis.figures.shown import shown
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.tables import flow_curve

NAMES = ("newtonian_slip_length", "total_slip_length")


@pytest.fixture(scope="module")
def curve():
    return flow_curve(
        sweep(
            (0.02, 0.08, 0.15, 0.2, 0.3, 0.5), (0.0, 0.59), duration=1500.0, noise=0.03, profiles=8
        )
    )


@pytest.fixture(scope="module")
def laws(curve):
    return fit_laws(curve)


def words(figure):
    figure.canvas.draw()
    return "\n".join(text.get_text() for text in figure.findobj(matplotlib.text.Text))


def kept(figure, panel, name):
    """Stress, roughness and value of all lengths that a panel shows."""
    rows = set()
    for one in shown(figure):
        if one.panel == panel and name in one.points and f"{name}_error" in one.points:
            for number, value in enumerate(one.points[name].values):
                at = {key: each.values for key, each in one.at.items()}
                at |= {key: each.values[number] for key, each in one.points.items()}
                rows.add((float(at["stress"]), float(at["roughness"]), float(value)))
    return rows


@pytest.mark.parametrize(("panels", "name"), [("ac", NAMES[0]), ("bd", NAMES[1])])
def test_both_columns_show_every_length_that_is_known(curve, laws, panels, name):
    known = curve[name].isel(seed=0).stack(run=("stress", "roughness")).dropna("run")
    wanted = {
        (float(one["stress"]), float(one["roughness"]), float(one))
        for one in known
        if one.notnull()
    }
    assert len(wanted) >= 6
    figure = figures.draw("fig7", curve, laws)
    for panel in panels:
        assert kept(figure, panel, name) == wanted


def test_the_line_of_the_laws_is_the_ratio_of_slip_velocity_and_bulk_rate(curve, laws):
    figure = figures.draw("fig7", curve, laws)
    found = [one for one in shown(figure) if one.name == "laws of slip and flow"]
    assert len(found) == 2
    offset, consistency, index = (
        float(laws[f"pooled_{name}"]) for name in ("yield_stress", "consistency", "flow_index")
    )
    for one in found:
        stress = one.points["stress"].values
        here = laws.sel(roughness=float(one.at["roughness"].values))
        rate = ((stress - offset) / consistency) ** (1 / index)
        wanted = float(here["slip_coefficient"]) * (stress - offset) / rate
        np.testing.assert_allclose(one.points["total_slip_length"].values, wanted)


def test_lengths_not_above_zero_are_triangles_at_the_edge(curve, laws):
    assert "not above zero" not in words(figures.draw("fig7", curve, laws))
    spoiled = curve.copy(deep=True)
    place = {"stress": 5, "roughness": 1}
    spoiled["total_slip_length"][place] = -1e-4
    figure = figures.draw("fig7", spoiled, laws)
    assert "triangles at the lower edge: not above zero" in words(figure)
    at = (0.5, 0.59, -1e-4)
    assert at in kept(figure, "b", "total_slip_length")
    frames = [line.get_xdata() for line in figure.axes[1].lines if line.get_marker() == "v"]
    assert [0.5] in [list(each) for each in frames]


def test_lengths_without_an_upper_end_are_counted_and_not_drawn(curve, laws):
    spoiled = curve.copy(deep=True)
    spoiled["total_slip_length_error"][{"stress": 4, "roughness": 0}] = np.inf
    figure = figures.draw("fig7", spoiled, laws)
    assert "total lengths without an upper end, not drawn: 1" in words(figure)
    assert (0.3, 0.0) not in {each[:2] for each in kept(figure, "b", "total_slip_length")}


def test_the_papers_lengths_stand_only_beside_its_material(curve, laws):
    figure = figures.draw("fig7", curve, laws)
    reported = [one for one in shown(figure) if "at roughness 0 of the paper" in one.name]
    assert len(reported) == 1
    assert "paper" in words(figure)
    other = curve.assign_coords(area_fraction=0.7)
    assert "paper" not in words(figures.draw("fig7", other, laws))


@pytest.mark.parametrize("extra", ["wall_separation", "surface"])
def test_any_further_dimension_is_drawn(extra):
    values = {"wall_separation": (0.125, 0.25), "surface": ("soft", "hard")}[extra]
    runs = sweep((0.15, 0.5), (0.0, 0.59), duration=300.0, profiles=8)
    every = [({**labels, extra: value}, run) for labels, run in runs for value in values]
    table = flow_curve(every)
    figure = figures.draw("fig7", table, fit_laws(table))
    assert len(figure.axes) == 8
    assert all(str(value) in words(figure) for value in values)


def test_imposed_rates_and_one_run_are_drawn(curve):
    driven = curve.rename(stress="imposed_shear_rate").assign_coords(
        imposed_shear_rate=[0.001, 0.01, 0.05, 0.1, 0.2, 0.6]
    )
    for figure in ("fig6", "fig7"):
        assert len(figures.draw(figure, driven, fit_laws(driven)).axes) == 4
    alone = flow_curve(sweep((0.3,), (0.0,), duration=60.0, profiles=4))
    assert "nowhere are both slip and bulk steady" in words(
        figures.draw("fig7", alone, fit_laws(alone))
    )


def test_the_radius_of_bumps_is_that_of_the_configuration():
    from softslip.config.fields import all_fields, extra
    from softslip.config.parameters import Parameters

    radius = extra(all_fields(Parameters)["suspension.mean_radius"], "paper")
    assert paper.MEAN_RADIUS.value == radius
