import dataclasses

import numpy as np
import pytest
import scenes
import shapely

from softslip.errors import NumericalError
from softslip.solver import crossing

LENGTH = 0.0625
"""Period of the scenes."""


def laid_out(rings, **groups):
    given = scenes.parameters(**groups)
    layout = scenes.layout_of_rings(rings, given)
    walls = layout.wall_reference.reshape(-1, 2)
    return np.concatenate([*rings, walls]), layout


def rings(distance, tilt=0.0):
    """Two equal ellipses side by side, as far apart as asked for where they are closest."""
    half = 0.008
    return [
        scenes.ellipse((0.02, 0.05), (half, 0.006), 60),
        scenes.ellipse((0.02 + 2 * half + distance, 0.05), (half, 0.006), 60, tilt),
    ]


@pytest.mark.parametrize("shift", [0.0, 0.03, LENGTH - 0.028, 5 * LENGTH])
@pytest.mark.parametrize("overlap", [1e-3, 1e-5, 1e-7])
def test_membranes_that_overlap_are_found_wherever_they_are(overlap, shift):
    """Also across the end of the period, where one of them is an image."""
    pair = rings(-overlap)
    pair[0][:, 0] += shift
    pair[1][:, 0] += shift - LENGTH
    positions, layout = laid_out(pair)
    node = crossing.first_crossing(positions, layout, LENGTH)
    assert node >= 0
    # The node found is near the place where they overlap.
    place = 0.028 + shift
    apart = np.mod(positions[node, 0] - place + 0.5 * LENGTH, LENGTH) - 0.5 * LENGTH
    assert abs(apart) < 3e-3


@pytest.mark.parametrize("gap", [1e-7, 1e-4, 1e-3])
def test_membranes_that_do_not_overlap_are_left_alone(gap):
    positions, layout = laid_out(rings(gap))
    assert crossing.first_crossing(positions, layout, LENGTH) == -1


@pytest.mark.parametrize("seed", range(20))
def test_crossings_are_those_of_exact_geometry(seed):
    """Ellipses near each other, every other of which cross."""
    generator = scenes.generator(71, seed)
    pair = rings(2e-4 * generator.standard_normal(), tilt=0.3 * generator.standard_normal())
    positions, layout = laid_out(pair)
    first, second = (shapely.Polygon(ring).exterior for ring in pair)
    found = crossing.first_crossing(positions, layout, LENGTH) >= 0
    assert found == first.intersects(second)


def test_a_membrane_that_crosses_itself_is_found():
    ring = scenes.ellipse((0.03, 0.05), (0.008, 0.006), 60)
    positions, layout = laid_out([ring])
    assert crossing.first_crossing(positions, layout, LENGTH) == -1
    ring[[10, 11]] = ring[[11, 10]]
    positions, layout = laid_out([ring])
    assert not shapely.Polygon(ring).is_valid
    assert crossing.first_crossing(positions, layout, LENGTH) in range(8, 13)


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("moved", [0.0, 0.4])
def test_a_membrane_in_a_bump_is_found(moved, upper):
    """Where the wall is now, not where it began."""
    rough = {"wall": {"roughness": 0.59}}
    given = scenes.parameters(**rough)
    height = given.channel.height
    layout = scenes.layout_of_rings([], given)
    tip = layout.wall_reference[0][np.argmax(layout.wall_reference[0, :, 1])]
    centre = np.array([tip[0] + moved * LENGTH, tip[1] + 0.006 - 2e-4])
    ring = scenes.ellipse(centre, (0.008, 0.006), 60)
    if upper:
        ring[:, 1] = height - ring[:, 1]
        ring = ring[::-1]
    positions, layout = laid_out([ring], **rough)
    walls = positions[layout.particle_nodes :].reshape(2, -1, 2)
    assert (crossing.first_crossing(positions, layout, LENGTH) >= 0) == (moved == 0.0)
    walls[int(upper), :, 0] += moved * LENGTH
    assert crossing.first_crossing(positions, layout, LENGTH) >= 0


def test_the_longest_link_is_that_of_any_membrane_or_wall():
    pair = rings(1e-3)
    positions, layout = laid_out(pair)
    links = [np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).max() for ring in pair]
    for wall_spacing in (0.5 * max(links), 2.0 * max(links)):
        spaced = dataclasses.replace(layout, wall_spacing=wall_spacing)
        longest = max(*links, wall_spacing)
        assert crossing.longest_link(positions, spaced) == pytest.approx(longest, rel=1e-12)


def test_an_empty_channel_has_no_crossing():
    positions, layout = laid_out([], wall={"roughness": 0.59})
    assert crossing.first_crossing(positions, layout, LENGTH) == -1


@pytest.mark.parametrize("step", [crossing.CROSSING_STEPS, crossing.CROSSING_STEPS + 1])
def test_thin_films_are_looked_at_in_every_step_and_others_now_and_then(step):
    pair = rings(1e-3)
    pair[0][[30, 31]] = pair[0][[31, 30]]
    positions, layout = laid_out(pair)
    link = crossing.longest_link(positions, layout)
    thin, thick = (0.99 * crossing.REACH * link, 1.01 * crossing.REACH * link)
    with pytest.raises(NumericalError, match=rf"node_position\[\d+\] at step {step}: .*crosses"):
        crossing.check_crossing(positions, layout, LENGTH, thin, step)
    if step % crossing.CROSSING_STEPS:
        crossing.check_crossing(positions, layout, LENGTH, thick, step)
    else:
        with pytest.raises(NumericalError, match="node_spacing"):
            crossing.check_crossing(positions, layout, LENGTH, thick, step)


def test_no_bodies_cross_without_a_thin_film():
    """What lets thick films be: nodes of two links that cross are closer than the reach."""
    generator = scenes.generator(72)
    ends = generator.random((20_000, 4, 2))
    one, two = (shapely.linestrings(ends[:, pair]) for pair in ([0, 1], [2, 3]))
    cross = shapely.intersects(one, two)
    assert cross.sum() > 1000
    apart = np.linalg.norm(ends[:, [0, 0, 1, 1]] - ends[:, [2, 3, 2, 3]], axis=-1).min(axis=1)
    longest = np.maximum(shapely.length(one), shapely.length(two))
    assert (apart / longest)[cross].max() <= crossing.REACH
