import math
from itertools import pairwise

import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon
from shapely.affinity import translate

from softslip.simulation import growth as module
from softslip.simulation.contour import signed_areas
from softslip.simulation.segments import find_candidates

RANGE = 0.05
AROUND = module.Surroundings(
    length=1.0,
    height=0.8,
    bump_radius=0.1,
    bump_separation=0.5,
    contact_range=RANGE,
    contact_pressure=2.0,
)


def chains_of(rings, targets=None, rest=0.9):
    """Chains through given rings of nodes, stretched by 1 / rest."""
    counts = np.array([len(ring) for ring in rings])
    offsets = np.append(0, np.cumsum(counts))
    rows = [np.arange(a, b) for a, b in pairwise(offsets)]
    position = np.concatenate(rings)
    areas = signed_areas(position, offsets)
    lengths = [np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).mean() for ring in rings]
    chains = module.Chains(
        offsets=offsets,
        body=np.repeat(np.arange(len(rings)), counts),
        following=np.concatenate([np.roll(row, -1) for row in rows]),
        preceding=np.concatenate([np.roll(row, 1) for row in rows]),
        rest_length=rest * np.array(lengths),
        start_area=areas,
        target_area=areas if targets is None else np.asarray(targets),
        elastic_constant=3.0,
    )
    return position, chains


def ring(x, y, radius, nodes=20, wobble=0.0, key=1):
    angle = 2 * np.pi * np.arange(nodes) / nodes
    r = radius * (1 + wobble * scenes.generator(key).standard_normal(nodes))
    return np.column_stack((x + r * np.cos(angle), y + r * np.sin(angle)))


def crowd(gap=0.02):
    """Three rings in contact, one pair of them over the period."""
    return chains_of(
        [
            ring(0.15, 0.4, 0.14, 20, 0.005, 1),
            ring(0.43 + gap, 0.4, 0.14, 24, 0.005, 2),
            ring(0.86, 0.4, 0.14 - gap + 0.01, 22, 0.005, 3),
        ]
    )


def contacts_by_hand(position, chains, around):
    """Contact forces and gaps from every node against every segment of every other chain."""
    force, gap = np.zeros_like(position), np.full(len(position), around.contact_range)
    for i, point in enumerate(position):
        ends = [position[chains.following[i]], position[chains.preceding[i]]]
        share = 0.5 * sum(np.hypot(*(end - point)) for end in ends)
        for other in set(chains.body) - {chains.body[i]}:
            nearest = (around.contact_range, 0, 0.0, None)
            for j in np.flatnonzero(chains.body == other):
                u = position[chains.following[j]] - position[j]
                r = point - position[j]
                r[0] -= around.length * np.round(r[0] / around.length)
                t = np.clip(r @ u / (u @ u), 0, 1)
                h = np.hypot(*(r - t * u))
                if h < nearest[0]:
                    nearest = (h, j, t, (r - t * u) / h)
            h, j, t, n = nearest
            if n is None:
                continue
            k = chains.following[j]
            f = 0.5 * share * around.contact_pressure * ((around.contact_range / h) ** 4 - 1) * n
            for row, part in ((i, 1.0), (j, t - 1.0), (k, -t)):
                force[row] += part * f
                gap[row] = min(gap[row], h)
    return force, gap


def candidates_within(reach, position, chains, around):
    return find_candidates(position, chains.body, chains.following, around.length, reach)


def contacts(position, chains, around):
    force, gap = np.zeros_like(position), np.full(len(position), around.contact_range)
    candidates = candidates_within(around.contact_range, position, chains, around)
    module._add_contacts(position, chains, around, candidates, force, gap)
    return force, gap


def test_contact_forces_and_gaps_are_those_of_a_search_over_all_segments():
    position, chains = crowd()
    force, gap = contacts(position, chains, AROUND)
    expected, expected_gap = contacts_by_hand(position, chains, AROUND)
    assert np.count_nonzero(expected.any(axis=1)) > 8, "the scene has hardly any contact"
    np.testing.assert_allclose(force, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(gap, expected_gap, rtol=1e-12)


def test_contact_forces_do_not_depend_on_which_period_a_chain_is_in():
    position, chains = crowd()
    moved = position.copy()
    moved[chains.body == 2, 0] -= AROUND.length
    first, second = (contacts(rows, chains, AROUND)[0] for rows in (position, moved))
    np.testing.assert_allclose(second, first, rtol=1e-9, atol=1e-12)


@given(st.floats(0.005, 0.045))
def test_contacts_and_tension_exert_no_net_force(gap):
    position, chains = crowd(gap)
    force, _ = contacts(position, chains, AROUND)
    module._add_tension(position, chains, force)
    rest = np.abs(force.sum(axis=0)).max() / np.abs(force).sum()
    assert rest < 1e-14, f"a share of {rest:.2g} of all forces remains"


def test_tension_is_that_of_eq_5_times_the_spacing():
    position, chains = chains_of([ring(0.3, 0.4, 0.1, 12, 0.05)])
    force = np.zeros_like(position)
    module._add_tension(position, chains, force)
    ahead = np.roll(position, -1, axis=0) - position
    length = np.hypot(*ahead.T)
    pull = (3.0 * (length / chains.rest_length[0] - 1) / length)[:, None] * ahead
    np.testing.assert_allclose(force, pull - np.roll(pull, 1, axis=0), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize(
    ("point", "gap", "normal"),
    [
        ((0.5, 0.03), 0.03, (0.0, 1.0)),
        ((0.5, 0.77), 0.03, (0.0, -1.0)),
        ((0.25, 0.12), 0.02, (0.0, 1.0)),
        ((0.75 + 0.072, 0.8 - 0.096), 0.02, (0.6, -0.8)),
        ((1.25 - 0.072, 0.096), 0.02, (-0.6, 0.8)),
    ],
    ids=["floor", "ceiling", "top of a bump", "flank of an upper bump", "next period"],
)
def test_walls_push_along_the_way_to_their_nearest_point(point, gap, normal):
    nodes = np.array([point, (point[0] + 0.1, 0.4), (point[0] - 0.1, 0.4)])
    position, chains = chains_of([nodes if point[1] < 0.4 else nodes[[0, 2, 1]]])
    force, gaps = np.zeros_like(position), np.full(3, RANGE)
    module._add_walls(position, chains, AROUND, force, gaps)
    share = 0.5 * (np.hypot(*(position[1] - point)) + np.hypot(*(position[2] - point)))
    expected = share * 2.0 * ((RANGE / gap) ** 4 - 1) * np.array(normal)
    np.testing.assert_allclose(force[0], expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(force[1:], 0.0)
    assert gaps[0] == pytest.approx(gap, rel=1e-12)


def grow(position, chains, around, steps, skin=0.1):
    velocity = np.zeros_like(position)
    step, gap = 0, math.inf
    while step < steps:
        before = position.copy()
        candidates = candidates_within(around.contact_range + skin, position, chains, around)
        step, gap = module.grow(
            position, velocity, chains, around, candidates, skin, (step, 100, steps)
        )
        moved = np.hypot(*(position - before).T).max()
        assert moved <= 0.5 * skin, f"nodes moved {moved:.2g} on one candidate list"
        if not gap > module.CLOSEST_GAP * around.contact_range:
            break
    return gap


def test_areas_follow_their_course():
    position, chains = chains_of([ring(0.15, 0.4, 0.1), ring(0.4, 0.4, 0.1)], targets=[0.05, 0.02])
    grow(position, chains, AROUND, 300)
    np.testing.assert_allclose(signed_areas(position, chains.offsets), [0.05, 0.02], rtol=1e-6)


def test_a_lone_stretched_chain_relaxes_to_a_circle():
    nodes = ring(0.5, 0.4, 0.1, 40, 0.05)
    position, chains = chains_of([nodes])
    grow(position, chains, AROUND, 3000)
    radius = np.hypot(*(position - position.mean(axis=0)).T)
    spread = np.ptp(radius) / radius.mean()
    assert spread < 1e-4, f"the radius varies by {spread:.2g}"


def test_growth_without_room_stops_at_a_small_gap_before_chains_cross():
    position, chains = chains_of(
        [ring(0.25, 0.4, 0.2, 40), ring(0.75, 0.4, 0.2, 40)], targets=[0.5, 0.5]
    )
    gap = grow(position, chains, AROUND, 3000)
    assert 0 < gap < module.CLOSEST_GAP * RANGE
    left, right = Polygon(position[:40]), Polygon(position[40:])
    assert left.is_simple
    assert not left.intersects(right), "the chains crossed"
    assert not translate(left, 1.0).intersects(right), "the chains crossed over the period"
