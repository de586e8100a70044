import importlib

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PolyCollection
from matplotlib.markers import MarkerStyle
from matplotlib.quiver import Quiver
from synthetic import HEIGHT, LENGTH, shear_run, sweep

from softslip.analysis import figures
from softslip.analysis.figures import membranes
from softslip.analysis.figures.drawing import COLOURS, LINES, MARKERS
from softslip.analysis.figures.markers import DRIFTING, MEANINGS, STEADY, WITHIN_ERROR
from softslip.analysis.figures.panels import Family
from softslip.analysis.figures.shown import shown
from softslip.analysis.figures.velocity import STATES
from softslip.analysis.fits import fit_laws
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.tables import creep, flow_curve, profiles
from softslip.errors import DatasetError
from softslip.files.stamps import check_figure
from softslip.files.storage import read_dataset, write_dataset
from softslip.solver.geometry import polygon_area

STRESSES, ROUGHNESSES = (0.05, 0.15, 0.3, 0.5), (0.0, 0.59)
GAPS = {(0.15, 0.59, 1), (0.3, 0.59, 1)}


@pytest.fixture(scope="module")
def runs():
    return sweep(STRESSES, ROUGHNESSES, missing=GAPS, duration=300.0, profiles=10)


@pytest.fixture(scope="module")
def curve(runs):
    return flow_curve(runs)


@pytest.fixture(scope="module")
def sampled():
    return shear_run(0.5, 0.59, 3, snapshots=(5.0, 17.5), duration=30.0)


def words(figure):
    """All text of a drawn figure."""
    figure.canvas.draw()
    found = [text.get_text() for text in figure.findobj(matplotlib.text.Text)]
    return "\n".join(text for text in found if text)


def drawn(curve):
    return figures.draw("fig5", curve, fit_laws(curve))


def transients(runs):
    curve = flow_curve(runs)
    return figures.draw("fig8", creep(runs), curve, fit_laws(curve))


def test_missing_runs_are_counted(runs, curve):
    for figure in (
        drawn(curve),
        transients(runs),
        figures.draw("fig4", profiles(runs)),
    ):
        assert "2 of 8 runs missing" in words(figure)


def test_walls_without_any_run_are_named_as_missing_and_not_in_the_legend(runs):
    some = [(labels, run if labels["roughness"] == 0.0 else None) for labels, run in runs]
    curve = flow_curve(some)
    for figure in (drawn(curve), figures.draw("fig6", curve, fit_laws(curve)), transients(some)):
        lines = words(figure).splitlines()
        assert any("among them all at $\\beta$ = 0.59" in line for line in lines)
        assert not any(line.startswith("$\\beta$ = 0.59") for line in lines)


def test_every_wall_has_a_marker_that_can_be_half_filled_and_is_seen():
    assert set(MARKERS) <= set(MarkerStyle.filled_markers)
    assert len(MARKERS) == len(set(MARKERS))
    family = Family("roughness", tuple(range(9)))
    assert min(family.look(number)["markersize"] for number in range(9)) >= 5.5


def test_every_state_of_any_panel_is_explained(curve):
    drifting = xr.zeros_like(curve["steady_bulk"])
    table = curve.drop_vars("verdict_bulk").assign(steady_bulk=drifting)
    said = words(figures.draw("fig6", table, fit_laws(curve)))
    assert MEANINGS[DRIFTING] in said


def test_walls_have_a_line_for_each_verdict_on_all_seeds_together(runs):
    one = profiles(runs).isel(seed=0, drop=True)
    verdict = one["verdict_wall"].copy()
    said_of = {0.05: STEADY, 0.15: WITHIN_ERROR, 0.3: DRIFTING, 0.5: STEADY}
    for stress, each in said_of.items():
        verdict.loc[{"stress": stress}] = each
    table = one.assign(verdict_wall=verdict, steady_wall=verdict != DRIFTING)
    figure = figures.draw("fig4", table)
    said = words(figure)
    for _, meaning in STATES.values():
        assert meaning in said
    kinds = {one.name for one in shown(figure) if one.panel == "left"}
    assert kinds == {f"walls {state}" for state in STATES}
    assert len({line for line, _ in STATES.values()}) == len(STATES)


def test_profiles_judge_seeds_as_the_flow_curve_does(runs, curve):
    pooled = mean_over_seeds(profiles(runs))
    assert (pooled["verdict_wall"] == mean_over_seeds(curve)["verdict_wall"]).all()


def test_every_wall_has_a_line_style_of_its_own():
    assert len(LINES) == len(COLOURS) == len(set(LINES))


def test_walls_without_any_run_have_no_panel(runs):
    some = [(labels, run if labels["roughness"] == 0.0 else None) for labels, run in runs]
    rough, smooth = transients(some).axes[:2]
    for panel in (rough, smooth):
        assert r"$\beta$ = 0" in panel.get_title()
        assert panel.lines


def test_complete_data_needs_no_note(runs):
    done = [(labels, run) for labels, run in runs if labels["roughness"] == 0.0]
    assert "missing" not in words(transients(done))


@pytest.mark.parametrize("extra", ["seed", "wall_separation", "surface"])
def test_any_further_dimension_is_drawn(runs, extra):
    values = {"seed": (1, 2), "wall_separation": (0.125, 0.25), "surface": ("soft", "hard")}[extra]
    every = [({**labels, extra: value}, run) for labels, run in runs for value in values]
    table = flow_curve(every)
    for figure in (
        drawn(table),
        transients(every),
        figures.draw("fig4", profiles(every)),
    ):
        said = words(figure)
        assert "4 of 16 runs missing" in said
        if extra != "seed":
            rows = {axes.get_subplotspec().rowspan.start for axes in figure.axes}
            assert len(rows) in (2, 4), "each value has its row of panels, or two"
            assert str(values[1]) in said


def test_one_unlabelled_run_is_drawn():
    alone = [({}, shear_run(0.3, duration=60.0, profiles=10))]
    table = flow_curve(alone)
    said = words(drawn(table))
    assert "no fit: too few steady points" in said
    assert r"$\beta$ = 0" in said
    words(transients(alone))
    words(figures.draw("fig4", profiles(alone)))


def test_imposed_rates_are_drawn(curve):
    driven = curve.rename(stress="imposed_shear_rate").assign_coords(
        imposed_shear_rate=[0.01, 0.05, 0.2, 0.6]
    )
    assert len(drawn(driven).axes) == 2


def test_units_stand_on_every_axis(runs, curve, sampled):
    for figure, units in (
        (drawn(curve), ("[1 / time unit]", "[stress unit]")),
        (transients(runs), ("[1 / time unit]", "[time unit]")),
        (membranes.snapshot(sampled), ("[length unit]",)),
    ):
        said = words(figure)
        assert all(unit in said for unit in units), f"{units} not all in {said!r}"


def test_paper_and_fit_are_named_in_the_flow_curve():
    full = flow_curve(
        sweep((0.08, 0.15, 0.2, 0.3, 0.5), (0.0,), duration=1500.0, noise=0.03, profiles=4)
    )
    said = words(drawn(full))
    assert r"paper: $\sigma_y = 0.055 \pm 0.004$" in said
    assert r"$n = 0.57 \pm 0.03$" in said
    assert "all $\\beta$:\n$\\sigma_y$" in said


def test_unsteady_points_are_open_and_their_bars_dashed(curve):
    seen = set()
    for container in drawn(curve).axes[1].containers:
        marker, _, bars = container.lines
        is_open = marker.get_markerfacecolor() == "white"
        is_dashed = bars[0].get_linestyle()[0][1] is not None
        assert is_open == is_dashed
        seen.add(is_open)
    assert seen == {True, False}, "the example has no steady, or no unsteady, point"


def test_rates_that_are_not_positive_become_arrows(curve):
    spoiled = curve.copy(deep=True)
    spoiled["shear_rate_bulk"][0, 0] = -1e-6
    figure = drawn(spoiled)
    arrows = [text for text in figure.axes[1].texts if getattr(text, "arrow_patch", None)]
    assert len(arrows) == 1
    assert "arrows at the left: rate not positive" in words(figure)


def test_run_without_bulk_has_no_bulk_curve(runs):
    bare = [
        (labels, run if run is None else run.drop_vars(["shear_rate_bulk", "slip_velocity"]))
        for labels, run in runs
    ]
    table = flow_curve(bare)
    assert "no fit: too few steady points: 0 of at least 4" in words(drawn(table))
    words(transients(bare))


def polygons(figure, colour):
    wanted = matplotlib.colors.to_rgba(colour)
    return [
        path.vertices
        for collection in figure.axes[0].findobj(PolyCollection)
        if np.allclose(collection.get_facecolor()[0], wanted) and not isinstance(collection, Quiver)
        for path in collection.get_paths()
    ]


def test_snapshot_shows_each_particle_once(sampled):
    """The parts inside the box of all images of a particle add up to its area."""
    from softslip.analysis.figures.membranes import PARTICLE

    images = polygons(membranes.snapshot(sampled), PARTICLE)
    inside = 0.0
    for image in images:
        fine = np.linspace(0, 1, 400, endpoint=False)
        corners = np.arange(len(image))
        x = np.interp(fine * (len(image) - 1), corners, image[:, 0]).clip(0, LENGTH)
        y = np.interp(fine * (len(image) - 1), corners, image[:, 1])
        inside += abs(polygon_area(x, y))
    nodes = sampled["node_position"].values[0]
    sizes = sampled["nodes_per_particle"].values
    contours = np.split(nodes, np.cumsum(sizes))[: len(sizes)]
    area = sum(abs(polygon_area(*contour.T)) for contour in contours)
    assert inside == pytest.approx(area, rel=0.01)


def test_walls_cover_the_channel_whatever_their_displacement(sampled):
    lower, upper = polygons(membranes.snapshot(sampled), "black")[:2]
    assert lower[:, 0].min() <= 0
    assert lower[:, 0].max() >= LENGTH
    assert upper[:, 1].min() < HEIGHT - 0.4 * 0.59 * 0.00846
    assert lower[:, 1].max() == pytest.approx(0.59 * 0.00846, rel=1e-3)


def test_arrows_keep_out_of_the_walls(sampled):
    arrows = membranes.snapshot(sampled).axes[0].findobj(Quiver)[0]
    assert 20 < len(arrows.X) < 36**2
    assert arrows.Y.min() > 0
    assert arrows.Y.max() < HEIGHT


def test_snapshot_is_found_by_time_and_named(sampled):
    assert "$t$ = 17.5" in words(membranes.snapshot(sampled, time=16.0))
    assert r"$\beta$ = 0.59" in words(membranes.snapshot(sampled))
    with pytest.raises(DatasetError, match="has 2 snapshots, so there is none of number 2"):
        membranes.snapshot(sampled, 2)


def test_snapshot_at_rest_says_why_it_has_no_arrows(sampled):
    still = sampled.assign(velocity=xr.zeros_like(sampled["velocity"]))
    assert "no arrows: the bulk does not flow" in words(membranes.snapshot(still))


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_same_figure_gives_the_same_bytes(curve, tmp_path, suffix):
    first, second = tmp_path / f"first{suffix}", tmp_path / f"second{suffix}"
    for path in (first, second):
        figures.save_figure(drawn(curve), path, {"scenario": "demo", "title": "Flow curve"})
    assert first.read_bytes() == second.read_bytes()


def test_saved_figure_carries_its_metadata(curve, tmp_path):
    path = tmp_path / "deep" / "flow.png"
    labels = {"runs": ["a1", "b2"], "scenario": "demo"}
    figures.save_figure(drawn(curve), path, labels, {"host": "here"})
    found = check_figure(path)
    assert {key: found[key] for key in labels} == labels
    assert found["provenance"] == {"host": "here"}
    image = importlib.import_module("PIL.Image").open(path)
    assert image.text["Software"].startswith("softslip ")
    assert image.size[0] == pytest.approx(2100, abs=2)


def test_failed_save_leaves_the_old_figure_and_no_litter(curve, tmp_path):
    path = tmp_path / "flow.png"
    path.write_bytes(b"old")
    with pytest.raises(TypeError):
        figures.save_figure(drawn(curve), path, {"runs": object()})
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(DatasetError, match=r"cannot save a figure as '\.jpg'"):
        figures.save_figure(drawn(curve), tmp_path / "flow.jpg", {})


def test_datasets_read_back_are_drawn_alike(runs, curve, tmp_path):
    write_dataset(curve, tmp_path / "curve.nc", stage="flow_curve", run="demo", title="Curve")
    back = read_dataset(tmp_path / "curve.nc", stage="flow_curve")
    for name, table in (("before.png", curve), ("after.png", back)):
        figures.save_figure(drawn(table), tmp_path / name, {})
    assert (tmp_path / "before.png").read_bytes() == (tmp_path / "after.png").read_bytes()


def test_channel_without_particles_is_drawn(sampled):
    wall = 2 * int(sampled.attrs["wall_nodes"])
    empty = sampled.isel(node=slice(-wall, None), particle=slice(0, 0))
    words(membranes.snapshot(empty))


def test_drawing_leaves_the_users_settings_alone(curve):
    before = dict(matplotlib.rcParams)
    drawn(curve)
    assert dict(matplotlib.rcParams) == before
