"""Spreading to and gathering from a coarse mesh with a compact window (Kaiser-Bessel).

Unlike the delta function of the immersed-boundary method, the window is divided out in Fourier
space, so that it leaves no trace but a small aliasing error.

A mesh here has margins instead of wrapped indices: N_x + WIDTH rows of N_y + WIDTH pairs of
components, of which the first N_x rows and N_y pairs are the period. `fold_margins` adds what was
spread beyond it to where it belongs, and `fill_margins` repeats the field there. The mesh is
shifted by WIDTH/2 - 1 lines, which spreading and gathering undo for each other.
"""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray
from scipy.special import i0

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray
from softslip.solver.mobility.least_squares import powers_fitted

LineArray = NDArray[np.int32]

WIDTH = 6
"""Mesh lines under the window in one direction; the loops below are written out for six."""

SHAPE = 2.1 * WIDTH
"""Shape parameter β of the window: the least error over the modes that the far sum has."""

DEGREE = 4
"""Degree in t² of the even and odd parts of the polynomials for the window (error 2e-7)."""

BLOCK = 128
"""Points whose weights are worked out together: their weights stay in the fastest cache."""


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
    """Return the window on its mesh lines as polynomials, shape (WIDTH // 2, 2, DEGREE + 1).

    The weight of the j-th line below a point is E_j(t²) + t O_j(t²), t in [-1, 1) being the
    point's place between two mesh lines, and that of the line opposite is E_j(t²) - t O_j(t²).
    Entry [j, 0] holds the coefficients of E_j and entry [j, 1] those of O_j, in rising powers.
    """
    t = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    parts = np.empty((WIDTH // 2, 2, DEGREE + 1))
    for line in range(WIDTH // 2):
        values = window(0.5 * (t + 1) + WIDTH // 2 - 1 - line)
        parts[line] = powers_fitted(t, values, 2 * DEGREE + 1).reshape(-1, 2).T
    return parts


_POLYNOMIALS = window_polynomials()
"""A constant to the compiled loops, which keep it in registers."""


@compiled
def window_weights(
    coordinates: FloatArray, period: float, count: int, lines: LineArray, weights: FloatArray
) -> None:
    """Fill the weights of some points in one direction and the lines where they start.

    Parameters
    ----------
    coordinates
        Positions in this direction, shape (points,) [length unit].
    period, count
        Length of the period [length unit] and mesh lines in it.
    lines
        Output, shape (points,): first line of the shifted mesh under each point's window.
    weights
        Output, shape (WIDTH, points).
    """
    inverse = 1.0 / period
    for s in range(coordinates.size):
        place = coordinates[s] * inverse
        place = (place - np.floor(place)) * count
        below = np.floor(place)
        # A point that is no number keeps its weights, which are none either, but must not
        # become an index.
        lines[s] = np.int32(below if 0.0 <= below <= count else 0.0)
        t = 2.0 * (place - below) - 1.0
        square = t * t
        for j in range(WIDTH // 2):
            even, odd = _POLYNOMIALS[j, 0, DEGREE], _POLYNOMIALS[j, 1, DEGREE]
            for power in range(DEGREE - 1, -1, -1):
                even = even * square + _POLYNOMIALS[j, 0, power]
                odd = odd * square + _POLYNOMIALS[j, 1, power]
            weights[j, s] = even + t * odd
            weights[WIDTH - 1 - j, s] = even - t * odd


@intrinsic
def _add_row(context: Any, mesh: Any, at: Any, weight: Any, row: Any) -> tuple[Any, Any]:
    """Add a weighted row of 2 WIDTH numbers to a flat mesh, four numbers at a time.

    Written for the code generator because the compiler leaves so short a loop scalar, which
    costs three times as much.
    """

    def generate(target: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target_mesh, start, factor, source = arguments
        sides = [
            target.make_array(kind)(target, builder, array).data
            for kind, array in ((signature.args[0], target_mesh), (signature.args[3], source))
        ]
        four = ir.VectorType(ir.DoubleType(), 4)
        factors = ir.Constant(four, ir.Undefined)
        for lane in range(4):
            factors = builder.insert_element(factors, factor, ir.Constant(ir.IntType(32), lane))
        for first in range(0, 2 * WIDTH, 4):
            step = ir.Constant(ir.IntType(64), first)
            places = (builder.add(start, step), step)
            here, there = (
                builder.bitcast(builder.gep(side, [place]), four.as_pointer())
                for side, place in zip(sides, places, strict=True)
            )
            # Rows start anywhere: aligned as single numbers are.
            old, new = (builder.load(side, typ=four, align=8) for side in (here, there))
            product = builder.fmul(factors, new, flags=("contract",))
            builder.store(builder.fadd(old, product, flags=("contract",)), here, align=8)
        return target.get_dummy_value()

    return types.void(mesh, at, weight, row), generate


@compiled
def spread_window(
    points: FloatArray, forces: FloatArray, periods: tuple[float, float], mesh: FloatArray
) -> None:
    """Add both components of point forces to a mesh, each weighted with the window.

    Parameters
    ----------
    points, forces
        Shape (2, points): x and y components.
    periods
        Lengths of the periods along x and y [length unit].
    mesh
        Added to, shape (N_x + WIDTH, N_y + WIDTH, 2), with margins to be folded.
    """
    nx, ny, columns = mesh.shape[0] - WIDTH, mesh.shape[1] - WIDTH, np.uint64(2 * mesh.shape[1])
    flat = mesh.reshape(-1)
    wx, wy = np.empty((WIDTH, BLOCK)), np.empty((WIDTH, BLOCK))
    ix, iy, row = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32), np.empty(2 * WIDTH)
    for first in range(0, points.shape[1], BLOCK):
        size = min(BLOCK, points.shape[1] - first)
        window_weights(points[0, first : first + size], periods[0], nx, ix, wx)
        window_weights(points[1, first : first + size], periods[1], ny, iy, wy)
        for s in range(size):
            fx, fy = forces[0, first + s], forces[1, first + s]
            for j in range(WIDTH):
                row[2 * j], row[2 * j + 1] = wy[j, s] * fx, wy[j, s] * fy
            at = np.uint64(ix[s]) * columns + np.uint64(2 * iy[s])
            for i in range(WIDTH):
                _add_row(flat, at, wx[i, s], row)  # type: ignore[call-arg]
                at += columns


@compiled
def gather_window(
    points: FloatArray, mesh: FloatArray, periods: tuple[float, float], values: FloatArray
) -> None:
    """Set the values at points to the windowed sum over the mesh: the transpose of spreading.

    Parameters
    ----------
    points
        Shape (2, points): x and y components.
    mesh
        Shape (N_x + WIDTH, N_y + WIDTH, 2), with margins filled.
    periods
        As for `spread_window`.
    values
        Output, shape (2, points).
    """
    nx, ny, columns = mesh.shape[0] - WIDTH, mesh.shape[1] - WIDTH, np.uint64(2 * mesh.shape[1])
    flat, one = mesh.reshape(-1), np.uint64(1)
    wx, wy = np.empty((WIDTH, BLOCK)), np.empty((WIDTH, BLOCK))
    ix, iy = np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    for first in range(0, points.shape[1], BLOCK):
        size = min(BLOCK, points.shape[1] - first)
        window_weights(points[0, first : first + size], periods[0], nx, ix, wx)
        window_weights(points[1, first : first + size], periods[1], ny, iy, wy)
        for s in range(size):
            start = np.uint64(ix[s]) * columns + np.uint64(2 * iy[s])
            value_x, value_y = 0.0, 0.0
            w0, w1, w2, w3, w4, w5 = wx[0, s], wx[1, s], wx[2, s], wx[3, s], wx[4, s], wx[5, s]
            for j in range(WIDTH):
                at = start
                x, y = w0 * flat[at], w0 * flat[at + one]
                at += columns
                x, y = x + w1 * flat[at], y + w1 * flat[at + one]
                at += columns
                x, y = x + w2 * flat[at], y + w2 * flat[at + one]
                at += columns
                x, y = x + w3 * flat[at], y + w3 * flat[at + one]
                at += columns
                x, y = x + w4 * flat[at], y + w4 * flat[at + one]
                at += columns
                x, y = x + w5 * flat[at], y + w5 * flat[at + one]
                value_x += wy[j, s] * x
                value_y += wy[j, s] * y
                start += np.uint64(2)
            values[0, first + s] = value_x
            values[1, first + s] = value_y


@compiled
def fold_margins(mesh: FloatArray) -> None:
    """Add the margins of a mesh, shape (N_x + WIDTH, N_y + WIDTH, 2), to the period."""
    nx, ny = mesh.shape[0] - WIDTH, mesh.shape[1] - WIDTH
    for i in range(nx + WIDTH):
        for j in range(WIDTH):
            for c in range(2):
                mesh[i, j % ny, c] += mesh[i, ny + j, c]
    for i in range(WIDTH):
        for j in range(ny):
            for c in range(2):
                mesh[i % nx, j, c] += mesh[nx + i, j, c]


@compiled
def fill_margins(mesh: FloatArray) -> None:
    """Repeat the period of a mesh, shape (N_x + WIDTH, N_y + WIDTH, 2), in its margins."""
    nx, ny = mesh.shape[0] - WIDTH, mesh.shape[1] - WIDTH
    for i in range(WIDTH):
        for j in range(ny):
            for c in range(2):
                mesh[nx + i, j, c] = mesh[i % nx, j, c]
    for i in range(nx + WIDTH):
        for j in range(WIDTH):
            for c in range(2):
                mesh[i, ny + j, c] = mesh[i, j % ny, c]
