import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from twins import evaluate_kernel

from softslip.solver.transfer import interpolate_curl, spread_across, spread_curl

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


def spread_twin(positions, amounts):
    """Σ_s A_s δ_h(x_ij - X_s) (Eq. 28)."""
    return np.einsum("s,sij->ij", amounts, twin_weights(positions)) / MESH**2


def interpolate_twin(positions, field):
    """Σ_ij φ_ij δ_h(x_ij - X_s) dx² (Eq. 15)."""
    return np.einsum("ij,sij->s", field, twin_weights(positions))


def spread_curl_of(positions, forces):
    curl = np.zeros(SHAPE)
    spread_curl(positions, forces, MESH, curl)
    return curl


def spread_across_of(heights, amounts):
    column = np.zeros(SHAPE[1])
    spread_across(heights.copy(), amounts.copy(), MESH, column)
    return column


def interpolated_curl(positions, psi):
    velocities = np.empty_like(positions)
    interpolate_curl(positions, psi, MESH, velocities)
    return velocities


def difference(field, axis):
    return (np.roll(field, -1, axis) - np.roll(field, 1, axis)) / (2 * MESH)


def assert_adjoint(one, other, size):
    assert abs(one - other) <= 1e-13 * size, f"off by {abs(one - other) / size:.1e}"


@given(seeds)
def test_spread_curl_is_adjoint_of_interpolate_curl(seed):
    positions, forces, psi = scene(seed)
    velocities = interpolated_curl(positions, psi)
    on_mesh = np.vdot(spread_curl_of(positions, forces), psi) * MESH**2
    assert_adjoint(on_mesh, np.vdot(forces, velocities), np.abs(forces).sum() / MESH)


@given(seeds)
def test_spread_curl_is_the_central_difference_of_the_spread_force(seed):
    positions, forces, _ = scene(seed)
    along, across = (spread_twin(positions, forces[:, axis]) for axis in (0, 1))
    twin = difference(across, 0) - difference(along, 1)
    error = np.abs(spread_curl_of(positions, forces) - twin).max()
    assert error <= 1e-13 * np.abs(twin).max() + 1e-14 / MESH**3, f"off by {error:.1e}"


@given(seeds)
def test_interpolate_curl_interpolates_the_differenced_streamfunction(seed):
    positions, _, psi = scene(seed)
    velocities = interpolated_curl(positions, psi)
    twin = np.column_stack(
        [interpolate_twin(positions, v) for v in (difference(psi, 1), -difference(psi, 0))]
    )
    error = np.abs(velocities - twin).max()
    assert error <= 1e-13 * np.abs(psi).max() / MESH, f"off by {error:.1e}"


@given(seeds)
def test_interpolate_curl_reproduces_linear_flows(seed):
    """Of a quadratic streamfunction, whose central differences are exact."""
    positions, _, _ = scene(seed)
    positions = MESH * (4 + np.mod(positions / MESH, 12))
    x, y = np.meshgrid(*(MESH * np.arange(count) for count in SHAPE), indexing="ij")
    psi = 1.5 + 2.0 * x - 3.0 * y + 0.7 * x * y + 0.5 * (4.0 * x**2 - 5.0 * y**2)
    x, y = positions.T
    exact = np.column_stack((-3.0 + 0.7 * x - 5.0 * y, -2.0 - 0.7 * y - 4.0 * x))
    assert interpolated_curl(positions, psi) == pytest.approx(exact, abs=1e-12)


@given(seeds, st.integers(-3, 3), st.integers(-3, 3))
def test_spread_curl_is_periodic(seed, periods_x, periods_y):
    positions, forces, _ = scene(seed)
    shift = MESH * np.multiply(SHAPE, (periods_x, periods_y))
    once, again = (spread_curl_of(at, forces) for at in (positions, positions + shift))
    assert again == pytest.approx(once, abs=1e-11 / MESH**3)


@given(seeds)
def test_spread_across_is_the_x_sum_of_the_spread_force(seed):
    positions, forces, _ = scene(seed)
    twin = spread_twin(positions, forces[:, 0]).sum(axis=0) * MESH
    column = spread_across_of(positions[:, 1], forces[:, 0])
    assert column == pytest.approx(twin, abs=1e-12 / MESH)


@given(seeds)
def test_spread_across_keeps_force_and_torque(seed):
    """Sum and first moment of the density are those of the nodes (zeroth and first moment)."""
    positions, forces, _ = scene(seed)
    # Well inside the mesh, where a first moment has a meaning.
    heights = 0.5 * MESH * SHAPE[1] + 0.1 * (positions[:, 1] - positions[:, 1].mean())
    density = spread_across_of(heights, forces[:, 0]) * MESH
    assert density.sum() == pytest.approx(forces[:, 0].sum(), abs=1e-12)
    lines = MESH * np.arange(SHAPE[1])
    assert density @ lines == pytest.approx(forces[:, 0] @ heights, abs=1e-12)


def test_spreading_adds_to_what_is_there():
    positions, forces, field = scene(3)
    twice, column = field.copy(), field[0].copy()
    for _ in range(2):
        spread_curl(positions, forces, MESH, twice)
        spread_across(positions[:, 1].copy(), forces[:, 0].copy(), MESH, column)
    assert twice == pytest.approx(field + 2 * spread_curl_of(positions, forces), rel=1e-12)
    across = spread_across_of(positions[:, 1], forces[:, 0])
    assert column == pytest.approx(field[0] + 2 * across, rel=1e-12)
