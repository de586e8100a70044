"""The near part of the Ewald sum: what nodes closer than a reach add to each other's velocity.

`solver.mobility.blob` has the functions of the distance; here they are worked out for eight pairs
of nodes at once, and applied to the forces of both.
"""

import math

import numpy as np
from scipy.special import exp1

from softslip.solver.clusters import SIZE, Slots
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray
from softslip.solver.lanes import (
    Lanes,
    add_four,
    add_two,
    below,
    eight,
    equal,
    exponent_of,
    four_twice,
    how_many,
    mantissa_of,
    multiply_add,
    nearest_integer,
    two_by_four,
    where,
)
from softslip.solver.mobility.blob import DEGREE, Blob
from softslip.solver.mobility.least_squares import least_squares, powers_fitted

DECAYED = 14.0
"""c = r²/4ε² from which on E₁(c) and e^{-c} count as zero (6e-8)."""

_POWERS = DEGREE + 2
_LOG_DEGREE, _CLOSE_DEGREE = 7, 14


def _logarithm() -> FloatArray:
    """Return the polynomial for -¼ ln m, 1 <= m < 2, and the part of an exponent (error 5e-8).

    It meets the ends exactly, so that there are no steps between exponents.
    """
    t = 1.5 + 0.5 * np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    ends = (t - 1) * (2 - t)
    inner = ends[:, None] * np.vander(t, _LOG_DEGREE - 1, increasing=True)
    coefficients = least_squares(inner, np.log(t) - math.log(2) * (t - 1))
    whole = np.zeros(_LOG_DEGREE + 2)
    for power, factor in enumerate((-2, 3, -1)):
        whole[power : power + _LOG_DEGREE - 1] += factor * coefficients
    whole[:2] += math.log(2) * np.array([-1, 1])
    whole[-1] = math.log(2)
    return -0.25 * whole


def _close() -> FloatArray:
    """Return polynomials in 2c/c₀ - 1 for two functions up to c₀ = `DECAYED` (error 1e-7).

    They are Ein(c) + 1 - G(c), Ein(c) = ln c + γ + E₁(c), and (1 - G(c))/c.
    """
    t = np.cos(np.pi * (np.arange(64) + 0.5) / 64)
    c = 0.5 * DECAYED * (t + 1)
    g = -np.expm1(-c) / c
    functions = np.log(c) + np.euler_gamma + exp1(c) + 1 - g, (1 - g) / c
    return np.stack([powers_fitted(t, values, _CLOSE_DEGREE) for values in functions])


_LOGARITHM, _CLOSE = _logarithm(), _close()
"""Constants to the compiled loops."""


def near_series(blob: Blob) -> FloatArray:
    """Return what the near functions of a blob take, in a row: see `_far_apart` and `_close_by`."""
    p, q = blob.polynomials()
    own = 0.25 - 0.5 * math.log(2 * blob.ratio) + 0.25 * float(np.euler_gamma)
    return np.concatenate((p, q, [blob.ratio**2, own]))


@compiled
def _sum_of(series: FloatArray, first: int, count: int, x: Lanes) -> Lanes:
    """Return the polynomial whose coefficients stand in a place of a row, in rising powers."""
    at, left = np.uint64(first + count - 1), count - 1
    value = equal(series[at])
    while left > 0:
        at -= np.uint64(1)
        left -= 1
        value = multiply_add(x, value, series[at])
    return value


@compiled
def _logarithmic(x: Lanes) -> Lanes:
    """Return -¼ ln x of positive numbers."""
    m = mantissa_of(x)
    square = m * m
    low = multiply_add(
        square,
        multiply_add(m, _LOGARITHM[3], _LOGARITHM[2]),
        multiply_add(m, _LOGARITHM[1], _LOGARITHM[0]),
    )
    high = multiply_add(
        square,
        multiply_add(m, _LOGARITHM[7], _LOGARITHM[6]),
        multiply_add(m, _LOGARITHM[5], _LOGARITHM[4]),
    )
    mantissa = multiply_add(square * square, high, low)
    return multiply_add(exponent_of(x), _LOGARITHM[8], mantissa)


@compiled
def _far_apart(x: Lanes, series: FloatArray) -> tuple[Lanes, Lanes]:
    """Return T_t and (T_r - T_t)/x where the regularised force is all within r."""
    squared_ratio = series[2 * _POWERS]
    inverse = 1.0 / x
    own = inverse * squared_ratio
    tangential = _sum_of(series, 0, _POWERS, x) + (_logarithmic(x) + own)
    excess = inverse * multiply_add(own, -2.0, _sum_of(series, _POWERS, _POWERS, x))
    return tangential, excess


@compiled
def _close_by(x: Lanes, series: FloatArray) -> tuple[Lanes, Lanes]:
    """Return the same where c < `DECAYED`, with 1/x and ln x taken out."""
    per_c = 0.25 / series[2 * _POWERS]
    t = multiply_add(x, 2.0 / DECAYED * per_c, -1.0)
    logarithmic = _sum_of(_CLOSE[0], 0, _CLOSE_DEGREE + 1, t)
    fraction = _sum_of(_CLOSE[1], 0, _CLOSE_DEGREE + 1, t)
    tangential = multiply_add(
        logarithmic, -0.25, _sum_of(series, 0, _POWERS, x) + series[2 * _POWERS + 1]
    )
    # q(0) = ½ is what G(0) takes away.
    excess = multiply_add(fraction, 0.5 * per_c, _sum_of(series, _POWERS + 1, _POWERS - 1, x))
    return tangential, excess


@compiled
def _limits(series: FloatArray) -> FloatArray:
    """Return the x below which pairs count, and count as close, for two vectors each, (2, 32).

    Of a cluster with itself, in the second row, only later nodes are partners.
    """
    limits = np.zeros((2, 2 * SIZE * SIZE))
    for i in range(SIZE):
        for j in range(SIZE):
            for same in range(2):
                if j > i or not same:
                    limits[same, SIZE * i + j] = 1.0
                    limits[same, SIZE * (SIZE + i) + j] = 4.0 * DECAYED * series[2 * _POWERS]
    return limits


@compiled
def _add_pairs(
    clusters: tuple[int, int],
    points: FloatArray,
    forces: FloatArray,
    starts: IntArray,
    partners: IndexArray,
    length: float,
    series: FloatArray,
    velocities: FloatArray,
) -> int:
    """Add the near velocities of pairs of clusters, over 1/(2πη); return the number of pairs.

    Pairs of nodes beyond the reach add exactly nothing, and all sums run in the order of the
    clusters, so that they do not depend on the age of the list.

    Parameters
    ----------
    clusters
        First cluster whose partners are wanted, and the one after the last.
    points, forces
        In slots of `solver.clusters`, shape (2, slots): points over the reach, x periodic with
        ``length``.
    starts, partners
        Pairs of clusters, complete within the reach.
    length
        Period over the reach.
    series
        From `near_series`.
    velocities
        Added to, shape (2, slots).
    """
    x, y, fx, fy = points[0], points[1], forces[0], forces[1]
    ux, uy = velocities[0], velocities[1]
    limits, per_length, pairs = _limits(series).reshape(-1), 1.0 / length, 0
    two, size = np.uint64(2), np.uint64(SIZE)
    for cluster in range(clusters[0], clusters[1]):
        begin, end = starts[cluster], starts[cluster + 1]
        if begin == end:
            continue
        # Two of its nodes a vector, each with the four of a partner.
        i = np.uint64(cluster) * size
        x1, y1, x2, y2 = (
            two_by_four(x, i),
            two_by_four(y, i),
            two_by_four(x, i + two),
            two_by_four(y, i + two),
        )
        fx1, fy1, fx2, fy2 = (
            two_by_four(fx, i),
            two_by_four(fy, i),
            two_by_four(fx, i + two),
            two_by_four(fy, i + two),
        )
        ux1, uy1, ux2, uy2 = equal(0.0), equal(0.0), equal(0.0), equal(0.0)
        for k in range(begin, end):
            j = np.uint64(partners[np.uint64(k)]) * size
            at = np.uint64(32 * (j == i))
            xj, yj, gx, gy = (
                four_twice(x, j),
                four_twice(y, j),
                four_twice(fx, j),
                four_twice(fy, j),
            )
            dx1, dy1 = xj - x1, yj - y1
            dx2, dy2 = xj - x2, yj - y2
            dx1 = multiply_add(nearest_integer(dx1 * per_length), -length, dx1)
            dx2 = multiply_add(nearest_integer(dx2 * per_length), -length, dx2)
            square1 = multiply_add(dx1, dx1, dy1 * dy1)
            square2 = multiply_add(dx2, dx2, dy2 * dy2)
            t1, e1 = _far_apart(square1, series)
            t2, e2 = _far_apart(square2, series)
            close1 = below(square1, eight(limits, at + np.uint64(16)))
            close2 = below(square2, eight(limits, at + np.uint64(24)))
            if how_many(close1) + how_many(close2) > 0:
                t3, e3 = _close_by(square1, series)
                t4, e4 = _close_by(square2, series)
                t1, e1 = where(close1, t3, t1), where(close1, e3, e1)
                t2, e2 = where(close2, t4, t2), where(close2, e4, e2)
            counts1 = below(square1, eight(limits, at))
            counts2 = below(square2, eight(limits, at + np.uint64(8)))
            t1, e1 = where(counts1, t1, 0.0), where(counts1, e1, 0.0)
            t2, e2 = where(counts2, t2, 0.0), where(counts2, e2, 0.0)
            pairs += how_many(counts1) + how_many(counts2)
            there1 = e1 * multiply_add(gx, dx1, gy * dy1)
            there2 = e2 * multiply_add(gx, dx2, gy * dy2)
            ux1 = multiply_add(there1, dx1, multiply_add(t1, gx, ux1))
            uy1 = multiply_add(there1, dy1, multiply_add(t1, gy, uy1))
            ux2 = multiply_add(there2, dx2, multiply_add(t2, gx, ux2))
            uy2 = multiply_add(there2, dy2, multiply_add(t2, gy, uy2))
            back1 = e1 * multiply_add(fx1, dx1, fy1 * dy1)
            back2 = e2 * multiply_add(fx2, dx2, fy2 * dy2)
            vx = multiply_add(back1, dx1, t1 * fx1) + multiply_add(back2, dx2, t2 * fx2)
            vy = multiply_add(back1, dy1, t1 * fy1) + multiply_add(back2, dy2, t2 * fy2)
            add_four(ux, j, vx)
            add_four(uy, j, vy)
        add_two(ux, i, ux1)
        add_two(uy, i, uy1)
        add_two(ux, i + two, ux2)
        add_two(uy, i + two, uy2)
    return pairs


class NearSum:
    """Near velocities of nodes in clusters.

    Parameters
    ----------
    blob
        Whose near part acts.
    slots
        Of the nodes.
    length
        Period over the reach.
    """

    def __init__(self, blob: Blob, slots: Slots, length: float) -> None:
        self._slots, self._length = slots, length
        self._series, self._own = near_series(blob), blob.on_itself()
        self._listed: tuple[IntArray, IntArray] | None = None
        self._clusters = np.zeros(1, np.int64), np.empty(0, np.uint32)

    def fill(
        self,
        points: FloatArray,
        forces: FloatArray,
        listed: tuple[IntArray, IntArray],
        velocities: FloatArray,
    ) -> int:
        """Set the near velocities, over 1/(2πη), and return the number of pairs within the reach.

        Parameters
        ----------
        points, forces, velocities
            In slots, shape (2, slots); points over the reach.
        listed
            Pairs of nodes of `solver.neighbours.find_pairs`, complete within the reach.
        """
        if listed is not self._listed:
            self._listed, self._clusters = listed, self._slots.pairs(*listed)
        np.multiply(forces, self._own, out=velocities)
        every = 0, self._slots.clusters
        return _add_pairs(
            every, points, forces, *self._clusters, self._length, self._series, velocities
        )
