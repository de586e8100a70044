"""Fig. 9: Eq. A1 as it was fitted, or pinned to one separation where it was not."""

import matplotlib
import numpy as np
import pytest
from synthetic import shear_run

from softslip.analysis import figures
from softslip.analysis.figures.shown import shown
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables.tables import creep, flow_curve

HEIGHTS = (0.125, 0.25, 0.5)
VALUES = {"seed": (1, 2), "surface": ("soft", "hard"), "channel_length": (0.25, 0.5)}


def runs_at(heights, **labels):
    return [
        (
            {"stress": stress, "wall_separation": height, **labels},
            shear_run(stress, height=height, duration=1000.0, noise=0.03, profiles=2),
        )
        for stress in (0.15, 0.3)
        for height in heights
    ]


def drawn(runs):
    curve = flow_curve(runs)
    fits = fit_laws(curve)
    return figures.draw("fig9", creep(runs), curve, fits), fits


def words(figure):
    figure.canvas.draw()
    return "\n".join(text.get_text() for text in figure.findobj(matplotlib.text.Text))


def kept(figure, name):
    return [one for one in shown(figure) if one.name == name]


@pytest.fixture(scope="module")
def wide():
    return runs_at(HEIGHTS)


def test_the_fitted_law_is_drawn_where_it_was_fitted(wide):
    figure, fits = drawn(wide)
    (line,) = kept(figure, "Eq. A1 fitted")
    assert not kept(figure, "Eq. A1")
    at = fits.sel(stress=0.3)
    slip, bulk = float(at["mooney_slip_velocity"]), float(at["mooney_shear_rate_bulk"])
    expected = 2 * slip / line.points["wall_separation"].values + bulk
    np.testing.assert_allclose(line.points["shear_rate_wall"].values, expected, rtol=1e-12)
    paths = [each.get_xydata() for each in figure.axes[2].lines]
    drawn_line = np.column_stack([each.values for each in line.points.values()])
    assert any(np.array_equal(drawn_line, path) for path in paths if len(path) == len(drawn_line))
    for level in (slip, bulk):
        assert any(len(path) > 2 and np.ptp(path[:, 1]) == 0 and path[0, 1] == level
                   for path in paths), "what does not depend on H is no level line"  # fmt: skip
    (parameters,) = kept(figure, "Eq. A1 fitted: parameters")
    assert parameters.points["mooney_slip_velocity"].values.tolist() == [slip]
    said = words(figure)
    assert "fitted: $V_s$ = " in said
    assert "of $H$ =" not in said


def test_the_pinned_law_is_drawn_where_none_was_fitted(wide):
    few = [(labels, run) for labels, run in wide if labels["wall_separation"] > 0.2]
    figure, fits = drawn(few)
    assert np.isnan(fits["mooney_slip_velocity"]).all()
    (line,) = kept(figure, "Eq. A1")
    assert not kept(figure, "Eq. A1 fitted")
    assert float(line.at["wall_separation"].values) == 0.5
    said = words(figure)
    assert "of $H$ = 0.5" in said
    assert "fitted" not in said


def test_one_separation_is_said():
    alone = [({"stress": 0.3}, shear_run(0.3, duration=60.0, profiles=2))]
    figure, _ = drawn(alone)
    assert "one wall separation only: sweep channel.height to compare" in words(figure)
    words(drawn([({}, alone[0][1])])[0])


@pytest.mark.parametrize("extra", VALUES)
def test_any_further_dimension_is_drawn(wide, extra):
    every = [({**labels, extra: value}, run) for labels, run in wide for value in VALUES[extra]]
    figure, _ = drawn(every)
    rows = {axes.get_subplotspec().rowspan.start for axes in figure.axes}
    assert len(rows) == (1 if extra == "seed" else 2)
    assert len(kept(figure, "Eq. A1 fitted")) == len(rows)


def test_imposed_rates_are_drawn(wide):
    curve, series = (
        table(wide).rename(stress="imposed_shear_rate") for table in (flow_curve, creep)
    )
    rates = {"imposed_shear_rate": [0.1, 0.5]}
    curve, series = curve.assign_coords(rates), series.assign_coords(rates)
    figure = figures.draw("fig9", series, curve, fit_laws(curve))
    assert not kept(figure, "Eq. A1 fitted")
    words(figure)
