import math

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.errors import ExpansionError
from softslip.simulation import contour as module
from softslip.simulation.sample import wall_contour
from softslip.solver.geometry import WallContour

LENGTH, HEIGHT = 0.0625, 0.109375
MIDDLE = 0.5 * HEIGHT


def circle(x, y, radius, nodes=64):
    angle = 2 * np.pi * np.arange(nodes) / nodes
    return np.column_stack((x + radius * np.cos(angle), y + radius * np.sin(angle)))


def ellipse(a, b, tilt, nodes):
    points = circle(0, 0, 1, nodes) * (a, b)
    c, s = math.cos(tilt), math.sin(tilt)
    return points @ np.array([[c, s], [-s, c]])


def check(*membranes, roughness=0.0, targets=None, fraction=None):
    """Run check_contours with targets and area fraction that fit, unless they are given."""
    offsets = np.append(0, np.cumsum([len(nodes) for nodes in membranes]))
    position = np.concatenate(membranes)
    if targets is None:
        targets = np.abs(module.signed_areas(position, offsets))
    if fraction is None:
        fraction = float(np.sum(targets) / (LENGTH * HEIGHT))
    parameters = scenes.parameters(
        suspension={"area_fraction": fraction}, wall={"roughness": roughness}
    )
    return module.check_contours(position, offsets, targets, parameters)


def test_check_measures_the_smallest_distance_between_membranes():
    report = check(circle(0.02, MIDDLE, 0.009, 720), circle(0.04, MIDDLE, 0.009, 720))
    assert report.smallest_distance == pytest.approx(0.002, rel=1e-4)
    assert report.largest_area_error == 0


def test_check_measures_the_smallest_distance_across_the_period():
    report = check(circle(0.01, MIDDLE, 0.009, 720), circle(LENGTH - 0.0101, MIDDLE, 0.01, 720))
    assert report.smallest_distance == pytest.approx(0.0011, rel=1e-4)


@pytest.mark.parametrize("y", [0.0105, HEIGHT - 0.0105])
def test_check_measures_the_smallest_distance_from_a_wall(y):
    report = check(circle(0.03, y, 0.01))
    assert report.smallest_distance == pytest.approx(0.0005, rel=1e-9)


def test_check_measures_the_smallest_distance_from_a_bump():
    bump = 0.59 * 0.00846
    rough = wall_contour(scenes.parameters(wall={"roughness": 0.59}))
    membrane = circle(0.5 * rough.separation, bump + 0.0007 + 0.009, 0.009)
    assert check(membrane, roughness=0.59).smallest_distance == pytest.approx(0.0007, rel=1e-9)


@pytest.mark.parametrize(
    "shift",
    [0.0, LENGTH, -LENGTH],
    ids=["side by side", "across the period", "across it the other way"],
)
def test_check_sees_crossed_membranes(shift):
    with pytest.raises(ExpansionError, match="particles 1 and 2 cross"):
        check(
            circle(0.03, 0.09, 0.009),
            circle(0.03, 0.03, 0.009),
            circle(0.046 + shift, 0.03, 0.009),
        )


def test_check_sees_membranes_that_cross_between_their_nodes():
    spike = np.array([[0.01, 0.03], [0.05, 0.03], [0.05, 0.06]])
    needle = np.array([[0.03, 0.01], [0.0301, 0.01], [0.03005, 0.08]])
    with pytest.raises(ExpansionError, match="particles 0 and 1 cross"):
        check(spike, needle)


@pytest.mark.parametrize("inner", [0, 1])
def test_check_sees_a_swallowed_particle(inner):
    membranes = [circle(0.03, MIDDLE, 0.01)]
    membranes.insert(inner, circle(0.031, MIDDLE, 0.003))
    with pytest.raises(ExpansionError, match="particles 0 and 1 cross or overlap"):
        check(*membranes)


def test_check_sees_a_membrane_that_meets_its_own_image():
    wide = circle(0, 0, 1) * (0.51 * LENGTH, 0.01) + (0.03, MIDDLE)
    with pytest.raises(ExpansionError, match="particles 0 and 0 cross"):
        check(wide)


@pytest.mark.parametrize("y", [0.0099, HEIGHT - 0.0099, -0.02])
def test_check_sees_a_membrane_beyond_a_wall(y):
    with pytest.raises(ExpansionError, match=r"particle 1 reaches .* into a wall"):
        check(circle(0.03, MIDDLE, 0.01), circle(0.03, y, 0.01))


@pytest.mark.parametrize("mirror", [False, True])
def test_check_sees_a_bump_that_pokes_between_two_nodes(mirror):
    rough = wall_contour(scenes.parameters(wall={"roughness": 0.59}))
    x, b = 0.5 * rough.separation, rough.bump_radius
    triangle = np.array([[x - 2 * b, 0.9 * b], [x + 2 * b, 0.9 * b], [x, 4 * b]])
    if mirror:
        triangle = np.column_stack((triangle[:, 0], HEIGHT - triangle[:, 1]))[::-1]
    assert module.wall_clearance(triangle, rough, HEIGHT).min() > 0
    with pytest.raises(ExpansionError, match=r"particle 0 reaches .* into a wall"):
        check(triangle, roughness=0.59)


def test_check_sees_a_membrane_that_crosses_itself():
    eight = circle(0.03, MIDDLE, 0.01)
    eight[20:40] = eight[20:40][::-1]
    with pytest.raises(ExpansionError, match="particle 1 crosses itself"):
        check(circle(0.03, 0.02, 0.01), eight)


def test_check_sees_a_wrong_area():
    nodes = circle(0.03, MIDDLE, 0.01)
    area = module.signed_areas(nodes, np.array([0, 64]))
    assert check(nodes, targets=area * 1.0009).largest_area_error == pytest.approx(9e-4, rel=0.01)
    with pytest.raises(ExpansionError, match="particle 0 has area"):
        check(nodes, targets=area * 1.0011)


def test_check_sees_a_clockwise_membrane():
    with pytest.raises(ExpansionError, match="particle 1 has area -"):
        check(circle(0.03, 0.02, 0.01), circle(0.03, MIDDLE, 0.01)[::-1])


def test_check_sees_a_wrong_area_fraction():
    with pytest.raises(ExpansionError, match=r"area fraction is .* instead of 0.05"):
        check(circle(0.03, MIDDLE, 0.01), fraction=0.05)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_check_sees_a_node_that_is_no_number(bad):
    nodes = circle(0.03, MIDDLE, 0.01)
    nodes[3, 1] = bad
    with pytest.raises(ExpansionError, match="particle 1 has a node at"):
        check(circle(0.03, 0.02, 0.01), nodes, targets=np.full(2, 3e-4), fraction=0.05)


@given(st.floats(0, 0.2), st.floats(-0.3, 0.6), st.integers(0, 4))
def test_clearance_outside_a_wall_is_the_distance_from_its_contour(y, x, bumps):
    length, height = 0.3, 0.2
    wall = WallContour(length, 0.02 if bumps else 0.0, bumps)
    clearance = module.wall_clearance(np.array([[x, y]]), wall, height)[0]
    lower = wall.points(6000)
    contour = np.concatenate((lower, np.column_stack((lower[:, 0], height - lower[:, 1]))))
    delta = contour - (x, y)
    delta[:, 0] -= length * np.round(delta[:, 0] / length)
    expected = np.hypot(*delta.T).min()
    if clearance > 0:
        assert clearance == pytest.approx(expected, abs=1e-4)
    else:
        assert min(y, height - y) <= wall.bump_radius


@given(
    st.floats(0.3, 1.0),
    st.floats(0, math.pi),
    st.integers(40, 200),
    st.integers(16, 400),
)
def test_resampled_nodes_lie_on_the_contour_at_equal_spacing(b, tilt, before, after):
    nodes = module.resample(ellipse(1.0, b, tilt, before), after)
    assert nodes.shape == (after, 2)
    c, s = math.cos(tilt), math.sin(tilt)
    along, across = nodes[:, 0] * c + nodes[:, 1] * s, nodes[:, 1] * c - nodes[:, 0] * s
    off = np.abs(along**2 + (across / b) ** 2 - 1).max()
    assert off < 3e-3, f"a node is {off:.2g} off the ellipse"
    fine = module.resample(ellipse(1.0, b, tilt, 4000), 20 * after)
    arc = np.hypot(*np.diff(fine, axis=0, append=fine[:1]).T).sum()
    chord = np.hypot(*np.diff(nodes, axis=0, append=nodes[:1]).T)
    uneven = (chord.max() - arc / after) / (arc / after)
    assert uneven < 5e-3, f"a spacing is {uneven:.2g} too long"


@given(st.floats(0.4, 1.0), st.integers(16, 300), st.floats(0.97, 1.03))
def test_shift_along_normals_sets_the_area_exactly(b, count, factor):
    nodes = ellipse(1.0, b, 0.3, count)
    offsets = np.array([0, count])
    wanted = factor * module.signed_areas(nodes, offsets)[0]
    moved = module.with_area(nodes, wanted)
    error = abs(module.signed_areas(moved, offsets)[0] / wanted - 1)
    assert error < 1e-13, f"the area is off by {error:.2g}"
    assert np.abs(moved - nodes).max() < 0.05


def test_centroid_of_an_off_centre_triangle():
    triangle = np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 7.0]])
    np.testing.assert_allclose(module.centroid(triangle), [2.0, 3.0], rtol=1e-14)


def test_area_keeps_its_digits_far_from_the_origin():
    nodes = ellipse(0.01, 0.008, 0.2, 100)
    offsets = np.array([0, 100])
    near = module.signed_areas(nodes, offsets)
    far = module.signed_areas(nodes + 1000.0, offsets)
    assert far == pytest.approx(near, rel=1e-10)
