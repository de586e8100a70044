import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
import scenes
from exact_flows import ShearWave, Vortices
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import evaluate_kernel, mesh_velocity

from softslip.solver.geometry import Box
from softslip.solver.mobility.grid import GridMobility, laplacian_symbol

BOX = Box(length=0.375, height=0.375, outer_gap=0.125)
RESOLUTION = 64
MESH = 1 / RESOLUTION
SYMBOLS = ["compact", "wide"]

seeds = st.integers(0, 2**31)


def nodes(seed, count=9):
    random = scenes.generator(seed)
    return random.uniform(0, 0.5, (count, 2)), random.standard_normal((count, 2))


def mobility(symbol="compact", resolution=RESOLUTION, viscosity=1.3, box=BOX):
    return GridMobility(box, resolution, viscosity, symbol)


def mesh_points(box, resolution):
    x, y = (np.arange(round(side * resolution)) / resolution for side in (box.length, box.period))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


def dense_velocities(positions, forces, symbol, viscosity):
    """Eqs. 9 to 16 and 28 by sums over all modes and mesh points, without any FFT."""
    shape = round(BOX.length / MESH), round(BOX.period / MESH)
    weights = []
    for axis, count in enumerate(shape):
        offset = positions[:, axis, None] / MESH - np.arange(count)
        offset -= count * np.round(offset / count)
        weights.append(evaluate_kernel(offset.ravel()).reshape(offset.shape))
    kernel = np.einsum("si,sj->sij", *weights)
    density = np.einsum("sa,sij->ija", forces, kernel) / MESH**2

    def difference(field, axis):
        return (np.roll(field, -1, axis) - np.roll(field, 1, axis)) / (2 * MESH)

    curl = difference(density[..., 1], 0) - difference(density[..., 0], 1)
    waves = [
        np.exp(-2j * np.pi * np.outer(np.arange(count), np.arange(count)) / count)
        for count in shape
    ]
    squared = np.zeros(shape)
    for axis, count in enumerate(shape):
        k = np.arange(count)
        if symbol == "compact":
            part = 4 * np.sin(np.pi * k / count) ** 2 / MESH**2
        else:
            part = np.sin(2 * np.pi * k / count) ** 2 / MESH**2
        squared += np.expand_dims(part, 1 - axis)
    modes = waves[0] @ curl @ waves[1]
    carried = squared > 1e-12 * squared.max()
    modes = np.where(carried, modes / (viscosity * np.where(carried, squared, 1.0) ** 2), 0.0)
    psi = (waves[0].conj() @ modes @ waves[1].conj()).real / np.prod(shape)
    field = np.stack((difference(psi, 1), -difference(psi, 0)), axis=-1)
    return np.einsum("ija,sij->sa", field, kernel)


@pytest.mark.parametrize("symbol", SYMBOLS)
def test_velocities_are_those_of_a_dense_fourier_sum(symbol):
    positions, forces = nodes(1)
    twin = dense_velocities(positions, forces, symbol, 1.3)
    error = np.abs(mobility(symbol).velocities(positions, forces) - twin).max()
    assert error <= 1e-12 * np.abs(twin).max(), f"off by {error / np.abs(twin).max():.1e}"


@settings(max_examples=15)
@given(seeds, st.sampled_from(SYMBOLS))
def test_mobility_is_symmetric(seed, symbol):
    positions, forces = nodes(seed)
    other = scenes.generator(seed, 1).standard_normal(forces.shape)
    solver = mobility(symbol)
    one = np.vdot(other, solver.velocities(positions, forces))
    two = np.vdot(forces, solver.velocities(positions, other))
    power = np.vdot(forces, solver.velocities(positions, forces))
    assert abs(one - two) <= 1e-12 * power, f"off by {abs(one - two) / power:.1e}"


@pytest.mark.parametrize("symbol", SYMBOLS)
def test_mobility_is_positive_semidefinite(symbol):
    positions, _ = nodes(4, count=14)
    solver, count = mobility(symbol), 28
    columns = [solver.velocities(positions, unit.reshape(-1, 2)).ravel() for unit in np.eye(count)]
    eigenvalues = np.linalg.eigvalsh(np.array(columns))
    assert eigenvalues[0] >= -1e-13 * eigenvalues[-1], f"eigenvalue {eigenvalues[0]:.1e}"


@settings(max_examples=15)
@given(seeds, st.integers(-40, 40), st.integers(-40, 40))
def test_whole_cell_translations_change_nothing(seed, cells_x, cells_y):
    positions, forces = nodes(seed)
    solver = mobility()
    moved = positions + MESH * np.array([cells_x, cells_y])
    here, there = (solver.velocities(at, forces) for at in (positions, moved))
    # The positions themselves round in their last digit, times the kernel's slope.
    error = np.abs(there - here).max() / np.abs(here).max()
    assert error <= 1e-11, f"off by {error:.1e}"


def test_translations_by_a_fraction_of_a_cell_change_little():
    """The kernel smooths what the mesh does to translation: 0.2 % of the largest velocity."""
    positions, forces = nodes(6)
    solver = mobility()
    here = solver.velocities(positions, forces)
    for fraction in (0.1, 0.25, 0.5, 0.77):
        moved = solver.velocities(positions + fraction * MESH, forces)
        error = np.abs(moved - here).max() / np.abs(here).max()
        assert error < 2e-3, f"off by {error:.1e} at {fraction} cells"


@settings(max_examples=15)
@given(seeds, st.sampled_from(SYMBOLS))
def test_flow_is_divergence_free_and_carries_no_net_flow(seed, symbol):
    positions, forces = nodes(seed)
    field = mesh_velocity(mobility(symbol), positions, forces)
    divergence = sum(
        (np.roll(field[..., axis], -1, axis) - np.roll(field[..., axis], 1, axis)) / (2 * MESH)
        for axis in (0, 1)
    )
    size = np.abs(field).max()
    assert np.abs(divergence).max() <= 1e-12 * size / MESH, np.abs(divergence).max()
    assert np.abs(field.mean(axis=(0, 1))).max() <= 1e-13 * size


@pytest.mark.parametrize("symbol", SYMBOLS)
@pytest.mark.parametrize("exact", [ShearWave, Vortices])
def test_manufactured_flows_converge_at_second_order(exact, symbol):
    """The mesh points are the nodes, so that the kernel smooths the force: error O(dx²)."""
    solution = exact(BOX.length, BOX.period)
    points, errors = scenes.generator(3).uniform(0, 0.5, (40, 2)), []
    for resolution in (128, 256):
        sources = mesh_points(BOX, resolution)
        solver = GridMobility(BOX, resolution, solution.viscosity, symbol)
        found = solver.velocities_at(points, sources, solution.force(sources) / resolution**2)
        wanted = solution.velocity(points)
        errors.append(np.abs(found - wanted).max() / np.abs(wanted).max())
    order = np.log2(errors[0] / errors[1])
    assert errors[1] < 2e-2, f"error {errors[1]:.1e}"
    assert 1.9 < order < 2.2, f"order {order:.2f}"


def test_a_pressure_gradient_does_nothing():
    """The discrete gradient of any mesh field, spread from the mesh points, moves no fluid."""
    sources = mesh_points(BOX, RESOLUTION)
    solver = mobility()
    pressure = scenes.generator(5).standard_normal(solver.shape)
    gradient, random = np.empty((*solver.shape, 2)), scenes.generator(6)
    for axis in (0, 1):
        gradient[..., axis] = np.roll(pressure, -1, axis) - np.roll(pressure, 1, axis)
    other = random.standard_normal(gradient.shape)
    moved, reference = (
        np.abs(solver.velocities(sources, forces.reshape(-1, 2))).max()
        for forces in (gradient, other)
    )
    assert moved <= 1e-12 * reference, f"moves fluid at {moved / reference:.1e}"


def test_mesh_velocity_interpolates_to_the_node_velocity():
    positions, forces = nodes(8)
    solver = mobility()
    found = solver.velocities(positions, forces)
    points = mesh_points(BOX, RESOLUTION)
    field = mesh_velocity(solver, positions, forces).reshape(-1, 2)
    offset = (points[None] - positions[:, None]) / MESH
    offset -= np.round(offset * MESH / (BOX.length, BOX.period)) * np.array(solver.shape)
    weights = evaluate_kernel(offset.ravel()).reshape(offset.shape).prod(axis=-1)
    assert weights @ field == pytest.approx(found, abs=1e-12 * np.abs(found).max())


def test_viscosity_divides_the_velocity():
    positions, forces = nodes(2)
    thin, thick = (mobility(viscosity=eta).velocities(positions, forces) for eta in (1.0, 2.0))
    assert np.array_equal(thin, 2 * thick)


@pytest.mark.parametrize(("symbol", "ratio"), [("compact", 4 / np.pi**2), ("wide", 0.0)])
def test_laplacian_symbols_at_the_ends_of_the_spectrum(symbol, ratio):
    modes = np.array([0.0, 1.0, 512.0])
    values = laplacian_symbol(modes, 1024, 1 / 1024, symbol)
    exact = (2 * np.pi * modes) ** 2
    assert values[0] == 0
    assert values[1] == pytest.approx(exact[1], rel=2e-5)
    assert values[2] == pytest.approx(ratio * exact[2], rel=1e-12)


DIGEST = """
import hashlib, scenes, sys
from softslip.solver.geometry import Box
from softslip.solver.mobility.grid import GridMobility
random = scenes.generator(11)
positions, forces = random.uniform(0, 1, (200, 2)), random.standard_normal((200, 2))
solver = GridMobility(Box(0.375, 0.375, 0.125), 256, 1.0)
print(hashlib.sha256(solver.velocities(positions, forces).tobytes()).hexdigest())
"""


def test_same_input_gives_the_same_bytes_in_every_process():
    random = scenes.generator(11)
    positions, forces = random.uniform(0, 1, (200, 2)), random.standard_normal((200, 2))
    solver = GridMobility(Box(0.375, 0.375, 0.125), 256, 1.0)
    first = solver.velocities(positions, forces)
    solver.velocities(positions + 0.1, forces)
    assert np.array_equal(first, solver.velocities(positions, forces))
    elsewhere = subprocess.run(
        [sys.executable, "-c", DIGEST],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        check=True,
        capture_output=True,
        text=True,
    )
    assert elsewhere.stdout.strip() == hashlib.sha256(first.tobytes()).hexdigest()
