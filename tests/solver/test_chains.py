import math
from itertools import pairwise

import numpy as np
import pytest
import scenes
import twins
from hypothesis import given
from hypothesis import strategies as st

from softslip.solver.chains import Subdivision, carry_back, lagrange_weights, refine
from softslip.solver.films import contact_strength
from softslip.solver.neighbours import find_pairs
from softslip.solver.steric import ContactForces

LENGTH = 2.5
SIZES = (7, 16, 3, 30, 12, 9)
JUMPS = np.array([0.0, 0.0, 0.0, 0.0, LENGTH, -LENGTH])

seeds = st.integers(0, 2**31)
factors = st.integers(1, 4)


def chains(seed):
    """Four rings and, across the period, a wall that runs right and one that runs left."""
    random = scenes.generator(seed)
    parts = []
    for size, jump in zip(SIZES, JUMPS, strict=True):
        angle = 2 * np.pi * (np.arange(size) + random.uniform(-0.3, 0.3, size)) / size
        if jump:
            part = np.column_stack((jump * angle / (2 * np.pi), random.uniform(0, 0.2, size)))
        else:
            radius = random.uniform(0.6, 1.4, size)
            part = radius[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        parts.append(part + random.uniform(-3, 3, 2))
    return np.concatenate(parts), np.append(0, np.cumsum(SIZES))


def refined(positions, offsets, factor, jumps=JUMPS):
    points = np.full((factor * len(positions), 2), np.nan)
    every, weights = np.ones(len(jumps), bool), lagrange_weights(factor)
    refine(positions, offsets, jumps, every, weights, factor * offsets, *points.T)
    return points


def carried(point_forces, offsets, factor):
    forces = np.zeros((offsets[-1], 2))
    carry_onto(forces, point_forces, offsets, factor)
    return forces


def carry_onto(forces, point_forces, offsets, factor):
    every, weights = np.ones(len(offsets) - 1, bool), lagrange_weights(factor)
    carry_back(*point_forces.T, factor * offsets, offsets, every, weights, forces)


def sparse_forces(seed, count):
    """Forces on points of which, as in a suspension, most touch nothing."""
    random = scenes.generator(seed, 1)
    return random.standard_normal((count, 2)) * (random.random((count, 1)) < 0.2)


@pytest.mark.parametrize("factor", [1, 2, 3, 7])
def test_weights_reproduce_quintics(factor):
    """Six weights that are exact for 1, u, ... u^5 about the node are the Lagrange weights."""
    nodes, place = np.arange(-2.0, 4.0), np.arange(factor) / factor
    weights = lagrange_weights(factor)
    for power in range(6):
        # Values reach 3^5, with weights up to 1: rounding is 1e-14 of that.
        assert weights @ nodes**power == pytest.approx(place**power, abs=3e-13)


def test_no_points_at_all_is_refused():
    with pytest.raises(ValueError, match="at least one point"):
        lagrange_weights(0)


@given(seeds, factors)
def test_every_node_is_a_point_to_the_last_bit(seed, factor):
    positions, offsets = chains(seed)
    assert np.array_equal(refined(positions, offsets, factor)[::factor], positions)


@given(seeds, factors)
def test_points_are_their_numpy_twin(seed, factor):
    positions, offsets = chains(seed)
    twin = [
        twins.refined_chain(positions[first:end], jump, factor)
        for (first, end), jump in zip(pairwise(offsets), JUMPS, strict=True)
    ]
    points = refined(positions, offsets, factor)
    # The twin solves Vandermonde systems of condition 1e3.
    assert points == pytest.approx(np.concatenate(twin), abs=1e-12)


@given(seeds, factors)
def test_points_follow_a_displacement_of_the_chains(seed, factor):
    positions, offsets = chains(seed)
    shift = np.array([0.3, -0.2])
    moved = refined(positions + shift, offsets, factor)
    assert moved == pytest.approx(refined(positions, offsets, factor) + shift, abs=1e-14)


@pytest.mark.parametrize("jump", [LENGTH, -LENGTH])
@pytest.mark.parametrize("factor", [1, 2, 3])
def test_a_flat_wall_has_even_points_across_the_period(factor, jump):
    count = 20
    wall = np.column_stack((0.1 + jump * np.arange(count) / count, np.full(count, 0.4)))
    points = refined(wall, np.array([0, count]), factor, np.array([jump]))
    even = 0.1 + jump * np.arange(factor * count) / (factor * count)
    assert points[:, 0] == pytest.approx(even, abs=1e-14)
    assert points[:, 1] == pytest.approx(np.full(factor * count, 0.4), abs=1e-15)


def ring(angle):
    return np.column_stack((np.cos(angle), 0.6 * np.sin(angle)))


def wavy_wall(angle):
    return np.column_stack(
        (LENGTH * angle / (2 * np.pi) + 0.1 * np.sin(angle), 0.2 * np.cos(angle))
    )


@pytest.mark.parametrize(("curve", "jump"), [(ring, 0.0), (wavy_wall, LENGTH)])
@pytest.mark.parametrize("factor", [2, 3])
def test_points_converge_to_the_curve_at_sixth_order(curve, jump, factor):
    def error(count):
        nodes = curve(2 * np.pi * np.arange(count) / count)
        points = refined(nodes, np.array([0, count]), factor, np.array([jump]))
        exact = curve(2 * np.pi * np.arange(factor * count) / (factor * count))
        return np.abs(points - exact).max()

    found = math.log2(error(30) / error(60))
    # Between the nodes the next term is down by Δs² = 0.04.
    assert found == pytest.approx(6, abs=0.1), f"order {found:.2f}"


@given(seeds, factors)
def test_forces_go_back_by_the_transpose(seed, factor):
    """For all nodes X and forces f: f · refine(X) = carry_back(f) · X, about any place."""
    positions, offsets = chains(seed)
    direction = scenes.generator(seed, 2).standard_normal(positions.shape)
    moved = refined(direction, offsets, factor, np.zeros(len(SIZES)))
    point_forces = sparse_forces(seed, len(moved))
    forces = carried(point_forces, offsets, factor)
    size = np.abs(point_forces).sum() * np.abs(direction).max()
    assert abs(np.vdot(point_forces, moved) - np.vdot(forces, direction)) <= 1e-14 * size


@given(seeds, factors)
def test_each_chain_keeps_its_total_force_and_torque(seed, factor):
    positions, offsets = chains(seed)
    points = refined(positions, offsets, factor)
    point_forces = sparse_forces(seed, len(points))
    forces = carried(point_forces, offsets, factor)
    for (first, end), jump in zip(pairwise(offsets), JUMPS, strict=True):
        nodes, own = slice(first, end), slice(factor * first, factor * end)
        size = np.abs(point_forces[own]).sum()
        lost = forces[nodes].sum(axis=0) - point_forces[own].sum(axis=0)
        assert np.abs(lost).max() <= 1e-14 * size
        # Across the period a wall has no torque of its own.
        if not jump:
            gained = torque(positions[nodes], forces[nodes]) - torque(
                points[own], point_forces[own]
            )
            assert abs(gained) <= 1e-13 * size


def torque(positions, forces):
    return np.sum(positions[:, 0] * forces[:, 1] - positions[:, 1] * forces[:, 0])


@given(seeds, factors)
def test_carried_forces_are_added_to_what_is_there(seed, factor):
    _, offsets = chains(seed)
    point_forces = sparse_forces(seed, factor * offsets[-1])
    forces = np.full((offsets[-1], 2), 3.0)
    carry_onto(forces, point_forces, offsets, factor)
    # Rounding at 3, once for each point whose force arrives at a node.
    assert forces - 3.0 == pytest.approx(carried(point_forces, offsets, factor), abs=3e-14)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_force_that_is_not_a_number_reaches_the_nodes(axis):
    point_forces = np.zeros((2 * sum(SIZES), 2))
    point_forces[21, axis] = np.nan
    forces = carried(point_forces, np.append(0, np.cumsum(SIZES)), 2)
    # Point 21 lies half-way between the nodes 10 and 11 of the second chain.
    assert np.flatnonzero(np.isnan(forces[:, axis])).tolist() == [8, 9, 10, 11, 12, 13]


@pytest.mark.parametrize("factor", [1, 2, 3])
def test_contacts_of_the_points_push_the_nodes_down_the_energy(factor):
    """Two rings and two walls in contact, one ring across the period: F = -∂E/∂X of the nodes."""
    contact_range, energy = 0.2, 1e-9
    rings = [scenes.ellipse((x, 0.6), (0.6, 0.5), 60) for x in (0.6, LENGTH - 0.65)]
    low, high = np.zeros((2, 120, 2))
    low[:, 0] = high[:, 0] = LENGTH * np.arange(120) / 120
    low[:, 1], high[:, 1] = -0.03, 1.24
    positions = np.concatenate((*rings, low, high))
    offsets, jumps = np.array([0, 60, 120, 240, 360]), np.array([0.0, 0.0, LENGTH, LENGTH])
    # A little noise, so that no force vanishes by symmetry.
    positions += scenes.generator(factor).uniform(-0.005, 0.005, positions.shape)
    body = np.repeat([0, 1, 2, 3], factor * np.diff(offsets))
    weights = np.full(len(body), 0.05 / factor)

    def energy_of(nodes):
        points = refined(nodes, offsets, factor, jumps)
        pairs = twins.close_pairs(points, body, 2, LENGTH, contact_range)
        return twins.contact_energy(points, weights, pairs, LENGTH, contact_range, energy, "energy")

    points = refined(positions, offsets, factor, jumps)
    listed = find_pairs(points, body, 2, LENGTH, contact_range)
    point_forces = np.zeros_like(points)
    strength = contact_strength(energy, "energy")
    contacts = ContactForces(factor * offsets, weights, LENGTH, contact_range, strength)
    contacts.add(points, listed, point_forces)
    touching = np.bincount(body[point_forces.any(axis=1)], minlength=4)
    assert (touching > 0).all(), "every body takes part"
    forces = carried(point_forces, offsets, factor)
    direction = scenes.generator(factor, 1).standard_normal(positions.shape)
    step = 1e-6 * contact_range
    slope = (energy_of(positions + step * direction) - energy_of(positions - step * direction)) / (
        2 * step
    )
    error = abs(slope + np.vdot(forces, direction)) / np.abs(forces * direction).sum()
    # As for the nodes themselves: rounding over the step, and the cut-off's kink.
    assert error <= 1e-7, f"off by {error:.1e}"


def ring_forces(nodes):
    """(L_x, layout, places, forces) of a circle between flat walls under a smooth force."""
    given = scenes.empty()
    length, height = given.channel.length, given.channel.height
    ring = scenes.ellipse((0.5 * length, 0.5 * height), (0.3 * height,) * 2, nodes)
    layout = scenes.layout_of_rings([ring], given)
    places = np.concatenate((ring, layout.wall_reference.reshape(-1, 2)))
    angle = 2 * np.pi * np.arange(nodes) / nodes
    forces = np.zeros_like(places)
    forces[:nodes] = np.column_stack((np.sin(angle) + 0.4, np.cos(3 * angle))) / nodes
    forces[nodes:] = 0.7
    return length, layout, places, forces


@given(st.integers(7, 60), factors)
def test_shares_keep_the_force_on_every_body(nodes, factor):
    length, layout, _, forces = ring_forces(nodes)
    shares = Subdivision(layout, length, factor).shares(forces)
    for start, end in pairwise(layout.chains):
        total = shares[factor * start : factor * end].sum(axis=0)
        assert total == pytest.approx(forces[start:end].sum(axis=0), rel=1e-12, abs=1e-13)


@pytest.mark.parametrize("factor", [2, 3, 6])
def test_points_between_nodes_stand_for_a_smooth_membrane(factor):
    """They are those of a circle of as many nodes, but for the sixth-order interpolation."""
    length, layout, places, forces = ring_forces(60)
    between = Subdivision(layout, length, factor)
    _, _, closer, shares = ring_forces(60 * factor)
    count = 60 * factor
    assert between.points(places)[:count] == pytest.approx(closer[:count], abs=1e-6)
    assert between.shares(forces)[:count] == pytest.approx(shares[:count], abs=1e-6)
    flat = between.points(places)[count:, 1]
    assert flat == pytest.approx(np.repeat(places[60:, 1], factor), abs=1e-15)


def test_one_point_a_node_is_the_node_itself():
    length, layout, places, forces = ring_forces(20)
    nodes = Subdivision(layout, length, 1)
    assert np.array_equal(nodes.points(places), places)
    assert np.array_equal(nodes.shares(forces), forces)
