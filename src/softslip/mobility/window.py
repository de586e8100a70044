"""Spreading to and gathering from a coarse mesh with a compact window (Kaiser-Bessel).

Unlike the delta function of the immersed-boundary method, the window is divided out in Fourier
space, so that it leaves no trace but a small aliasing error.
"""

import math

import numpy as np
from scipy.special import i0

from softslip.geometry import FloatArray, IntArray
from softslip.kernels import compiled

WIDTH = 6
"""Mesh lines under the window in one direction."""

SHAPE = 2.3 * WIDTH
"""Shape parameter β of the window: the usual choice for modes up to half the mesh's highest."""

DEGREE = 11
"""Degree of the polynomials that stand for the window between two mesh lines (error 1e-9)."""


def window(distance: FloatArray) -> FloatArray:
    """Return I₀(β √(1 - z²))/I₀(β), z the distance over half the width; distance in mesh sizes."""
    z = 2 * distance / WIDTH
    values: FloatArray = i0(SHAPE * np.sqrt(np.clip(1 - z**2, 0, None))) / i0(SHAPE)
    return np.where(np.abs(z) <= 1, values, 0.0)


def window_transform(wavenumbers: FloatArray, spacing: float) -> FloatArray:
    """Return the window's Fourier transform on a mesh of this spacing [length unit].

    Valid within the main lobe, |k| < 2β/(width × spacing), which holds for all modes of a mesh.
    """
    half = 0.5 * WIDTH * spacing
    root = np.sqrt(SHAPE**2 - (wavenumbers * half) ** 2)
    transform: FloatArray = 2 * half * np.sinh(root) / root / i0(SHAPE)
    return transform


def window_polynomials() -> FloatArray:
    """Return the window on each of its mesh lines as a polynomial, shape (DEGREE + 1, WIDTH).

    Column j is the weight of the j-th line below a point as a function of t in [-1, 1), the
    point's place between two mesh lines; coefficients rise in powers of t.
    """
    t = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    columns = []
    for line in range(WIDTH):
        values = window(0.5 * (t + 1) + WIDTH // 2 - 1 - line)
        columns.append(np.polynomial.Polynomial.fit(t, values, DEGREE, domain=(-1, 1)).coef)
    return np.column_stack(columns)


@compiled
def window_weights(coordinate: float, polynomials: FloatArray, weights: FloatArray) -> int:
    """Fill the weights of a point and return the first mesh line they belong to.

    Parameters
    ----------
    coordinate
        Position in units of the mesh size.
    polynomials
        From `window_polynomials`.
    weights
        Output, shape (WIDTH,).
    """
    below = math.floor(coordinate)
    t = 2.0 * (coordinate - below) - 1.0
    for j in range(WIDTH):
        weights[j] = polynomials[DEGREE, j]
    for power in range(DEGREE - 1, -1, -1):
        for j in range(WIDTH):
            weights[j] = weights[j] * t + polynomials[power, j]
    return int(below) - WIDTH // 2 + 1


@compiled
def _wrapped(first: int, count: int, lines: IntArray) -> None:
    line = first % count
    for j in range(WIDTH):
        lines[j] = line
        line = line + 1 if line + 1 < count else 0


@compiled
def spread_window(
    positions: FloatArray,
    forces: FloatArray,
    spacing: tuple[float, float],
    polynomials: FloatArray,
    mesh: FloatArray,
) -> None:
    """Add both components of point forces to a mesh, each weighted with the window.

    Parameters
    ----------
    positions, forces
        Shape (nodes, 2).
    spacing
        Mesh sizes along x and y [length unit].
    polynomials
        From `window_polynomials`.
    mesh
        Added to, shape (2, N_x, N_y), periodic.
    """
    wx, wy = np.empty(WIDTH), np.empty(WIDTH)
    ix, iy = np.empty(WIDTH, np.int64), np.empty(WIDTH, np.int64)
    for s in range(positions.shape[0]):
        _wrapped(window_weights(positions[s, 0] / spacing[0], polynomials, wx), mesh.shape[1], ix)
        _wrapped(window_weights(positions[s, 1] / spacing[1], polynomials, wy), mesh.shape[2], iy)
        for i in range(WIDTH):
            force_x, force_y = forces[s, 0] * wx[i], forces[s, 1] * wx[i]
            for j in range(WIDTH):
                mesh[0, ix[i], iy[j]] += force_x * wy[j]
                mesh[1, ix[i], iy[j]] += force_y * wy[j]


@compiled
def gather_window(
    positions: FloatArray,
    mesh: FloatArray,
    spacing: tuple[float, float],
    polynomials: FloatArray,
    values: FloatArray,
) -> None:
    """Set the values at points to the windowed sum over the mesh: the transpose of spreading.

    Parameters
    ----------
    positions
        Shape (points, 2).
    mesh
        Shape (2, N_x, N_y), periodic.
    spacing, polynomials
        As for `spread_window`.
    values
        Output, shape (points, 2).
    """
    wx, wy = np.empty(WIDTH), np.empty(WIDTH)
    ix, iy = np.empty(WIDTH, np.int64), np.empty(WIDTH, np.int64)
    for s in range(positions.shape[0]):
        _wrapped(window_weights(positions[s, 0] / spacing[0], polynomials, wx), mesh.shape[1], ix)
        _wrapped(window_weights(positions[s, 1] / spacing[1], polynomials, wy), mesh.shape[2], iy)
        value_x, value_y = 0.0, 0.0
        for i in range(WIDTH):
            row_x, row_y = 0.0, 0.0
            for j in range(WIDTH):
                row_x += wy[j] * mesh[0, ix[i], iy[j]]
                row_y += wy[j] * mesh[1, ix[i], iy[j]]
            value_x += wx[i] * row_x
            value_y += wx[i] * row_y
        values[s, 0] = value_x
        values[s, 1] = value_y
