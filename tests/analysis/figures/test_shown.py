"""The numbers that are kept with a figure are those of its artists, for every figure."""

import matplotlib
import numpy as np
import pytest
import stability_synthetic
import tradeoff_synthetic
import validation_synthetic as cases
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from synthetic import LENGTH, shear_run, sweep

from softslip.analysis import figures
from softslip.analysis.figures import membranes
from softslip.analysis.figures.markers import MEANINGS
from softslip.analysis.figures.membranes import PARTICLE
from softslip.analysis.figures.shown import Quantity, show, shown
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.tables import creep, flow_curve, profiles
from softslip.files.products import FIGURES
from softslip.studies.tradeoff.table import gather

GAPS = {(0.15, 0.59, 1), (0.3, 0.59, 1), (0.3, 0.59, 2)}


@pytest.fixture(scope="module")
def runs():
    return sweep(
        (0.05, 0.08, 0.15, 0.3, 0.5), (0.0, 0.59), (1, 2), GAPS, duration=300.0, profiles=4
    )


@pytest.fixture(scope="module")
def curve(runs):
    return flow_curve(runs)


@pytest.fixture(scope="module")
def table():
    return gather(tradeoff_synthetic.members(), tradeoff_synthetic.long_runs())


def series(figure, panel=None, name=None):
    return [
        each
        for each in shown(figure)
        if (panel is None or each.panel == panel) and (name is None or each.name == name)
    ]


def points(some, *names):
    """All points of some series, as a set of tuples without NaN."""
    found = set()
    for each in some:
        columns = [np.asarray(each.points[name].values, float) for name in names]
        found |= {tuple(map(float, row)) for row in zip(*columns, strict=True)}
    return {row for row in found if np.isfinite(row).all()}


def lines(axes, keep=lambda line: True):
    """All points of the lines of some axes."""
    found = set()
    for line in axes.lines:
        if keep(line):
            both = line.get_xdata(), line.get_ydata()
            data = np.column_stack([np.atleast_1d(np.asarray(each, float)) for each in both])
            found |= {tuple(map(float, row)) for row in data if np.isfinite(row).all()}
    return found


def is_data(line):
    """Whether a line is no guide: those lie in another frame, or behind all data in grey."""
    return line.get_transform().contains_branch(line.axes.transData)


def test_every_figure_of_numbers_is_exported():
    from softslip.cli.draw import FIGURES as drawn

    assert set(drawn) == set(FIGURES)


@pytest.mark.parametrize("below", [False, True])
def test_flow_curves(curve, below):
    spoiled = curve.copy(deep=True)
    if below:
        spoiled["shear_rate_bulk"][1, 0] = -1e-6
    fits = fit_laws(spoiled)
    figure = figures.draw("fig5", spoiled, fits)
    for axes, name in zip(figure.axes, ("shear_rate_wall", "shear_rate_bulk"), strict=True):
        drawn, bars = set(), []
        for each in axes.containers:
            if isinstance(each, ErrorbarContainer):
                marker, _, (bar,) = each.lines
                drawn |= set(zip(*map(np.ndarray.tolist, marker.get_data()), strict=True))
                bars += [segment[1, 0] for segment in bar.get_segments()]
        kept = [one for kind in MEANINGS for one in series(figure, name, kind)]
        assert points(kept, name, "shear_stress") == drawn
        assert len(drawn) >= 8
        # The upper end of each bar is the rate with its error.
        ends = [
            np.asarray(one.points[name].values)
            + np.nan_to_num(np.asarray(one.points[f"{name}_error"].values))
            for one in kept
        ]
        assert sorted(np.concatenate(ends)) == pytest.approx(sorted(bars), rel=1e-15)
        arrows = [text.xyann[1] for text in axes.texts if getattr(text, "arrow_patch", None)]
        hidden = series(figure, name, "rate not positive")
        heights = [value for one in hidden for value in one.points["shear_stress"].values]
        assert len(heights) == len(arrows) == int(below and name == "shear_rate_bulk")


def test_fitted_flow_law():
    done = sweep((0.08, 0.15, 0.2, 0.3, 0.5), (0.0,), duration=1500.0, noise=0.03, profiles=4)
    curve = flow_curve(done)
    fits = fit_laws(curve)
    figure = figures.draw("fig5", curve, fits)
    (fit,) = series(figure, "shear_rate_bulk", "flow law fitted to all roughnesses")
    assert points([fit], "shear_rate_bulk", "shear_stress") <= lines(figure.axes[1])
    band = figure.axes[1].collections
    edges = {tuple(row) for each in band for path in each.get_paths() for row in path.vertices}
    for side in ("low", "high"):
        assert points([fit], "shear_rate_bulk", f"shear_stress_{side}") <= edges
    (law,) = series(figure, "shear_rate_bulk", "flow law fitted to all roughnesses: parameters")
    assert float(law.points["flow_index"].values[0]) == float(fits["pooled_flow_index"])


def test_flow_curves_are_means_over_seeds_with_their_coordinates(curve):
    figure = figures.draw("fig5", curve, fit_laws(curve))
    mean = mean_over_seeds(curve)
    count = 0
    for one in series(figure, "shear_rate_wall"):
        if "roughness" in one.at:
            cell = mean.sel(roughness=one.at["roughness"].values)
            for number, stress in enumerate(one.points["stress"].values):
                for name in ("shear_rate_wall", "shear_rate_wall_error", "shear_stress"):
                    found = one.points[name].values[number]
                    np.testing.assert_equal(found, float(cell.sel(stress=stress)[name]))
                count += 1
    assert count == int((mean["status"] == "done").sum())
    assert series(figure)[0].points["shear_stress"].unit == "stress unit"


def test_further_dimensions_are_told_apart(runs):
    every = [
        ({**labels, "surface": name}, run) for labels, run in runs for name in ("soft", "hard")
    ]
    table = flow_curve(every)
    for figure in (
        figures.draw("fig5", table, fit_laws(table)),
        figures.draw("fig8", creep(every), table, fit_laws(table)),
        figures.draw("fig4", profiles(every)),
    ):
        found = {one.at["surface"].values for one in shown(figure) if "surface" in one.at}
        assert found == {"soft", "hard"}


def test_creep(runs):
    table = flow_curve(runs)
    figure = figures.draw("fig8", creep(runs), table, fit_laws(table))
    names = ("shear_rate_wall", "shear_rate_wall", "shear_rate_bulk")
    for axes, panel, name in zip(figure.axes[:3], "abc", names, strict=True):
        assert points(series(figure, panel), "time", name) == lines(axes)
        assert len(axes.lines) == len(series(figure, panel)) > 3
    assert {one.at["seed"].values for one in series(figure, "a", "run")} == {1, 2}


@pytest.mark.parametrize("chance", [0.3, 0.04])
def test_collapse_of_creep(runs, chance):
    table = flow_curve(runs)
    known = np.isfinite(table["master_curve_spread_ratio"].values)
    assert known.sum() >= 3
    table["master_curve_spread_chance"][0] = chance
    figure = figures.draw("fig8", creep(runs), table, fit_laws(table))
    (kept,) = series(figure, "f", "collapse")
    panel = figure.axes[5]
    drawn = {
        row: line.get_markerfacecolor()
        for line in panel.lines
        if is_data(line) and line.get_marker() == "o"
        for row in zip(*map(np.ndarray.tolist, map(np.asarray, line.get_data())), strict=True)
    }
    assert points([kept], "stress", "master_curve_spread_ratio") == set(drawn)
    assert len(drawn) == known.sum()
    first = drawn[(0.05, float(table["master_curve_spread_ratio"][0]))]
    assert (first == "white") == (chance < 0.05)


def test_one_roughness_has_no_collapse():
    alone = sweep((0.1, 0.3), (0.0,), duration=300.0)
    table = flow_curve(alone)
    figure = figures.draw("fig8", creep(alone), table, fit_laws(table))
    assert "one roughness only" in [text.get_text() for text in figure.axes[5].texts]
    assert not series(figure, "f")


def test_profiles(runs):
    figure = figures.draw("fig4", profiles(runs))
    left, right = figure.axes[:2]
    for axes, panel in ((left, "left"), (right, "right")):
        drawn = lines(axes) - {(0.0, 0.0), (1.0, 1.0)}
        kept = points(series(figure, panel), "normalised_position", "normalised_velocity")
        assert kept - {(0.0, 0.0), (1.0, 1.0)} == drawn
        assert len(axes.lines) == len(series(figure, panel)) + 1
    styles = {line.get_linestyle() for line in left.lines[:-1]}
    kinds = {one.name for one in series(figure, "left")}
    assert len(styles) == len(kinds)


def test_snapshot():
    run = shear_run(0.5, 0.59, 3, snapshots=(5.0, 17.5), duration=30.0)
    figure = membranes.snapshot(run, 1)
    (axes,) = figure.axes
    arrows = axes.findobj(Quiver)[0]
    drawn = set(zip(*map(np.ndarray.tolist, (arrows.X, arrows.Y, arrows.U, arrows.V)), strict=True))
    names = ("x", "y", "non_affine_velocity_x", "non_affine_velocity_y")
    assert points(series(figure, name="arrow"), *names) == drawn
    wanted = matplotlib.colors.to_rgba(PARTICLE)
    outlines = set()
    walls = set()
    for each in axes.findobj(PolyCollection):
        if not isinstance(each, Quiver):
            corners = {tuple(row) for path in each.get_paths() for row in path.vertices}
            ours = np.allclose(each.get_facecolor()[0], wanted)
            outlines, walls = (outlines | corners, walls) if ours else (outlines, walls | corners)
    particles = series(figure, name="particle")
    assert points(particles, "x", "y") == outlines
    assert {one.at["particle"].values for one in particles} == set(range(run.sizes["particle"]))
    for name in ("lower wall", "upper wall"):
        kept = points(series(figure, name=name), "x", "y")
        inside = {corner for corner in walls if 0 <= corner[0] <= LENGTH}
        assert kept <= inside
        assert len(kept) == run.attrs["wall_nodes"]
    assert {one.at["snapshot_time"].values for one in shown(figure)} == {17.5}


def bench(name, particles, **ratios):
    values = {"particles": particles, **ratios}
    dataset = xr.Dataset({key: ((), value, {"units": "1"}) for key, value in values.items()})
    return dataset.assign_attrs(bench=name, fidelity="paper")


def test_benchmark():
    times = np.array([[20.0, 30.0], [10.0, -1e-3], [1.0, 2.0]])
    scaling = xr.Dataset(
        {
            "nanoseconds": (("part", "particles"), times, {"units": "ns"}),
            "exponent": ((), 1.05, {"units": "1"}),
        },
        coords={"part": ["spread", "fft", "rest"], "particles": [50, 100]},
        attrs={"bench": "scaling", "fidelity": "paper"},
    )
    others = [bench("run", 100, ratio=40.0), bench("mobility", 100, ratio=3.0, own_ratio=9.0)]
    figure = figures.draw("benchmark", scaling, *others)
    left, right = figure.axes
    heights = [float(bar.get_height()) for bar in left.patches]
    kept = [
        float(v)
        for one in series(figure, "a", "time of a part")
        for v in one.points["nanoseconds"].values
    ]
    assert kept == heights == np.maximum(times, 0).ravel().tolist()
    ratios = [float(bar.get_height()) for bar in right.patches]
    assert [float(one.points["ratio"].values[0]) for one in series(figure, "b")] == ratios
    assert sorted(ratios) == [3.0, 9.0, 40.0]


def test_trajectory():
    time = np.linspace(0.25, 5.0, 20)
    random = np.random.default_rng(np.random.SeedSequence(4))
    rates = 0.3 + 0.1 * random.random((2, 3, 20))
    units = ("1 / time unit", "length unit / time unit")
    names = ("shear_rate_bulk", "slip_velocity")
    dataset = xr.Dataset(
        {
            **{
                n: (("run", "time"), v, {"units": u})
                for n, v, u in zip(names, rates, units, strict=True)
            },
            "particles": 44,
            "stress": 0.5,
            "grid_difference": ("quantity", [0.005, 0.004]),
            "seed_difference": ("quantity", [0.1, 0.2]),
        },
        coords={"run": ["fidelity", "grid", "second_seed"], "time": time, "quantity": list(names)},
        attrs={"fidelity": "paper"},
    )
    figure = figures.draw("trajectory", dataset)
    for axes, panel, name in zip(figure.axes, "abcd", (*names, *names), strict=True):
        kind = "series" if panel in "ab" else "difference from the level"
        column = name if panel in "ab" else f"{name}_difference"
        kept = series(figure, panel, kind)
        assert points(kept, "time", column) == lines(axes, is_data)
        assert {one.points[column].unit for one in kept} == {units[names.index(name)]}
    assert [
        one.points["slip_velocity_rms_difference"].values[0]
        for one in series(figure, "d", "rms difference")
    ] == [0.4, 20.0]


def test_tradeoff(table):
    figure = figures.draw("tradeoff", table)
    for axes, panel, name in zip(
        figure.axes, "ab", ("total_error", "numerical_error"), strict=True
    ):
        kept = [one for one in series(figure, panel) if name in one.points]
        assert points(kept, "cost_ratio", name) == lines(axes)
        members = {member for one in kept for member in one.points["member"].values}
        assert {"level-standard", "e0.2-n4-t0.01"} <= members
        assert ("mesh-4096" in members) == (panel == "a")
    (scatter,) = series(figure, "a", "scatter between packings")
    (band,) = figure.axes[0].patches
    ends = [float(scatter.points[f"scatter_{end}"].values[0]) for end in ("low", "high")]
    assert ends == pytest.approx([band.get_y(), band.get_y() + band.get_height()], rel=1e-14)


def test_extrapolation(table):
    figure = figures.draw("extrapolation", table)
    names = ("slip_velocity", "shear_rate_bulk") * 2
    for axes, panel, name in zip(figure.axes, "abcd", names, strict=True):
        kept = points(series(figure, panel), "regularisation", f"{name}_over_limit")
        assert kept == lines(axes, is_data_of_extrapolation)
        assert len(kept) > 4
    steady = series(figure, "c", "all runs steady") + series(figure, "c", "not all runs steady")
    assert any("slip_velocity_over_limit_error" in one.points for one in steady)


def is_data_of_extrapolation(line):
    """All but the guides behind, at a ratio of 1 and at the paper's mesh, and ends of bars."""
    return line.get_zorder() > 0 and line.get_marker() not in ("_", "|")


def test_stability_map():
    dataset = stability_synthetic.cells()
    figure = figures.draw("stability_map", dataset)
    for axes, scheme in zip(figure.axes, ("standard", "literal"), strict=True):
        labels = [text.get_text().replace("\n", ", ") for text in axes.texts]
        kept = [label for one in series(figure, scheme) for label in one.points["label"].values]
        assert kept == labels
    total = sum(len(one.points["verdict"].values) for one in shown(figure))
    assert total == dataset.sizes["cell"]


def test_stability_limit():
    dataset = stability_synthetic.limits()
    figure = figures.draw("stability_limit", dataset)
    left, right = figure.axes
    measured = lines(left, lambda line: line.get_label() != "theory")
    assert points(series(figure, "a"), "euler_theory", "euler_limit") == measured
    both = points(series(figure, "b", "rkc2, theory"), "stages", "rkc2_theory")
    both |= points(series(figure, "b", "rkc2, measured"), "stages", "rkc2_limit")
    assert both == lines(right)


def test_validation():
    datasets = (
        cases.dataset(
            "cylinders",
            {"fidelity": ["literal", "paper"], "concentration": [0.1, 0.3, 0.5]},
            leading="drag",
        ),
        cases.dataset(
            "couette",
            {
                "gap": [0.1, 0.2],
                "fidelity": ["paper"],
                "height": [0.1, 0.2, 0.4],
                "mode": ["a", "b"],
            },
            refused=[2],
        ),
        cases.dataset("walls", {"fidelity": ["paper"], "outside": ["still", "periodic"]}),
    )
    figure = figures.draw("validation", *datasets)
    for axes, panel in zip(figure.axes, "abcd", strict=True):
        drawn = sorted(float(y) for line in axes.lines for y in line.get_ydata() if np.isfinite(y))
        values = [
            np.asarray(quantity.values, float)
            for one in series(figure, panel)
            for name, quantity in one.points.items()
            if name.split("_")[-1] in ("error", "tolerance", "result", "reference", "drag")
        ]
        kept = np.concatenate(values)
        assert sorted(kept[np.isfinite(kept)]) == drawn
        along = {"a": "concentration", "b": "height", "c": "outside", "d": "concentration"}[panel]
        assert all(along in one.points for one in series(figure, panel))
    words = [one.points["outside"].values.tolist() for one in series(figure, "c")]
    assert words[0] == ["still", "periodic"]
    at = series(figure, "b", "error")[0].at
    assert (at["case"].values, at["gap"].values, at["mode"].values) == ("couette", 0.1, "a")


def test_what_is_kept_is_a_copy_and_ends_with_its_figure():
    figure = Figure()
    axes = figure.add_subplot()
    values = np.array([1.0, 2.0])
    show(axes, "a", "line", {"x": Quantity(values)}, {"number": Quantity(np.array(3))})
    show(axes, "a", "nothing", {"x": Quantity(np.empty(0))})
    values[0] = 7.0
    (one,) = shown(figure)
    assert one.points["x"].values.tolist() == [1.0, 2.0]
    assert one.at["number"].values == 3
    assert shown(Figure()) == ()
