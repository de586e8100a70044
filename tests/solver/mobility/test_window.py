import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from softslip.solver.mobility import window as module

SPACING = (0.31, 0.17)
SHAPE = (20, 27)
PERIODS = (20 * 0.31, 27 * 0.17)


def weights_at(coordinate, count):
    """First line and weights of one point; coordinate and mesh in units of the mesh size."""
    lines, weights = np.empty(1, np.int32), np.empty((module.WIDTH, 1))
    module.window_weights(np.array([coordinate]), float(count), count, lines, weights)
    return lines[0], weights[:, 0]


@given(st.floats(-40, 40))
def test_weights_are_the_window_at_every_place(coordinate):
    first, weights = weights_at(coordinate, 16)
    lines = first + np.arange(module.WIDTH) - module.WIDTH // 2 + 1
    exact = module.window(coordinate % 16 - lines)
    error = np.abs(weights - exact).max()
    # The polynomials are fitted to this; the sums' own error is a hundred times larger.
    assert error < 5e-7, f"the polynomials are off by {error:.1e}"


@given(st.floats(-1e3, 1e3))
def test_no_line_under_the_window_is_left_out(coordinate):
    first, _ = weights_at(coordinate, 16)
    line = first - module.WIDTH // 2 + 1
    outside = np.array([line - 1, line + module.WIDTH]) - coordinate % 16
    assert module.window(outside).max() <= module.window(np.array([module.WIDTH / 2]))[0]
    assert 0 <= first <= 16, f"line {first} lies outside the mesh and its margins"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_lost_point_is_seen_but_written_nowhere_else(value):
    first, weights = weights_at(value, 16)
    assert first == 0
    assert np.isnan(weights).all()


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_transform_is_the_fourier_integral(share):
    spacing = 0.4
    wavenumber = share * np.pi / spacing
    half = 0.5 * module.WIDTH * spacing
    integral, _ = quad(
        lambda x: module.window(np.array([x / spacing]))[0] * np.cos(wavenumber * x), -half, half
    )
    transform = module.window_transform(np.array([wavenumber]), spacing)[0]
    assert transform == pytest.approx(integral, rel=1e-7, abs=1e-9)


def spread(points, forces):
    mesh = np.zeros((SHAPE[0] + module.WIDTH, SHAPE[1] + module.WIDTH, 2))
    module.spread_window(points.T.copy(), forces.T.copy(), PERIODS, mesh)
    module.fold_margins(mesh)
    return mesh[: SHAPE[0], : SHAPE[1]]


def gather(points, field):
    mesh = np.zeros((SHAPE[0] + module.WIDTH, SHAPE[1] + module.WIDTH, 2))
    mesh[: SHAPE[0], : SHAPE[1]] = field
    module.fill_margins(mesh)
    values = np.empty((2, len(points)))
    module.gather_window(points.T.copy(), mesh, PERIODS, values)
    return values.T


@given(st.integers(0, 2**31), st.sampled_from([1, 15, module.BLOCK, 2 * module.BLOCK + 3]))
def test_spread_is_the_sum_of_the_windows(seed, count):
    random = scenes.generator(seed)
    points, forces = random.random((count, 2)) * 40 - 20, random.standard_normal((count, 2))
    twin = np.zeros((*SHAPE, 2))
    weights = []
    for axis in (0, 1):
        # The mesh is shifted by half a window.
        lines = np.arange(SHAPE[axis]) - module.WIDTH // 2 + 1
        away = points[:, axis, None] / SPACING[axis] - lines
        away -= SHAPE[axis] * np.round(away / SHAPE[axis])
        weights.append(module.window(away))
    twin = np.einsum("si,sj,sc->ijc", *weights, forces)
    error = np.abs(spread(points, forces) - twin).max()
    assert error < 1e-6 * np.sqrt(count), f"off by {error:.1e}"


@given(st.integers(0, 2**31))
def test_spread_is_adjoint_of_gather(seed):
    random = scenes.generator(seed)
    points = random.random((15, 2)) * 40 - 20
    forces = random.standard_normal((15, 2))
    field = random.standard_normal((*SHAPE, 2))
    left = np.sum(spread(points, forces) * field)
    right = np.sum(forces * gather(points, field))
    assert left == pytest.approx(right, rel=1e-12, abs=1e-12)


@given(st.integers(0, 2**31), st.integers(-3, 3), st.integers(-3, 3))
def test_spread_is_periodic(seed, periods_x, periods_y):
    random = scenes.generator(seed)
    points, forces = random.random((8, 2)), random.standard_normal((8, 2))
    shift = np.array([periods_x, periods_y]) * PERIODS
    difference = np.abs(spread(points, forces) - spread(points + shift, forces)).max()
    assert difference < 1e-11, f"differs by {difference:.1e}"
