import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import empty, parameters

from softslip.simulation import assembly
from softslip.solver.geometry import Box, Layout
from softslip.solver.long_modes import LONG_MODES
from softslip.solver.membrane import (
    ORDERS,
    MembraneLaw,
    add_tension,
    area_gradients,
    membrane_areas,
    staggered,
)
from softslip.solver.membrane_response import MembraneResponse
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.line import line_symbols
from softslip.solver.mobility.quadrature import CorrectedQuadrature
from softslip.solver.state import State
from softslip.solver.wall_response import WallResponse

RADIUS = 0.0085
REGULARISATION = 0.06 / 8192


def layout_of(counts, radius=RADIUS):
    offsets = np.append(0, np.cumsum(counts)).astype(np.int64)
    spacing = 2 * math.pi * radius / np.asarray(counts, dtype=float)
    return Layout(offsets, spacing, np.zeros((2, 8, 2)), 1e-3)


def ring(count, stretch=1.02, waves=(), radius=RADIUS):
    """A circle with waves (mode, amplitude, phase) on its radius."""
    angle = 2 * np.pi * np.arange(count) / count
    r = stretch * radius * np.ones(count)
    for mode, amplitude, phase in waves:
        r += radius * amplitude * np.cos(mode * angle + phase)
    return np.column_stack((r * np.cos(angle), r * np.sin(angle)))


def response_of(layout, order=6):
    law = MembraneLaw(1.0, order, None)
    return MembraneResponse(layout, law, REGULARISATION, 1.0, corrected=True)


def dense(solve, nodes):
    """P_g as a matrix."""
    columns = []
    for unit in np.eye(2 * nodes):
        change = unit.reshape(-1, 2).copy()
        solve(change)
        columns.append(change.ravel())
    return np.array(columns).T


def circulant(symbol):
    """The matrix that multiplies mode k by its symbol, of 0 ... N-1."""
    kernel = np.fft.ifft(symbol).real
    rows = np.arange(symbol.size)
    return kernel[(rows[:, None] - rows[None, :]) % symbol.size]


def strains(positions, order=6):
    """B and C as matrices, and the lengths |D X|."""
    count = len(positions)
    difference = np.zeros((count, count))
    for s in range(count):
        for k, weight in enumerate(staggered(order)):
            difference[s, (s + 1 + k) % count] += weight
            difference[s, (s - k) % count] -= weight
    arms = difference @ positions
    lengths = np.hypot(*arms.T)
    tangents = arms / lengths[:, None]
    normals = np.column_stack((tangents[:, 1], -tangents[:, 0]))
    return (
        *(
            (direction[:, None, :] * difference[:, :, None]).reshape(count, -1)
            for direction in (tangents, normals)
        ),
        lengths,
    )


def others_than_area(positions, order=6):
    """The projection 1 - a aᵀ/a² as a matrix, and a."""
    a = area_gradients(positions, np.array([0, len(positions)]), order).ravel()
    return np.eye(a.size) - np.outer(a, a) / (a @ a), a


def parts(positions, spacing, order=6):
    """Bᵀ Q B and Cᵀ R C as matrices, by the definitions in the module."""
    count = len(positions)
    along, across, lengths = strains(positions, order)
    half = np.arange(count // 2 + 1)
    symbols = line_symbols(
        2 * np.pi * half / (count * spacing), spacing, REGULARISATION, 1.0, corrected=True
    )
    mirrored = np.minimum(np.arange(count), count - np.arange(count))
    q, r = (symbol[mirrored] for symbol in symbols)
    q = np.where(mirrored > 0, q / spacing, 0.0)
    r = np.where(mirrored > LONG_MODES, r * np.mean(1 / spacing - 1 / lengths), 0.0)
    return along.T @ circulant(q) @ along, across.T @ circulant(r) @ across


SHAPES = {
    "circle": (),
    "ellipse": ((2, 0.15, 0.3),),
    "polygon": ((2, 0.05, 0.0), (5, 0.04, 1.0), (6, 0.02, 2.0)),
}


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("shift", [1e-3, 0.02, 0.1])
@pytest.mark.parametrize("count", [73, 102])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_solve_is_the_inverse_of_one_less_g_times_the_response(shape, count, shift, order):
    layout, nodes = layout_of([count]), ring(count, waves=SHAPES[shape])
    solved = dense(response_of(layout, order).at(nodes, shift), count)
    one = np.eye(2 * count)
    tangential, normal = parts(nodes, layout.spacing[0], order)
    inverse = np.linalg.inv(one + shift * normal) @ np.linalg.inv(one + shift * tangential)
    projection, _ = others_than_area(nodes, order)
    # The product's own response, and what is left of it where pressure keeps the area.
    exact = np.linalg.inv(one + projection @ (np.linalg.inv(inverse) - one))
    assert np.abs(solved - exact).max() < {"circle": 0.02}.get(shape, 0.06)


@settings(max_examples=25)
@given(
    count=st.integers(24, 130),
    shift=st.floats(1e-4, 0.15),
    stretch=st.floats(0.97, 1.15),
    amplitudes=st.lists(st.floats(-0.04, 0.04), min_size=4, max_size=4),
)
def test_no_change_is_turned_round_or_amplified(count, shift, stretch, amplitudes):
    waves = [(k + 2, a, 0.7 * k) for k, a in enumerate(amplitudes)]
    nodes = ring(count, stretch, waves)
    eigenvalues = np.linalg.eigvals(dense(response_of(layout_of([count])).at(nodes, shift), count))
    assert np.abs(eigenvalues.imag).max() < 1e-3
    assert eigenvalues.real.min() > -0.02
    assert eigenvalues.real.max() < 1 + 1e-9


@pytest.mark.parametrize("shape", SHAPES)
def test_the_tangential_response_is_symmetric_and_takes_energy_away(shape):
    count = 90
    # Without tension there is no normal part.
    nodes = ring(count, 0.99, SHAPES[shape])
    _, _, lengths = strains(nodes)
    layout = layout_of([count], RADIUS * float(lengths.mean()) * count / (2 * math.pi * RADIUS))
    solved = dense(response_of(layout).at(nodes, 0.01), count)
    # Pressure, which acts on velocities alone, makes it so between displacements that keep areas.
    projection, _ = others_than_area(nodes)
    solved = projection @ solved @ projection
    np.testing.assert_allclose(solved, solved.T, atol=2e-3)
    assert np.linalg.eigvalsh(0.5 * (solved + solved.T)).max() < 1 + 1e-9


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("shape", SHAPES)
def test_areas_change_as_they_would_without_a_response(shape, order):
    layout = layout_of([90, 73])
    nodes = np.concatenate((ring(90, waves=SHAPES[shape]), ring(73, 1.05)))
    change = 0.1 * RADIUS * np.random.default_rng(1).standard_normal(nodes.shape)
    solved = change.copy()
    response_of(layout, order).at(nodes, 0.05)(solved)
    assert np.abs(solved - change).max() > 0.5 * np.abs(change).max()

    def areas(moved):
        return membrane_areas(nodes + moved, layout.offsets, order)

    # The area is quadratic: this is twice its change of first order.
    wanted = areas(change) - areas(-change)
    np.testing.assert_allclose(areas(solved) - areas(-solved), wanted, rtol=1e-8)


@pytest.mark.parametrize("shape", SHAPES)
def test_moving_turning_and_bending_without_stretching_cost_nothing(shape):
    count = 102
    nodes = ring(count, 1.0, SHAPES[shape])
    along, _, lengths = strains(nodes)
    # Rest distances at which nothing is under tension on the mean.
    layout = layout_of([count], float(lengths.mean()) * count / (2 * math.pi))
    solve = response_of(layout).at(nodes, 0.1)
    turning = np.column_stack((-nodes[:, 1], nodes[:, 0]))
    # Of all changes that bend, those that stretch nowhere: the null space of B.
    _, sizes, rows = np.linalg.svd(along)
    bending = rows[np.sum(sizes > 1e-10 * sizes[0]) :]
    assert len(bending) >= count
    for change in (np.ones((count, 2)), turning, *bending.reshape(-1, count, 2)[:10]):
        solved = change.copy()
        solve(solved)
        np.testing.assert_allclose(solved, change, rtol=0, atol=1e-9 * np.abs(change).max())


def test_each_membrane_answers_by_itself():
    counts = [73, 102, 40]
    rings = [ring(count, waves=SHAPES["polygon"]) for count in counts]
    together, layout = np.concatenate(rings), layout_of(counts)
    change = np.random.default_rng(5).standard_normal(together.shape)
    whole = change.copy()
    response_of(layout).at(together, 0.03)(whole)
    for first, count, nodes in zip(layout.offsets, counts, rings, strict=False):
        alone = change[first : first + count].copy()
        response_of(layout_of([count])).at(nodes, 0.03)(alone)
        assert alone.tobytes() == whole[first : first + count].tobytes()


@pytest.mark.parametrize(("count", "limit"), [(73, 0.04), (102, 0.04)])
def test_short_waves_of_an_isolated_circle_decay_as_the_response_says(count, limit):
    layout = layout_of([count])
    box = Box(0.25, 0.25, 0.0)
    nodes = ring(count, 1.0 + 1e-6) + 0.125
    # Walls that nothing pushes stand aside.
    spacing = float(layout.spacing[0])
    places = np.arange(0.0, box.length - 0.5 * spacing, spacing)
    walls = np.column_stack((places, np.full_like(places, 0.01)))
    layout = replace(layout, wall_reference=np.stack((walls, walls)), wall_spacing=spacing)
    split = 6.0 / 8192
    plain = EwaldMobility(box, REGULARISATION, 1.0, split)
    mobility = CorrectedQuadrature(plain, layout, box.length, REGULARISATION, 1.0)

    def velocities(particle):
        positions = np.concatenate((particle, walls, walls))
        forces = np.zeros_like(positions)
        add_tension(positions, layout.offsets, layout.spacing, 1.0, 6, forces)
        return mobility.velocities(positions, forces)[:count]

    rest = velocities(nodes)
    arms = np.roll(nodes, -1, axis=0) - np.roll(nodes, 1, axis=0)
    tangents = arms / np.hypot(*arms.T)[:, None]
    shift = 1e-6
    solve = response_of(layout).at(nodes, shift)
    for mode in (LONG_MODES + 4, count // 4, count // 3, count // 2 - 1):
        wave = np.cos(2 * np.pi * mode * np.arange(count) / count)[:, None] * tangents
        size = 1e-4 * spacing
        true = (velocities(nodes + size * wave) - rest) / size
        solved = wave.copy()
        solve(solved)
        said = (solved - wave) / shift
        both = [float(np.sum(field * wave) / np.sum(wave**2)) for field in (true, said)]
        assert both[1] == pytest.approx(both[0], rel=limit), f"mode {mode}"


@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_walls_answer_their_tethers_within_what_keeps_steps_stable(roughness):
    given = empty(
        fidelity="standard",
        wall={"roughness": roughness},
        hydrodynamics={"resolution": 8192, "node_spacing": 5.0},
        channel={"length": 0.0625, "height": 0.109375, "outer_gap": 0.03125},
    )
    particles = assembly.xr.Dataset(
        {
            "nodes_per_particle": ("particle", np.empty(0, np.int64)),
            "reference_area": ("particle", np.empty(0)),
        }
    )
    layout = assembly.layout_of(particles, given)
    suspension = assembly.assemble(given, layout, stress=0.0)
    state = State.at_rest(np.empty((0, 2)), layout)
    generator = np.random.default_rng(2)
    shift = 0.05
    solve = suspension.response(state, shift)
    # A power iteration for the largest eigenvalue of -g P_g J on the tethers.
    vector = np.zeros_like(state.vector)
    vector[:-4] = generator.standard_normal(vector.size - 4)
    ratio = 0.0
    for _ in range(40):
        vector /= np.abs(vector).max()
        after = -shift * solve(suspension.rate(state.replace(vector, 0.0, 0)))
        after[-4:] = 0.0
        ratio = float(np.abs(after).max())
        vector = after
    assert 0.3 < ratio < 1.67
    bare = np.abs(shift * suspension.rate(state.replace(vector / np.abs(vector).max(), 0.0, 0)))
    assert bare[:-4].max() > 0


def test_the_mean_of_a_wall_along_the_flow_is_left_to_the_traction():
    given = parameters()
    walls = np.zeros((2, 64, 2))
    layout = Layout(np.zeros(1, np.int64), np.empty(0), walls, given.channel.length / 64)
    box = Box(given.channel.length, given.channel.height, given.channel.outer_gap)
    wall = WallResponse(layout, box, 2e4, REGULARISATION, 1.0, corrected=True)
    tethers = np.ones((2, 64, 2))
    wall.solve(tethers, 0.1)
    np.testing.assert_allclose(tethers, 1.0, rtol=1e-13)
