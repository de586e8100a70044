"""Shapes, films and lengths, against shapes and fields whose answers are known."""

import numpy as np
import pytest
import shapely
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.text import Text
from scenes import generator
from synthetic import HEIGHT, LENGTH, RADIUS, shear_run, sweep

from softslip.analysis.figures import draw
from softslip.analysis.figures.markers import DRIFTING, STEADY
from softslip.analysis.figures.shown import shown
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.contours import contours, film_thickness, shapes
from softslip.analysis.observables.series import parameters_of
from softslip.analysis.observables.structure import cooperativity_length, structure
from softslip.analysis.observables.tables import flow_curve
from softslip.errors import DatasetError
from softslip.files.dataset_check import check_dataset

LATE = (400.0, 450.0, 500.0, 550.0)


def ellipse(long, short, angle, centre=(0.0, 0.0), corners=400):
    turn = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    points = np.column_stack((long * np.cos(turn), short * np.sin(turn)))
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return points @ rotation.T + centre


@given(
    st.floats(1.0, 5.0),
    st.floats(-3.0, 3.0),
    st.floats(-1e3, 1e3),
    st.floats(1e-6, 1e6),
    st.booleans(),
)
def test_an_ellipse_has_its_own_stretch(aspect, angle, place, size, backwards):
    corners = size * ellipse(aspect, 1.0, angle, centre=(place, -place))
    centroids, stretch = shapes([corners[::-1] if backwards else corners])
    wanted = (aspect - 1) / (aspect + 1) * np.array([np.cos(2 * angle), np.sin(2 * angle)])
    # Far from the origin coordinates have fewer digits than the shape needs.
    assert stretch[0] == pytest.approx(wanted, abs=1e-9 + 1e-12 * abs(place))
    assert centroids[0] == pytest.approx(size * np.array([place, -place]), abs=1e-9 * size)


def test_no_particles_have_no_shapes():
    centroids, stretch = shapes([])
    assert centroids.shape == stretch.shape == (0, 2)


@given(st.floats(-2.0, 2.0), st.floats(0.01, 0.5), st.integers(3, 40))
def test_the_film_along_a_wall_is_that_of_the_shapes_themselves(shift, gap, corners):
    """Particles in any period; distances by shapely, over three images of each."""
    wall = np.column_stack((np.linspace(0, 1, 50, endpoint=False) + 0.7 * shift, np.zeros(50)))
    particles = [
        ellipse(0.3, 0.2, 0.4, (0.2 + shift, 0.3 + gap), corners),
        ellipse(0.25, 0.25, 0.0, (0.7 - 3 * round(shift), 0.25 + gap), corners),
    ]
    images = [
        shapely.Polygon(each + np.array([period, 0.0])).exterior
        for each in particles
        for period in np.arange(-8, 9)
    ]
    both = shapely.union_all(images)
    exact = np.array([shapely.Point(point).distance(both) for point in wall])
    found, nearest = film_thickness(wall, particles, 1.0)
    # The nearest corner is an end of the nearest side where corners are closer than the film.
    assert np.all(found >= exact - 1e-12)
    side = max(np.linalg.norm(np.diff(each, axis=0), axis=1).max() for each in particles)
    assert found == pytest.approx(exact, abs=max(side**2 / (8 * gap), 1e-9) + 0.1 * side)
    if corners >= 30:
        assert found == pytest.approx(exact, abs=0.01)
        parts = [shapely.union_all(images[start : start + 17]) for start in (0, 17)]
        apart = np.array(
            [[shapely.Point(point).distance(each) for each in parts] for point in wall]
        )
        clear = np.abs(apart[:, 0] - apart[:, 1]) > 0.02
        assert (nearest[clear] == apart.argmin(axis=1)[clear]).all()


def test_cooperativity_is_found_to_its_error():
    """Of 400 sets of noisy bins; bulk, wall and length are known."""
    distance = np.arange(0.25, 12, 0.5)
    exact, noise = 2.0 + 3.0 * np.exp(-distance / 1.7), 0.05
    found = []
    for seed in range(400):
        bins = exact + noise * generator(seed).standard_normal(distance.size)
        found.append(cooperativity_length(distance, bins, np.full_like(distance, noise)))
    lengths, errors = np.array(found).T
    assert np.isfinite(lengths).all()
    deviation = (lengths - 1.7) / errors
    assert abs(deviation.mean()) < 0.2
    assert np.mean(np.abs(deviation) < 1) == pytest.approx(0.68, abs=0.06)


@pytest.mark.parametrize(
    "bins",
    [
        lambda y: np.full_like(y, 2.0) + 0.01 * generator(1).standard_normal(y.size),
        lambda y: np.full_like(y, np.nan),
        lambda y: 2.0 + 0.3 * y,
        np.zeros_like,
    ],
    ids=["flat", "nothing", "straight", "zero"],
)
def test_what_bins_do_not_determine_has_no_length(bins):
    distance = np.arange(0.25, 12, 0.5)
    found = cooperativity_length(distance, bins(distance), np.full_like(distance, 0.01))
    assert np.isnan(found).all()


def test_few_bins_have_no_length():
    y = np.arange(0.25, 3.0, 0.5)
    assert np.isnan(cooperativity_length(y, np.exp(-y), np.full_like(y, 0.01))).all()


def single(run):
    return structure([({"stress": 0.3, "roughness": 0.0}, run)]).squeeze()


@pytest.mark.parametrize("waves", [2, 3, 5])
def test_a_wave_is_correlated_over_its_own_length(waves):
    """cos(k d) falls to 1/e at d = arccos(1/e)/k, up to a straight line between two points."""
    run = shear_run(0.3, snapshots=LATE)
    x = run["field_x"].values
    across = 1e-3 * np.cos(2 * np.pi * waves * x / LENGTH + 0.3)
    run["velocity"][..., 1] = np.broadcast_to(across, run["velocity"].shape[:-1])
    wanted = np.arccos(np.exp(-1)) / (2 * np.pi * waves / LENGTH) / RADIUS
    found = single(run)
    assert float(found["correlation_length"]) == pytest.approx(wanted, rel=0.06)
    assert float(found["correlation_length_error"]) == pytest.approx(0, abs=1e-9)


def test_a_flow_without_fluctuations_has_no_correlation():
    run = shear_run(0.3, snapshots=LATE)
    run["velocity"][..., 1] = 0.0
    assert np.isnan(float(single(run)["correlation_length"]))


def test_stretched_particles_are_seen_at_their_distance():
    """Each replaced by an ellipse: stretched by 0.2 near walls, not at all in the middle."""
    run = shear_run(0.3, snapshots=LATE)
    nodes = run["node_position"].values
    for number in range(len(LATE)):
        particles, walls = contours(run, number)
        centroids, _ = shapes(particles)
        depth = np.minimum(centroids[:, 1], HEIGHT - centroids[:, 1])
        long = np.where(depth < 2 * RADIUS, 1.5, 1.0)
        replaced = [
            ellipse(a * RADIUS, RADIUS, 0.6, centre, len(each))
            for a, centre, each in zip(long, centroids, particles, strict=True)
        ]
        nodes[number] = np.concatenate([*replaced, *walls])
    run["node_position"].values = nodes
    found = single(run)
    near = found.sel(particle_distance=1.0)
    assert float(near["deformation"]) == pytest.approx(0.2, abs=2e-3)
    assert float(near["orientation"]) == pytest.approx(np.degrees(0.6), abs=0.3)
    far = found["deformation"].sel(particle_distance=slice(2.0, None)).values
    assert far[np.isfinite(far)] == pytest.approx(0, abs=2e-3)


def test_the_first_layer_has_the_gaps_of_its_circles():
    run = shear_run(0.3, snapshots=LATE)
    nodes, wanted = run["node_position"].values, []
    for number in range(len(LATE)):
        particles, walls = contours(run, number)
        centroids, _ = shapes(particles)
        circles = [
            ellipse(0.9 * RADIUS, 0.9 * RADIUS, 0.0, centre, len(each))
            for centre, each in zip(centroids, particles, strict=True)
        ]
        nodes[number] = np.concatenate([*circles, *walls])
        gaps = []
        for wall in walls:
            images = [
                shapely.linearrings([each + np.array([period * LENGTH, 0.0]) for each in circles])
                for period in (-1, 0, 1)
            ]
            points = shapely.points(wall)[:, None]
            film = np.min([shapely.distance(points, each) for each in images], axis=0)
            gaps += [film[:, each].min() for each in np.unique(film.argmin(axis=1))]
        wanted.append(np.mean(gaps))
    run["node_position"].values = nodes
    gap = float(single(run)["first_layer_gap"]) * parameters_of(run).steric.length
    assert gap == pytest.approx(np.mean(wanted), rel=0.02)


def test_particles_carry_what_the_solvent_does_not():
    run = shear_run(0.3, noise=0.0, snapshots=LATE)
    found = single(run)
    viscosity = parameters_of(run).solvent.viscosity
    carried = 0.3 * (1 - viscosity * found["fluidity"].values)
    assert found["particle_stress"].values == pytest.approx(carried, rel=1e-9, nan_ok=True)
    assert np.isfinite(carried).sum() > 10


def test_fluidity_is_the_local_slope_over_the_stress():
    run = shear_run(0.3, noise=0.0, snapshots=LATE)
    found = single(run)
    middle = found["fluidity"].sel(distance_from_wall=slice(5, None)).values
    rate = float(run["shear_rate_bulk"][-1])
    assert middle == pytest.approx(rate / 0.3, rel=0.02)
    assert float(found["fluidity"][0]) > 1.5 * rate / 0.3


@pytest.fixture(scope="module")
def table():
    return structure(
        sweep(
            (0.1, 0.3, 0.5), (0.0, 0.59), missing={(0.3, 0.59, 1)}, snapshots=LATE, duration=600.0
        )
    )


def test_a_table_of_runs_keeps_to_its_schema(table):
    check_dataset(table, "structure")
    missing = table.sel(stress=0.3, roughness=0.59).squeeze()
    assert missing["status"].item() == "missing"
    assert np.isnan(missing["wall_film"].values).all()
    film = table["wall_film"].where(table["status"] == "done", drop=False)
    assert (film.diff("quantile").fillna(1.0) > 0).all()


def test_runs_without_snapshots_have_only_what_profiles_say():
    found = single(shear_run(0.3))
    assert float(found["structure_snapshots"]) == 0
    assert np.isnan(found["deformation"]).all()
    assert np.isfinite(found["fluidity"]).any()


def test_nothing_done_is_refused():
    with pytest.raises(DatasetError, match="none of 1 runs is done"):
        structure([({"stress": 0.1}, None)])


def test_channels_of_several_heights_share_their_bins():
    runs = [
        ({"stress": 0.3, "wall_separation": height}, shear_run(0.3, height=height, snapshots=LATE))
        for height in (HEIGHT, 1.5 * HEIGHT)
    ]
    found = structure(runs).squeeze()
    reach = 0.5 * HEIGHT / RADIUS
    low = found["fluidity"].isel(wall_separation=0)
    assert np.isnan(low.sel(distance_from_wall=slice(reach + 0.5, None))).all()
    assert (
        np.isfinite(found["fluidity"].isel(wall_separation=1).values).sum() > np.isfinite(low).sum()
    )


@pytest.mark.parametrize("axes", [{}, {"K_e": (1.0, 2.0)}])
def test_the_page_draws_what_there_is(table, axes):
    for name, values in axes.items():
        table = xr.concat([table] * len(values), dim=name).assign_coords({name: list(values)})
        table["status"] = table["status"].transpose(name, ...)
    figure = draw("structure", table)
    series = shown(figure)
    assert {each.panel for each in series} >= set("abcdefg")
    films = [each for each in series if each.panel == "e"]
    assert sum(len(each.points["wall_film"].values) for each in films) == 5 * max(
        (len(values) for values in axes.values()), default=1
    )


def written(figure):
    figure.canvas.draw()
    return [
        "\n".join(text.get_text() for text in axes.findobj(Text)) for axes in figure.axes
    ], "\n".join(text.get_text() for text in figure.findobj(Text))


def test_panels_without_snapshots_say_so(table):
    names = ("deformation", "orientation", "wall_film", "first_layer_gap", "correlation_length")
    bare = table.assign({name: xr.full_like(table[name], np.nan) for name in names})
    bare["structure_snapshots"] = xr.zeros_like(bare["structure_snapshots"])
    panels, _ = written(draw("structure", bare))
    for panel in panels[2:7]:
        assert "no snapshot in a steady window" in panel
    assert "no snapshot" not in panels[0]


def test_seeds_are_judged_as_in_the_flow_curve():
    runs = sweep((0.05, 0.15, 0.3, 0.5), (0.0, 0.59), (1, 2), duration=300.0)
    found, curve = (mean_over_seeds(part(runs)) for part in (structure, flow_curve))
    for name in ("verdict_wall", "verdict_bulk", "steady_wall", "steady_bulk"):
        assert (found[name] == curve[name]).all()
    assert len(set(found["verdict_bulk"].values.ravel())) > 1


def test_lengths_of_drifting_runs_are_open(table):
    done = table["status"] == "done"
    flags = table.assign(
        steady_wall=done,
        verdict_wall=xr.where(done, STEADY, ""),
        steady_bulk=xr.zeros_like(done),
        verdict_bulk=xr.where(done, DRIFTING, ""),
    )
    figure = draw("structure", flags)
    _, said = written(figure)
    assert "open, dashed bars: drifting" in said
    for panel, face in ((4, None), (6, "white")):
        points = [line for line in figure.axes[panel].lines if len(line.get_xdata())]
        marked = {line.get_markerfacecolor() for line in points if line.get_marker() == "o"}
        assert (marked == {face}) == (face == "white")
