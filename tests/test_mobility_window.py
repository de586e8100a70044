import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from softslip.mobility import window as module

SPACING = (0.31, 0.17)
SHAPE = (20, 27)


@given(st.floats(-40, 40))
def test_weights_are_the_window_at_every_place(coordinate):
    weights = np.empty(module.WIDTH)
    first = module.window_weights(coordinate, module.window_polynomials(), weights)
    exact = module.window(coordinate - first - np.arange(module.WIDTH))
    error = np.abs(weights - exact).max()
    assert error < 1e-8, f"the polynomials are off by {error:.1e}"


@given(st.floats(-40, 40))
def test_no_line_under_the_window_is_left_out(coordinate):
    first = module.window_weights(coordinate, module.window_polynomials(), np.empty(module.WIDTH))
    outside = np.array([first - 1, first + module.WIDTH]) - coordinate
    edge = module.window(np.array([module.WIDTH / 2]))[0]
    assert module.window(outside).max() <= edge


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


@given(st.integers(0, 2**31))
def test_spread_is_adjoint_of_gather(seed):
    random = scenes.generator(seed)
    points = random.random((15, 2)) * 40 - 20
    forces = random.standard_normal((15, 2))
    field = random.standard_normal((2, *SHAPE))
    polynomials = module.window_polynomials()
    mesh, values = np.zeros((2, *SHAPE)), np.empty((15, 2))
    module.spread_window(points, forces, SPACING, polynomials, mesh)
    module.gather_window(points, field, SPACING, polynomials, values)
    left, right = np.sum(mesh * field), np.sum(forces * values)
    assert left == pytest.approx(right, rel=1e-12, abs=1e-12)


@given(st.integers(0, 2**31), st.integers(-3, 3), st.integers(-3, 3))
def test_spread_is_periodic(seed, periods_x, periods_y):
    random = scenes.generator(seed)
    points, forces = random.random((8, 2)), random.standard_normal((8, 2))
    shift = np.array([periods_x, periods_y]) * np.array(SHAPE) * np.array(SPACING)
    polynomials = module.window_polynomials()
    here, there = np.zeros((2, *SHAPE)), np.zeros((2, *SHAPE))
    module.spread_window(points, forces, SPACING, polynomials, here)
    module.spread_window(points + shift, forces, SPACING, polynomials, there)
    assert np.abs(here - there).max() < 1e-11
