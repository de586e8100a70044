import math
from itertools import pairwise

import numpy as np
import pytest
import scenes
import twins
from hypothesis import given
from hypothesis import strategies as st

from softslip.membrane import (
    add_tension,
    membrane_areas,
    remove_flux,
    rest_spacing,
    wrap_particles,
)

seeds = st.integers(0, 2**31)


def rings(seed, sizes=(7, 16, 3, 30)):
    """Star-shaped anticlockwise membranes at random places, with their rest distances."""
    random = scenes.generator(seed)
    nodes = []
    for size in sizes:
        angle = 2 * np.pi * np.arange(size) / size
        radius = random.uniform(0.6, 1.4, size)
        ring = radius[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        nodes.append(ring + random.uniform(-3, 3, 2))
    offsets = np.append(0, np.cumsum(sizes))
    return np.concatenate(nodes), offsets, random.uniform(0.1, 1.0, len(sizes))


def tension_of(positions, offsets, spacing, elastic_constant=1.7):
    forces = np.zeros_like(positions)
    add_tension(positions, offsets, spacing, elastic_constant, forces)
    return forces


def torque(positions, forces):
    return np.sum(positions[:, 0] * forces[:, 1] - positions[:, 1] * forces[:, 0])


@given(seeds)
def test_force_is_minus_the_gradient_of_the_energy(seed):
    positions, offsets, spacing = rings(seed)
    forces = tension_of(positions, offsets, spacing)
    direction = scenes.generator(seed, 1).standard_normal(positions.shape)
    step = 1e-5
    rise = [
        twins.membrane_energy(positions + sign * step * direction, offsets, spacing, 1.7)
        for sign in (1, -1)
    ]
    slope = (rise[0] - rise[1]) / (2 * step)
    size = np.abs(forces * direction).sum()
    # The central difference errs by (1e-5)² and by rounding over 1e-5.
    assert abs(slope + np.vdot(forces, direction)) <= 1e-8 * size


@given(seeds)
def test_force_is_its_numpy_twin(seed):
    positions, offsets, spacing = rings(seed)
    start, end, pull = twins.links(positions, offsets, spacing, 1.7)
    twin = np.zeros_like(positions)
    np.add.at(twin, start, pull)
    np.add.at(twin, end, -pull)
    forces = tension_of(positions, offsets, spacing)
    assert forces == pytest.approx(twin, abs=1e-13 * np.abs(pull).max())


@given(seeds)
def test_membranes_exert_no_net_force_and_no_torque(seed):
    positions, offsets, spacing = rings(seed)
    forces = tension_of(positions, offsets, spacing)
    for first, end in pairwise(offsets):
        own, size = forces[first:end], np.abs(forces[first:end]).sum()
        assert np.abs(own.sum(axis=0)).max() <= 1e-12 * size
        reach = np.abs(positions[first:end]).max()
        assert abs(torque(positions[first:end], own)) <= 1e-12 * size * reach


def test_a_circle_at_its_rest_length_is_free_of_force():
    ring = scenes.ellipse((3.0, 1.0), (0.5, 0.5), 40)
    chord = 2 * 0.5 * math.sin(math.pi / 40)
    forces = tension_of(ring, np.array([0, 40]), np.array([chord]))
    assert np.abs(forces).max() < 1e-13


def test_a_stretched_circle_pulls_inwards_with_laplace_pressure():
    """Tension T on a circle of radius R: force T/R per length."""
    count, radius, rest = 400, 0.5, 2 * math.pi * 0.4 / 400
    ring = scenes.ellipse((0.0, 0.0), (radius, radius), count)
    forces = tension_of(ring, np.array([0, count]), np.array([rest]), 2.0)
    inwards = -np.sum(forces * ring, axis=1) / radius
    tension = 2.0 * (radius / 0.4 - 1)
    density = inwards / (2 * math.pi * radius / count)
    # The polygon is shorter than the circle by one part in 1e5.
    assert density == pytest.approx(tension / radius, rel=1e-4)


@given(seeds)
def test_removed_flux_leaves_the_area_unchanged(seed):
    positions, offsets, _ = rings(seed)
    velocities = scenes.generator(seed, 2).standard_normal(positions.shape)
    remove_flux(positions, offsets, velocities)
    rate = area_rate(positions, offsets, velocities)
    assert np.abs(rate).max() <= 1e-13 * np.abs(velocities).sum(), np.abs(rate).max()


@given(seeds)
def test_flux_correction_is_one_normal_speed_for_each_membrane(seed):
    """Tangential parts stay; the normal parts all lose the mean of Eq. 20."""
    positions, offsets, _ = rings(seed)
    before = scenes.generator(seed, 4).standard_normal(positions.shape)
    after = before.copy()
    remove_flux(positions, offsets, after)
    for first, end in pairwise(offsets):
        normal = half_normals(positions[first:end])
        width = np.hypot(*normal.T)
        unit = normal / width[:, None]
        mean = np.sum(before[first:end] * normal) / width.sum()
        wanted = before[first:end] - mean * unit
        assert after[first:end] == pytest.approx(wanted, abs=1e-13)


def half_normals(ring):
    across = 0.5 * (np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0))
    return np.column_stack((across[:, 1], -across[:, 0]))


def area_rate(positions, offsets, velocities):
    """d/dt of the polygon areas, whose gradient is the half normal of each node."""
    return np.array(
        [
            np.sum(half_normals(positions[first:end]) * velocities[first:end])
            for first, end in pairwise(offsets)
        ]
    )


def test_normals_point_outwards():
    ring = scenes.ellipse((0.0, 0.0), (1.0, 2.0), 50)
    velocities = ring.copy()
    remove_flux(ring, np.array([0, 50]), velocities)
    assert np.sum(velocities * half_normals(ring)) == pytest.approx(0, abs=1e-13)
    assert np.sum(ring * half_normals(ring)) > 0


def test_areas_of_known_polygons():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]])
    triangle = np.array([[0.0, 0.0], [4.0, 0.0], [1.0, 2.0]])
    nodes, offsets = np.concatenate((square, triangle, square[::-1])), np.array([0, 4, 7, 11])
    assert membrane_areas(nodes, offsets).tolist() == [6.0, 4.0, -6.0]
    count = 33
    ring = scenes.ellipse((0.3, 0.2), (1.0, 1.0), count)
    exact = 0.5 * count * math.sin(2 * math.pi / count)
    assert membrane_areas(ring, np.array([0, count]))[0] == pytest.approx(exact, rel=1e-14)


@given(seeds, st.sampled_from([1e3, -1e6]))
def test_areas_do_not_depend_on_the_place(seed, far):
    """At 1e6 a coordinate keeps 1e-10, and so must the area; the plain shoelace keeps 1e-4."""
    positions, offsets, _ = rings(seed)
    here = membrane_areas(positions, offsets)
    there = membrane_areas(positions + far, offsets)
    assert there == pytest.approx(here, abs=20 * np.spacing(abs(far)))


@given(seeds)
def test_wrapping_moves_whole_membranes_by_whole_periods(seed):
    positions, offsets, _ = rings(seed)
    length = 0.75
    wrapped = positions.copy()
    wrap_particles(wrapped, offsets, length)
    assert np.array_equal(wrapped[:, 1], positions[:, 1])
    for first, end in pairwise(offsets):
        assert 0 <= wrapped[first, 0] < length
        periods = (positions[first:end, 0] - wrapped[first:end, 0]) / length
        assert periods == pytest.approx(np.full(end - first, round(periods[0])), abs=1e-14)
    again = wrapped.copy()
    wrap_particles(again, offsets, length)
    assert np.array_equal(again, wrapped), "wrapping twice moves nodes again"


def test_rest_spacing_is_the_perimeter_of_the_equal_circle_over_the_nodes():
    radius, counts = np.array([0.5, 0.7]), np.array([30, 47])
    offsets = np.append(0, np.cumsum(counts))
    wanted = 2 * np.pi * radius / counts
    assert rest_spacing(np.pi * radius**2, offsets) == pytest.approx(wanted, rel=1e-14)
