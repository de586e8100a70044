"""The longest modes of a membrane, between which its response is inverted exactly."""

import math

import numpy as np

from softslip.solver.chains import PADDING
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray
from softslip.solver.membrane_strain import take_transpose, wrap

LONG_MODES = 12
"""Modes of a membrane whose curvature is treated exactly: shapes in dense packings have corners,
whose κ² is up to four times the mean one, as much as D̂² of mode 2 and 1/40 of that of mode 13.
What is left of the next mode costs stages: the radius of P_g J is 49 with 8 modes, 31 with 12."""


def long_waves(count: int) -> FloatArray:
    """Return the unit cosines and sines of the longest modes of a number of nodes.

    Shape (2 modes, count), with fewer than `LONG_MODES` modes where the nodes have no more.
    """
    angle = 2 * np.pi * np.arange(count) / count
    waves = np.empty((2 * min(LONG_MODES, (count - 1) // 2), count))
    for mode in range(len(waves) // 2):
        phase = (mode + 1) * angle
        waves[2 * mode : 2 * mode + 2] = math.sqrt(2.0 / count) * np.stack(
            (np.cos(phase), np.sin(phase))
        )
    return waves


@compiled
def fill_rows(
    tx: FloatArray,
    ty: FloatArray,
    waves: FloatArray,
    weights: tuple[float, float, float],
    modes: int,
    count: int,
    x: FloatArray,
    y: FloatArray,
    rows: FloatArray,
) -> None:
    """Fill Bᵀ u for the waves u of the longest modes, its x and then its y."""
    for k in range(2 * modes):
        for s in range(count):
            x[s + PADDING] = waves[k, s] * tx[s]
            y[s + PADDING] = waves[k, s] * ty[s]
        wrap(x, count)
        wrap(y, count)
        rows[k, : 2 * count] = 0.0
        take_transpose(x, weights, -1.0, count, rows[k, :count])
        take_transpose(y, weights, -1.0, count, rows[k, count:])


@compiled
def invert(block: FloatArray, size: int) -> None:
    """Invert a positive definite matrix, of which the lower triangle is given, in place."""
    for j in range(size):
        for i in range(j, size):
            total = block[i, j]
            for k in range(j):
                total -= block[i, k] * block[j, k]
            block[i, j] = np.sqrt(total) if i == j else total / block[j, j]
    for j in range(size):
        block[j, j] = 1.0 / block[j, j]
        for i in range(j + 1, size):
            total = 0.0
            for k in range(j, i):
                total -= block[i, k] * block[k, j]
            block[i, j] = total / block[i, i]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, size):
                total += block[k, i] * block[k, j]
            block[j, i] = total
    for i in range(size):
        for j in range(i):
            block[i, j] = block[j, i]


@compiled
def add_longest(
    strain: FloatArray,
    inverse: FloatArray,
    waves: FloatArray,
    size: int,
    count: int,
    answer: FloatArray,
) -> None:
    """Add the part of the longest modes: the inverse between their waves.

    Four waves at a time, so that what they share is loaded once. Waves and inverse are zero beyond
    the modes that a membrane has.
    """
    amount = np.empty(2 * LONG_MODES)
    for k in range(0, size, 4):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for s in range(count):
            a += strain[s] * waves[k, s]
            b += strain[s] * waves[k + 1, s]
            c += strain[s] * waves[k + 2, s]
            d += strain[s] * waves[k + 3, s]
        amount[k], amount[k + 1], amount[k + 2], amount[k + 3] = a, b, c, d
    for k in range(0, size, 4):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(size):
            a += inverse[k, j] * amount[j]
            b += inverse[k + 1, j] * amount[j]
            c += inverse[k + 2, j] * amount[j]
            d += inverse[k + 3, j] * amount[j]
        for s in range(count):
            answer[s] += (a * waves[k, s] + b * waves[k + 1, s]) + (
                c * waves[k + 2, s] + d * waves[k + 3, s]
            )
