import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from twins import evaluate_kernel

from softslip.solver.transfer import (
    interpolate,
    interpolate_curl,
    spread,
    spread_across,
    spread_curl,
)

MESH = 1 / 64
SHAPE = (24, 40)

seeds = st.integers(0, 2**31)


def scene(seed, count=17):
    """Random nodes, many outside the first period, with forces and a mesh field."""
    random = scenes.generator(seed)
    positions = random.uniform(-2, 3, (count, 2)) * np.multiply(SHAPE, MESH)
    return positions, random.standard_normal((count, 2)), random.standard_normal(SHAPE)


def twin_weights(positions):
    """δ_h dx² of every node at every mesh point, shape (nodes, N_x, N_y), from Eq. 16."""
    factors = []
    for axis, count in enumerate(SHAPE):
        offset = np.arange(count)[None, :] - positions[:, axis, None] / MESH
        offset -= count * np.round(offset / count)
        factors.append(evaluate_kernel(offset.ravel()).reshape(offset.shape))
    return np.einsum("si,sj->sij", *factors)


def spread_of(positions, amounts):
    density = np.zeros(SHAPE)
    spread(positions, amounts, MESH, density)
    return density


def spread_curl_of(positions, forces):
    curl = np.zeros(SHAPE)
    spread_curl(positions, forces, MESH, curl)
    return curl


def interpolated(positions, field):
    values = np.empty(len(positions))
    interpolate(positions, field, MESH, values)
    return values


def difference(field, axis):
    return (np.roll(field, -1, axis) - np.roll(field, 1, axis)) / (2 * MESH)


def assert_adjoint(one, other, size):
    assert abs(one - other) <= 1e-13 * size, f"off by {abs(one - other) / size:.1e}"


@given(seeds)
def test_spread_is_adjoint_of_interpolate(seed):
    positions, forces, field = scene(seed)
    amounts = forces[:, 0]
    on_mesh = np.vdot(spread_of(positions, amounts), field) * MESH**2
    on_nodes = np.vdot(amounts, interpolated(positions, field))
    assert_adjoint(on_mesh, on_nodes, np.abs(amounts) @ interpolated(positions, np.abs(field)))


@given(seeds)
def test_spread_curl_is_adjoint_of_interpolate_curl(seed):
    positions, forces, psi = scene(seed)
    velocities = np.empty_like(positions)
    interpolate_curl(positions, psi, MESH, velocities)
    on_mesh = np.vdot(spread_curl_of(positions, forces), psi) * MESH**2
    assert_adjoint(on_mesh, np.vdot(forces, velocities), np.abs(forces).sum() / MESH)


@given(seeds)
def test_spread_and_interpolate_are_their_numpy_twins(seed):
    positions, forces, field = scene(seed)
    weights = twin_weights(positions)
    amounts = forces[:, 1]
    density = np.einsum("s,sij->ij", amounts, weights) / MESH**2
    assert spread_of(positions, amounts) == pytest.approx(density, abs=1e-11 / MESH**2)
    values = np.einsum("ij,sij->s", field, weights)
    assert interpolated(positions, field) == pytest.approx(values, abs=1e-11)


@given(seeds)
def test_spread_curl_is_the_central_difference_of_spread(seed):
    positions, forces, _ = scene(seed)
    along, across = (spread_of(positions, forces[:, axis].copy()) for axis in (0, 1))
    twin = difference(across, 0) - difference(along, 1)
    error = np.abs(spread_curl_of(positions, forces) - twin).max()
    assert error <= 1e-13 * np.abs(twin).max() + 1e-14 / MESH**3, f"off by {error:.1e}"


@given(seeds)
def test_interpolate_curl_interpolates_the_differenced_streamfunction(seed):
    positions, _, psi = scene(seed)
    velocities = np.empty_like(positions)
    interpolate_curl(positions, psi, MESH, velocities)
    twin = np.column_stack(
        (interpolated(positions, difference(psi, 1)), interpolated(positions, -difference(psi, 0)))
    )
    error = np.abs(velocities - twin).max()
    assert error <= 1e-13 * np.abs(psi).max() / MESH, f"off by {error:.1e}"


@given(seeds)
def test_spread_keeps_force_and_torque(seed):
    """Sum and first moment of the density are those of the nodes (zeroth and first moment)."""
    positions, forces, _ = scene(seed)
    # Well inside the mesh, where a first moment has a meaning.
    middle = 0.5 * MESH * np.array(SHAPE)
    positions = middle + 0.1 * (positions - positions.mean(axis=0))
    density = spread_of(positions, forces[:, 0].copy()) * MESH**2
    assert density.sum() == pytest.approx(forces[:, 0].sum(), abs=1e-12)
    heights = MESH * np.arange(SHAPE[1])
    assert density.sum(axis=0) @ heights == pytest.approx(forces[:, 0] @ positions[:, 1], abs=1e-12)


@given(seeds)
def test_interpolate_reproduces_linear_fields(seed):
    positions, _, _ = scene(seed)
    positions = MESH * (4 + np.mod(positions / MESH, 12))
    x, y = (MESH * np.arange(count) for count in SHAPE)
    field = 1.5 + 2.0 * x[:, None] - 3.0 * y[None, :]
    exact = 1.5 + positions @ [2.0, -3.0]
    assert interpolated(positions, field) == pytest.approx(exact, abs=1e-13)


@given(seeds)
def test_spread_across_is_the_x_sum_of_spread(seed):
    positions, forces, _ = scene(seed)
    column = np.zeros(SHAPE[1])
    spread_across(positions[:, 1].copy(), forces[:, 0].copy(), MESH, column)
    twin = spread_of(positions, forces[:, 0].copy()).sum(axis=0) * MESH
    assert column == pytest.approx(twin, abs=1e-12 / MESH)


@given(seeds, st.integers(-3, 3), st.integers(-3, 3))
def test_spread_is_periodic(seed, periods_x, periods_y):
    positions, forces, _ = scene(seed)
    shift = MESH * np.multiply(SHAPE, (periods_x, periods_y))
    once, again = (spread_of(at, forces[:, 0].copy()) for at in (positions, positions + shift))
    assert again == pytest.approx(once, abs=1e-11 / MESH**2)


def test_spread_adds_to_what_is_there():
    positions, forces, field = scene(3)
    twice = field.copy()
    spread(positions, forces[:, 0].copy(), MESH, twice)
    spread(positions, forces[:, 0].copy(), MESH, twice)
    assert twice == pytest.approx(field + 2 * spread_of(positions, forces[:, 0].copy()), rel=1e-12)
