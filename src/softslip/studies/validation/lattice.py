"""Drag on a square array of cylinders in Stokes flow, by biharmonic functions in a unit cell.

A cylinder of radius a stands at the centre of a square of side 1; the superficial velocity is U
along x. By the symmetries of the array (Sangani & Acrivos 1982) the streamfunction is

    ψ = Σ_{m odd} [A r^m + B r^{m+2} + C r^{-m} + D r^{2-m}] sin mθ,

with r ln r for r^{2-m} at m = 1, where ψ = ∂ψ/∂r = 0 at r = a leaves two of four coefficients. On
the upper side of the cell ψ = U/2 and ∇²ψ = 0, on the right-hand side ∂ψ/∂x = 0 and ∂∇²ψ/∂x = 0.
Least squares at points of both sides determine the rest, and the drag is F = 4πη D₁.
"""

import math
from functools import cache

import numpy as np
from scipy.linalg import lstsq

from softslip.solver.geometry import FloatArray, IntArray

CORNER = math.sqrt(0.5)
"""Distance of the cell's corners from its centre, where the functions that grow are one."""

NEGLIGIBLE = 1e-6
"""What the last functions may still add to the flow in the corners."""

SLOWEST = 0.95
"""Largest rate at which terms are taken to fall: closer cylinders get no more of them."""


@cache
def array_drag(concentration: float, terms: int | None = None) -> float:
    """Return the drag F/(ηU) per length of a cylinder in a square array.

    Parameters
    ----------
    concentration
        Area fraction c of the cylinders, 0 < c < π/4.
    terms
        Number of values of m; chosen from c where not given.
    """
    radius = math.sqrt(concentration / math.pi)
    orders = 2 * np.arange(terms or _terms(radius)) + 1
    along = (np.arange(2 * len(orders)) + 0.5) / (4 * len(orders))
    half = np.full_like(along, 0.5)
    stream, _, vorticity, _ = _functions(along, half, orders, radius)
    _, across, _, bend = _functions(half, along, orders, radius)
    rows = np.concatenate((stream, vorticity, across, bend))
    wanted = np.zeros(len(rows))
    wanted[: len(along)] = 0.5
    # Functions that are alike in the cell leave the others' part of the drag alone.
    found = lstsq(rows, wanted, cond=1e-15, lapack_driver="gelsy")[0]
    return float(4 * math.pi * found[0])


def _terms(radius: float) -> int:
    """Return how many m it takes until the flow in the corners of the cell is there.

    The flow continues into the neighbouring cylinders up to the limit of the successive images of
    one in another, at x from their centres with x (1 - x) = a²: terms fall as (corner/(1 - x))^m.
    """
    nearest = 0.5 + 0.5 * math.sqrt(max(1 - 4 * radius**2, 0.0))
    rate = min(CORNER / nearest, SLOWEST)
    return math.ceil(0.5 * math.log(NEGLIGIBLE) / math.log(rate))


def _functions(
    x: FloatArray, y: FloatArray, orders: IntArray, radius: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return ψ, ∂ψ/∂x, ∇²ψ and ∂∇²ψ/∂x of all functions at points, each (points, functions).

    None slips at r = a. The first is that of the drag, r ln(r/a) - r/2 + a²/2r with D₁ = 1; the
    others grow as r³ and, for each m > 1, as r^m and r^{m+2}.
    """
    r, angle = np.hypot(x, y)[:, None], np.arctan2(y, x)[:, None]
    log = np.log(r / radius)
    drag = (
        r * log - 0.5 * r + 0.5 * radius**2 / r,
        log + 0.5 - 0.5 * (radius / r) ** 2,
        2 / r,
        -2 / r**2,
    )
    m = np.concatenate(([1], np.repeat(orders[1:], 2)))
    growth = m + np.concatenate(([2], np.tile([0, 2], len(orders) - 1)))
    profiles = zip(drag, _growing(r, m, growth, radius), strict=True)
    value, slope, lap, bend = (np.concatenate(pair, axis=1) for pair in profiles)
    m = np.concatenate(([1], m))
    sine, turn = np.sin(m * angle), m * np.cos(m * angle) * np.sin(angle) / r
    return (
        value * sine,
        slope * sine * np.cos(angle) - value * turn,
        lap * sine,
        bend * sine * np.cos(angle) - lap * turn,
    )


def _growing(
    r: FloatArray, m: IntArray, growth: IntArray, radius: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return f, f', the radial part g of ∇²(f sin mθ), and g', each (points, functions).

    f = r^n + a^n [(½(n + m) - 1) (a/r)^m - ½(n + m) (a/r)^{m-2}], over the corner's r^n.
    """
    scale, half = CORNER ** -growth.astype(np.float64), 0.5 * (growth + m)
    own = scale * radius**growth
    terms = (
        (growth, scale * r**growth),
        (-m, own * (half - 1) * (radius / r) ** m),
        (2 - m, -own * half * (radius / r) ** (m - 2)),
    )
    value, slope, lap, bend = (np.zeros_like(r * half) for _ in range(4))
    for power, part in terms:
        curved = (power**2 - m**2) * part / r**2
        value += part
        slope += power * part / r
        lap += curved
        bend += (power - 2) * curved / r
    return value, slope, lap, bend
