import math

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.simulation.sample import particle_radii, reference_area, wall_contour
from softslip.solver.geometry import (
    LOWER,
    UPPER,
    Box,
    Layout,
    WallContour,
    polygon_area,
    wall_positions,
)


@st.composite
def contours(draw):
    bumps = draw(st.integers(1, 12))
    length = draw(st.floats(0.05, 2.0))
    return WallContour(length, draw(st.floats(0.05, 0.45)) * length / bumps, bumps)


def outline(contour, x):
    """Height of the lower wall above its flat part."""
    centre = contour.separation * (np.floor(x / contour.separation) + 0.5)
    return np.sqrt(np.maximum(contour.bump_radius**2 - (x - centre) ** 2, 0))


def arc_position(contour, points):
    """Arc length along the contour of points that lie on it."""
    cell = np.floor(points[:, 0] / contour.separation)
    local = points[:, 0] - (cell + 0.5) * contour.separation
    b, rise = contour.bump_radius, 0.5 * contour.separation - contour.bump_radius
    angle = np.pi - np.arctan2(points[:, 1], local)
    on_bump = np.abs(local) < b
    after = rise + math.pi * b + (local - b)
    along = np.where(on_bump, rise + b * angle, np.where(local < 0, local + rise + b, after))
    return cell * contour.arc_length / contour.bumps + along


@given(contours(), st.integers(20, 400))
def test_wall_points_lie_on_flats_and_semicircles(contour, count):
    points = contour.points(count)
    assert points.shape == (count, 2)
    assert np.all((points[:, 0] >= 0) & (points[:, 0] <= contour.length))
    centre = contour.separation * (np.floor(points[:, 0] / contour.separation) + 0.5)
    radius = np.hypot(points[:, 0] - centre, points[:, 1])
    on_bump = points[:, 1] > 1e-9 * contour.length
    assert radius[on_bump] == pytest.approx(contour.bump_radius, rel=1e-9)
    assert np.all(radius[~on_bump] >= contour.bump_radius * (1 - 1e-6))


@given(contours(), st.integers(20, 400))
def test_wall_points_are_equally_spaced_along_the_contour(contour, count):
    arc = arc_position(contour, contour.points(count))
    spacing = contour.arc_length / count
    # Round the corner of a bump the arc follows from the height only to the root of rounding.
    assert np.diff(arc) == pytest.approx(spacing, abs=1e-6 * contour.bump_radius)
    assert arc[0] + contour.arc_length - arc[-1] == pytest.approx(
        spacing, abs=1e-6 * contour.bump_radius
    )


@given(contours())
def test_contour_lengths_and_areas_are_those_of_a_fine_polygon(contour):
    x = np.linspace(0, contour.length, 200_001)
    area = np.trapezoid(outline(contour, x), x)
    assert contour.bump_area == pytest.approx(area, rel=1e-3)
    points = contour.points(4000)
    chords = np.hypot(*np.diff(points, axis=0).T).sum()
    missing = math.dist(points[0] + (contour.length, 0), points[-1])
    # Chords cut the corners of the bumps.
    assert chords + missing == pytest.approx(contour.arc_length, rel=1e-2)
    assert chords + missing <= contour.arc_length * (1 + 1e-12)


def test_smooth_walls_are_flat():
    contour = WallContour(0.5, 0.0, 0)
    points = contour.points(10)
    assert not points[:, 1].any()
    assert np.diff(points[:, 0]) == pytest.approx(0.05)
    assert contour.arc_length == 0.5
    assert contour.bump_area == 0
    assert contour.separation == math.inf


@given(st.floats(0.07, 1.2), st.floats(2.2, 12.0))
def test_a_whole_number_of_bumps_comes_nearest_to_the_wanted_distance(roughness, ratio):
    given = (
        scenes.parameters(
            suspension={"area_fraction": 0.0},
            wall={"roughness": roughness, "bump_separation": ratio},
            recording={"bulk_margin": None},
        )
        if _fits(roughness, ratio)
        else None
    )
    if given is None:
        return
    contour = wall_contour(given)
    radius = roughness * given.suspension.mean_radius
    assert contour.bump_radius == pytest.approx(radius)
    assert contour.bumps * contour.separation == pytest.approx(given.channel.length)
    wanted = given.channel.length / (ratio * radius)
    assert abs(contour.bumps - wanted) <= max(0.5 + 1e-9, 1 - wanted)


def _fits(roughness, ratio):
    length, radius = 0.0625, roughness * 0.00846
    return max(1, round(length / (ratio * radius))) * 2 * radius < length


def test_walls_mirror_each_other_about_the_middle():
    contour = WallContour(0.5, 0.02, 5)
    walls = wall_positions(contour, 0.4, 0.01)
    assert walls[LOWER, :, 0].tolist() == walls[UPPER, :, 0].tolist()
    assert walls[UPPER, :, 1] == pytest.approx(0.4 - walls[LOWER, :, 1])
    assert walls.shape[1] == round(contour.arc_length / 0.01)
    assert walls[LOWER, :, 1].min() == 0
    assert walls[LOWER, :, 1].max() == pytest.approx(0.02, rel=0.05)


@given(st.floats(0.15, 0.85), st.floats(0.003, 0.012), st.floats(1.0, 2.0), st.floats(0.05, 0.4))
def test_radii_give_the_exact_area_fraction(fraction, mean_radius, ratio, length):
    cells = max(round(length * 2048), 100)
    given = scenes.parameters(
        channel={"length": cells / 2048},
        suspension={
            "area_fraction": fraction,
            "mean_radius": mean_radius,
            "size_ratio": ratio,
        },
        recording={"bulk_margin": None},
    )
    radii = particle_radii(given)
    area = given.channel.length * given.channel.height
    assert math.pi * np.sum(radii**2) / area == pytest.approx(fraction, rel=1e-13)
    small = np.count_nonzero(radii == radii.min()) if ratio > 1 else (len(radii) + 1) // 2
    assert small == (len(radii) + 1) // 2
    if len(radii) > 1:
        assert radii[-1] / radii[0] == pytest.approx(ratio, rel=1e-13)
    if len(radii) % 2 == 0:
        # The nearest whole number of particles moves the mean by less than one part in 4 N, and
        # an odd one at that count by as much again for the small particle without a large one.
        assert radii.mean() == pytest.approx(mean_radius, rel=0.3 / len(radii) + 1e-12)


def test_the_paper_has_eight_hundred_particles():
    given = scenes.parameters(
        channel={"length": 0.5, "height": 0.44, "outer_gap": 0.56},
        hydrodynamics={"resolution": 8192},
    )
    radii = particle_radii(given)
    assert len(radii) == 800
    assert radii.mean() == pytest.approx(0.00846, rel=1 / 3200)


@pytest.mark.parametrize("roughness", [0.0, 0.59, 1.2])
def test_a_free_area_fraction_leaves_out_the_bumps(roughness):
    given = scenes.parameters(
        wall={"roughness": roughness},
        suspension={"area_fraction": 0.7, "area_reference": "free"},
    )
    contour = wall_contour(given)
    area = given.channel.length * given.channel.height
    bumps = contour.bumps * math.pi * contour.bump_radius**2
    assert reference_area(given) == pytest.approx(area - bumps, rel=1e-13)
    filled = math.pi * np.sum(particle_radii(given) ** 2)
    assert filled / (area - bumps) == pytest.approx(0.7, rel=1e-13)
    whole = scenes.parameters(wall={"roughness": roughness}, suspension={"area_fraction": 0.7})
    assert reference_area(whole) == pytest.approx(area, rel=1e-13)


def test_no_area_means_no_particles():
    assert particle_radii(scenes.empty()).shape == (0,)


@given(st.integers(3, 40), st.floats(-5, 5))
def test_polygon_area_has_the_sign_of_its_sense(count, shift):
    ring = scenes.ellipse((shift, -shift), (0.5, 0.3), count)
    exact = 0.5 * count * math.sin(2 * math.pi / count) * 0.15
    assert polygon_area(*ring.T) == pytest.approx(exact, rel=1e-11)
    assert polygon_area(*ring[::-1].T) == pytest.approx(-exact, rel=1e-11)


def test_layout_knows_whose_node_is_whose():
    layout = Layout(np.array([0, 3, 7]), np.array([0.1, 0.2]), np.zeros((2, 5, 2)), 0.3)
    assert (layout.particles, layout.particle_nodes, layout.wall_nodes, layout.nodes) == (
        2,
        7,
        5,
        17,
    )
    assert layout.wall_rows(LOWER) == slice(7, 12)
    assert layout.wall_rows(UPPER) == slice(12, 17)
    assert layout.body.tolist() == [0] * 3 + [1] * 4 + [2] * 5 + [3] * 5
    assert layout.weights.tolist() == [0.1] * 3 + [0.2] * 4 + [0.3] * 10


def test_chains_close_on_themselves():
    """Every node has the node before it as that one's next, and a chain is a cycle of its body."""
    layout = Layout(np.array([0, 3, 7]), np.array([0.1, 0.2]), np.zeros((2, 5, 2)), 0.3)
    assert layout.chains.tolist() == [0, 3, 7, 12, 17]
    before, after = layout.neighbours
    assert after.tolist() == [1, 2, 0, 4, 5, 6, 3, 8, 9, 10, 11, 7, 13, 14, 15, 16, 12]
    assert before[after].tolist() == list(range(17))
    assert layout.body[after].tolist() == layout.body.tolist()


def test_walls_without_particles_are_chains_too():
    layout = Layout(np.array([0]), np.empty(0), np.zeros((2, 4, 2)), 0.3)
    assert layout.chains.tolist() == [0, 4, 8]
    assert layout.neighbours[1].tolist() == [1, 2, 3, 0, 5, 6, 7, 4]
    assert layout.reference_area.shape == (0,)


def test_reference_areas_are_those_of_circles_with_the_nodes_on_the_circumference():
    radii, counts = np.array([0.3, 1.7]), np.array([9, 31])
    spacing = 2 * math.pi * radii / counts
    layout = Layout(np.append(0, np.cumsum(counts)), spacing, np.zeros((2, 5, 2)), 0.3)
    assert layout.reference_area == pytest.approx(math.pi * radii**2, rel=1e-14)


def test_box_period_is_the_channel_and_the_outer_gap():
    assert Box(0.5, 0.44, 0.56).period == 1.0
