import math
from itertools import pairwise

import numpy as np
import pytest
import scenes
import twins
from hypothesis import given
from hypothesis import strategies as st

from softslip.solver.membrane import (
    ORDERS,
    add_tension,
    area_gradients,
    membrane_areas,
    remove_flux,
    rest_spacing,
    wrap_particles,
)

seeds = st.integers(0, 2**31)
orders = st.sampled_from(ORDERS)
each_order = pytest.mark.parametrize("order", ORDERS)


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


def one(ring):
    return np.array([0, len(ring)])


def tension_of(positions, offsets, spacing, order, elastic_constant=1.7):
    forces = np.zeros_like(positions)
    add_tension(positions, offsets, spacing, elastic_constant, order, forces)
    return forces


def without_flux(positions, offsets, order, velocities, restoring=0.0, reference_area=None):
    after = velocities.copy()
    if reference_area is None:
        reference_area = np.zeros(len(offsets) - 1)
    remove_flux(positions, offsets, order, restoring, reference_area, after)
    return after


def torque(positions, forces):
    return np.sum(positions[:, 0] * forces[:, 1] - positions[:, 1] * forces[:, 0])


@given(seeds, orders)
def test_force_is_minus_the_gradient_of_the_energy(seed, order):
    positions, offsets, spacing = rings(seed)
    forces = tension_of(positions, offsets, spacing, order)
    direction = scenes.generator(seed, 1).standard_normal(positions.shape)
    step = 1e-5
    rise = [
        twins.membrane_energy(positions + sign * step * direction, offsets, spacing, 1.7, order)
        for sign in (1, -1)
    ]
    slope = (rise[0] - rise[1]) / (2 * step)
    size = np.abs(forces * direction).sum()
    # The central difference errs by (1e-5)² over the squared length of the shortest difference,
    # about 0.1, and by rounding over 1e-5.
    assert abs(slope + np.vdot(forces, direction)) <= 1e-7 * size


@given(seeds, orders)
def test_force_is_its_numpy_twin(seed, order):
    positions, offsets, spacing = rings(seed)
    twin = twins.membrane_forces(positions, offsets, spacing, 1.7, order)
    forces = tension_of(positions, offsets, spacing, order)
    # A ring whose pulls cancel would make the forces a poor measure of rounding.
    size = 1.7 * sum(np.abs(positions).max() / spacing)
    assert forces == pytest.approx(twin, abs=1e-13 * size)


@given(seeds)
def test_second_order_is_the_links_of_the_paper(seed):
    positions, offsets, spacing = rings(seed)
    start, end, pull = twins.links(positions, offsets, spacing, 1.7)
    twin = np.zeros_like(positions)
    np.add.at(twin, start, pull)
    np.add.at(twin, end, -pull)
    forces = tension_of(positions, offsets, spacing, 2)
    assert forces == pytest.approx(twin, abs=1e-13 * np.abs(pull).max())


@given(seeds, orders)
def test_forces_are_added_to_what_is_there(seed, order):
    positions, offsets, spacing = rings(seed)
    forces = np.full_like(positions, 3.0)
    add_tension(positions, offsets, spacing, 1.7, order, forces)
    alone = tension_of(positions, offsets, spacing, order)
    assert forces - 3.0 == pytest.approx(alone, abs=1e-14 * np.abs(alone).max() + 1e-15)


@given(seeds, orders)
def test_membranes_exert_no_net_force_and_no_torque(seed, order):
    positions, offsets, spacing = rings(seed)
    forces = tension_of(positions, offsets, spacing, order)
    for first, end in pairwise(offsets):
        own, size = forces[first:end], np.abs(forces[first:end]).sum()
        assert np.abs(own.sum(axis=0)).max() <= 1e-12 * size
        reach = np.abs(positions[first:end]).max()
        assert abs(torque(positions[first:end], own)) <= 1e-12 * size * reach


@each_order
def test_a_circle_at_its_rest_length_is_free_of_force(order):
    ring = scenes.ellipse((3.0, 1.0), (0.5, 0.5), 40)
    length = np.hypot(*twins.staggered_difference(ring, order).T)
    assert np.ptp(length) < 1e-14
    forces = tension_of(ring, one(ring), length[:1], order)
    assert np.abs(forces).max() < 1e-13


@each_order
def test_a_stretched_circle_pulls_inwards_with_laplace_pressure(order):
    """Tension T on a circle of radius R: force T/R per length."""
    count, radius, rest = 400, 0.5, 2 * math.pi * 0.4 / 400
    ring = scenes.ellipse((0.0, 0.0), (radius, radius), count)
    forces = tension_of(ring, one(ring), np.array([rest]), order, 2.0)
    inwards = -np.sum(forces * ring, axis=1) / radius
    tension = 2.0 * (radius / 0.4 - 1)
    density = inwards / (2 * math.pi * radius / count)
    # The polygon is shorter than the circle by one part in 1e5, and T is a fifth of T + K_e; at
    # order 6 what is left is rounding over (Δs/R)².
    assert density == pytest.approx(tension / radius, rel=1e-4 if order == 2 else 1e-10)


def stretched_curve(count):
    """Closed curve X(s), s in [0, 2π), of uneven stretch: X, X' and X'' at the nodes."""
    s = 2 * np.pi * np.arange(count) / count
    shape, slope, bend = (
        np.column_stack((np.cos(s) + 0.1 * np.cos(2 * s), 0.7 * np.sin(s))),
        np.column_stack((-np.sin(s) - 0.2 * np.sin(2 * s), 0.7 * np.cos(s))),
        np.column_stack((-np.cos(s) - 0.4 * np.cos(2 * s), -0.7 * np.sin(s))),
    )
    return shape, slope, bend


def observed_order(error, counts):
    """Order of convergence from the errors at two numbers of nodes."""
    return math.log(error(counts[0]) / error(counts[1])) / math.log(counts[1] / counts[0])


@each_order
def test_force_converges_to_that_of_the_continuous_membrane(order):
    """∂(T τ)/∂s = K_e [(1 - 1/g) X'' + (g'/g²) X'] with the stretch g = |X'|."""

    def error(count):
        shape, slope, bend = stretched_curve(count)
        stretch = np.hypot(*slope.T)
        change = np.sum(slope * bend, axis=1) / stretch
        exact = (1 - 1 / stretch)[:, None] * bend + (change / stretch**2)[:, None] * slope
        spacing = np.array([2 * np.pi / count])
        density = tension_of(shape, one(shape), spacing, order, 1.7) / spacing
        return np.abs(density - 1.7 * exact).max()

    # The sharp ends need some hundred nodes before the next term, down by Δs², is small.
    found = observed_order(error, (120, 240))
    assert found == pytest.approx(order, abs=0.3), f"order {found:.2f}"


@each_order
def test_area_converges_to_that_of_the_curve(order):
    # ½∮(x y' - y x') of the curve: the second harmonic of x meets none in y.
    exact = 0.7 * np.pi

    def error(count):
        shape, _, _ = stretched_curve(count)
        return abs(membrane_areas(shape, one(shape), order)[0] - exact)

    found = observed_order(error, (12, 24))
    assert found == pytest.approx(order, abs=0.3), f"order {found:.2f}"


@each_order
@pytest.mark.parametrize("way", ["along", "across"])
def test_a_zigzag_of_the_nodes_is_resisted(order, way):
    """With stiffness K_e (Σ 2 |c_k|)²/Δs along the membrane, T/g in place of K_e across it."""
    count, stretch = 400, 1.25
    ring = stretch * scenes.ellipse((0.0, 0.0), (1.0, 1.0), count)
    spacing = np.array([2 * np.pi / count])
    angle = 2 * np.pi * np.arange(count) / count
    outwards = np.column_stack((np.cos(angle), np.sin(angle)))
    tangent = np.column_stack((-np.sin(angle), np.cos(angle)))
    zigzag = (-1.0) ** np.arange(count)[:, None] * (tangent if way == "along" else outwards)
    step = 1e-6
    pulled, pushed = (
        tension_of(ring + sign * step * zigzag, one(ring), spacing, order, 1.7) for sign in (1, -1)
    )
    stiffness = -np.sum((pulled - pushed) * zigzag, axis=1) / (2 * step)
    modulus = 1.7 if way == "along" else 1.7 * (1 - 1 / stretch)
    wanted = modulus * sum(2 * abs(c) for c in twins.STAGGERED[order]) ** 2 / spacing
    # Curvature mixes the two directions by (Δs/R)² = 2e-4.
    assert stiffness == pytest.approx(np.full(count, wanted), rel=2e-3)


@given(seeds, orders)
def test_removed_flux_leaves_the_area_unchanged(seed, order):
    positions, offsets, _ = rings(seed)
    velocities = scenes.generator(seed, 2).standard_normal(positions.shape)
    after = without_flux(positions, offsets, order, velocities)
    rate = area_rate(positions, offsets, order, after)
    assert np.abs(rate).max() <= 1e-13 * np.abs(velocities).sum(), np.abs(rate).max()


@given(seeds, orders, st.floats(0, 10))
def test_areas_relax_at_the_restoring_rate(seed, order, restoring):
    positions, offsets, _ = rings(seed)
    random = scenes.generator(seed, 5)
    velocities = random.standard_normal(positions.shape)
    reference = random.uniform(1, 3, len(offsets) - 1)
    after = without_flux(positions, offsets, order, velocities, restoring, reference)
    rate = area_rate(positions, offsets, order, after)
    wanted = -restoring * (areas_of(positions, offsets, order) - reference)
    assert rate == pytest.approx(wanted, abs=1e-13 * (np.abs(velocities).sum() + 10 * restoring))


@given(seeds, orders)
def test_flux_correction_is_one_normal_speed_for_each_membrane(seed, order):
    """Tangential parts stay; the normal parts all lose the mean of Eq. 20."""
    positions, offsets, _ = rings(seed)
    before = scenes.generator(seed, 4).standard_normal(positions.shape)
    after = without_flux(positions, offsets, order, before)
    for first, end in pairwise(offsets):
        normal = normals(positions[first:end], order)
        width = np.hypot(*normal.T)
        unit = normal / width[:, None]
        mean = np.sum(before[first:end] * normal) / width.sum()
        wanted = before[first:end] - mean * unit
        # A normal much shorter than a spacing keeps fewer digits of its direction.
        digits = 1e-13 / min(width.min(), 1.0)
        assert after[first:end] == pytest.approx(wanted, abs=digits)


def normals(ring, order):
    """Gradient of the area with the position of each node."""
    across = twins.central_difference(ring, order)
    return np.column_stack((across[:, 1], -across[:, 0]))


def areas_of(positions, offsets, order):
    return np.array(
        [twins.membrane_area(positions[first:end], order) for first, end in pairwise(offsets)]
    )


def area_rate(positions, offsets, order, velocities):
    """d/dt of the areas of nodes that move with given velocities."""
    return np.array(
        [
            np.sum(normals(positions[first:end], order) * velocities[first:end])
            for first, end in pairwise(offsets)
        ]
    )


@given(seeds, orders)
def test_normals_are_the_gradient_of_the_area(seed, order):
    """The area is quadratic in the nodes, so that its central difference is exact."""
    positions, offsets, _ = rings(seed)
    direction = scenes.generator(seed, 6).standard_normal(positions.shape)
    risen, fallen = (
        membrane_areas(positions + sign * direction, offsets, order) for sign in (0.5, -0.5)
    )
    rate = area_rate(positions, offsets, order, direction)
    assert risen - fallen == pytest.approx(rate, abs=1e-13 * np.abs(direction).sum())
    along = (area_gradients(positions, offsets, order) * direction).sum(axis=1)
    found = np.add.reduceat(along, offsets[:-1])
    assert found == pytest.approx(rate, abs=1e-13 * np.abs(direction).sum())


@given(seeds, orders)
def test_areas_are_their_numpy_twin(seed, order):
    positions, offsets, _ = rings(seed)
    areas = membrane_areas(positions, offsets, order)
    assert areas == pytest.approx(areas_of(positions, offsets, order), abs=1e-13)


@each_order
def test_normals_point_outwards(order):
    ring = scenes.ellipse((0.0, 0.0), (1.0, 2.0), 50)
    after = without_flux(ring, one(ring), order, ring)
    assert np.sum(after * normals(ring, order)) == pytest.approx(0, abs=1e-13)
    assert np.sum(ring * normals(ring, order)) > 0


def test_areas_of_known_polygons():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]])
    triangle = np.array([[0.0, 0.0], [4.0, 0.0], [1.0, 2.0]])
    nodes, offsets = np.concatenate((square, triangle, square[::-1])), np.array([0, 4, 7, 11])
    assert membrane_areas(nodes, offsets, 2).tolist() == [6.0, 4.0, -6.0]
    count = 33
    ring = scenes.ellipse((0.3, 0.2), (1.0, 1.0), count)
    exact = 0.5 * count * math.sin(2 * math.pi / count)
    assert membrane_areas(ring, one(ring), 2)[0] == pytest.approx(exact, rel=1e-14)


@given(seeds, orders, st.sampled_from([1e3, -1e6]))
def test_areas_do_not_depend_on_the_place(seed, order, far):
    """At 1e6 a coordinate keeps 1e-10, and so must the area; the plain shoelace keeps 1e-4."""
    positions, offsets, _ = rings(seed)
    here = membrane_areas(positions, offsets, order)
    there = membrane_areas(positions + far, offsets, order)
    assert there == pytest.approx(here, abs=30 * np.spacing(abs(far)))


@given(seeds, orders)
def test_areas_keep_their_digits_wherever_the_particle_is(seed, order):
    """Nodes on a lattice of 2⁻¹² stay there to the last bit, even 2²⁴ away: and so the area."""
    positions, offsets, _ = rings(seed)
    positions = np.round(positions * 2**12) / 2**12
    here = membrane_areas(positions, offsets, order)
    for far in (2.0**24, -(2.0**24)):
        assert membrane_areas(positions + far, offsets, order).tolist() == here.tolist()


@pytest.mark.parametrize("order", [0, 1, 3, 4, 5, 8])
def test_an_order_without_a_stencil_is_refused(order):
    ring = scenes.ellipse((0.0, 0.0), (1.0, 1.0), 12)
    for call in (
        lambda: tension_of(ring, one(ring), np.ones(1), order),
        lambda: without_flux(ring, one(ring), order, ring),
        lambda: membrane_areas(ring, one(ring), order),
    ):
        with pytest.raises(ValueError, match="2 or 6"):
            call()


@given(seeds, orders)
def test_a_lost_node_is_seen(seed, order):
    positions, offsets, spacing = rings(seed)
    positions[9] = np.nan
    assert np.isnan(tension_of(positions, offsets, spacing, order)[9]).all()
    assert np.isnan(without_flux(positions, offsets, order, positions)[9]).all()
    areas = membrane_areas(positions, offsets, order)
    assert np.isnan(areas).tolist() == [False, True, False, False]


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


@given(
    st.one_of(
        st.sampled_from([-1e-300, -1e-20, -1e-16, -0.0, 1.0, np.nextafter(1, 0), 3.0, -7.0]),
        st.floats(-1e6, 1e6),
    ),
    st.sampled_from([1.0, 0.7, 0.2734375, 1 / 3, 0.1, 2.5]),
)
def test_wrapping_twice_is_wrapping_once(start, length):
    """Also just below zero, where adding a period rounds to the period itself."""
    ring = scenes.ellipse((0.0, 0.0), (0.05, 0.05), 12)
    ring[:, 0] += start * length - ring[0, 0]
    ring[0, 0] = start * length
    wrap_particles(ring, one(ring), length)
    assert 0 <= ring[0, 0] < length, ring[0, 0]
    again = ring.copy()
    wrap_particles(again, one(ring), length)
    assert again.tobytes() == ring.tobytes()


@given(seeds)
def test_wrapping_rounds_once(seed):
    """One subtraction of all periods: on a detour over another period nodes would lose digits."""
    positions, offsets, _ = rings(seed)
    length = 0.75
    wrapped = positions.copy()
    wrap_particles(wrapped, offsets, length)
    for first, end in pairwise(offsets):
        shift = length * np.floor(positions[first, 0] / length)
        assert wrapped[first:end, 0].tolist() == (positions[first:end, 0] - shift).tolist()


def test_wrapping_ends_where_the_quotient_rounds_to_zero():
    """The smallest negative number, over a period above 1, is no whole number of periods off."""
    ring = scenes.ellipse((0.0, 0.0), (0.05, 0.05), 12)
    ring[0, 0] = -5e-324
    assert np.floor(ring[0, 0] / 3.0) == 0
    wrap_particles(ring, one(ring), 3.0)
    assert ring[0, 0] == 0.0


@pytest.mark.parametrize("lost", [np.nan, np.inf, -np.inf])
def test_wrapping_a_lost_node_ends(lost):
    ring = scenes.ellipse((0.0, 0.0), (0.05, 0.05), 12)
    ring[0, 0] = lost
    wrap_particles(ring, one(ring), 1.0)
    assert np.isnan(ring[0, 0])


def test_rest_spacing_is_the_perimeter_of_the_equal_circle_over_the_nodes():
    radius, counts = np.array([0.5, 0.7]), np.array([30, 47])
    offsets = np.append(0, np.cumsum(counts))
    wanted = 2 * np.pi * radius / counts
    assert rest_spacing(np.pi * radius**2, offsets) == pytest.approx(wanted, rel=1e-14)
