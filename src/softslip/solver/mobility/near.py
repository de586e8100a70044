"""The near part of the Ewald sum: what nodes closer than a reach add to each other's velocity.

A point force is replaced by a blob of force of radius R, the reach, whose transform is

    far(k) = ŵ(k) [1 + (w₂ - ε²) k²],    ŵ(k) = g(√(β² - k²R²))/g(β) = 1 - w₂k² + …,
    g(z) = (z cosh z - sinh z)/z³,

a Kaiser-Bessel function in the plane: in space w ~ sinh(β u), u = √(1 - r²/R²), and nothing beyond
R. The bracket gives the blob the second moment of the regularised force, and so near = e^{-ε²k²}
- far = O(k⁴). As the flow of a force obeys the biharmonic equation where there is none, both then
cause the same flow beyond R, exactly: the near sum ends at R by itself, where that of the usual
Gaussian blob has to be cut off.

A force f at distance r causes the near velocity T_t f + (T_r - T_t)(f·r̂) r̂, with

    2πη T_r = A₁,    2πη T_t = A₀ - A₁,
    A₀ = ∫ near(k) J₀(kr) dk/k = ∫_r^∞ (Q_ε - Q) dr'/r',    A₁ = r⁻² ∫_0^r A₀ r' dr',

Q_ε and Q being the shares of the regularised force and of the blob within r. Both integrals are
elementary but for E₁ and for one smooth function of u, which is expanded in Chebyshev polynomials.
"""

import math

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.special import exp1, ive

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, IntArray

MESH_REACH = 10.0
"""Highest wavenumber of the far mesh times the reach: beyond it the blob has no modes to speak of.

Fewer lines or a shorter reach leave more out: the error of the sums falls by e for each unit.
"""

BLOB_SHAPE = 8.7
"""Shape parameter β of the blob: 0.87 of `MESH_REACH`, where the error is least."""

CELL_BITS = 5
"""Leading bits of the mantissa of r² that number the cells of the near table within an octave."""

FIRST_CELL = 0.125
"""First cell of the near table in units of ε²: within it the functions are nearly constant."""

BATCH = 8
"""Nodes whose pairs are worked out together: their scratch arrays stay in the fastest cache."""

_SHIFT = 52 - CELL_BITS
_TERMS = 40


def _blob_norm() -> float:
    return math.cosh(BLOB_SHAPE) - math.sinh(BLOB_SHAPE) / BLOB_SHAPE


def blob_moment(reach: float) -> float:
    """Return w₂, the second-order coefficient of ŵ(k) = 1 - w₂k² + … [length unit squared]."""
    ratio = float(ive(2.5, BLOB_SHAPE) / ive(1.5, BLOB_SHAPE))
    return reach**2 * ratio / (2 * BLOB_SHAPE)


def far_factor(wavenumbers: FloatArray, regularisation: float, reach: float) -> FloatArray:
    """Return far(k), the transform of the blob that stands for a regularised point force.

    Parameters
    ----------
    wavenumbers
        k [1 / length unit].
    regularisation, reach
        ε and R [length unit].
    """
    root = np.sqrt(BLOB_SHAPE**2 - (wavenumbers * reach) ** 2 + 0j)
    root = np.where(np.abs(root) < 1e-3, 1e-3, root)  # g is flat there: 1e-7 off.
    plain = np.real((root * np.cosh(root) - np.sinh(root)) / root**3)
    bracket = 1 + (blob_moment(reach) - regularisation**2) * wavenumbers**2
    factor: FloatArray = plain * BLOB_SHAPE**2 / _blob_norm() * bracket
    return factor


def _blob_series(regularisation: float, reach: float) -> tuple[Chebyshev, Chebyshev]:
    """Return S and M of u: A₀ = -½ ln x + S and A₁ = ¼ (1 - ln x) + M of the blob, x = r²/R².

    The share of the blob beyond r is 1 - Q = (h(u) - b x cosh(βu)/u)/N, h = u cosh βu - sinh(βu)/β
    and N = h(1); S and M follow by integrating it over x once and twice.
    """
    beta, norm = BLOB_SHAPE, _blob_norm()
    bracket = (blob_moment(reach) - regularisation**2) * (beta / reach) ** 2
    u = 0.5 - 0.5 * np.cos(np.pi * (np.arange(_TERMS) + 0.5) / _TERMS)
    h = u * np.cosh(beta * u) - np.sinh(beta * u) / beta
    slope = _expanded(u, (h / norm - 1) * u / (1 - u**2))
    edge = _expanded(u, bracket * np.sinh(beta * u) / (beta * norm))
    series = slope.integ(lbnd=0.0) - edge
    moment = (series * Chebyshev([0.5, 0.5], domain=(0, 1))).integ(lbnd=1.0)
    return series, _expanded(u, -moment(u) / (1 - u**2))


def _expanded(u: FloatArray, values: FloatArray) -> Chebyshev:
    """Return the Chebyshev series on 0..1 through the values at the Chebyshev points u."""
    return Chebyshev.fit(u, values, u.size - 1, domain=(0.0, 1.0))


def near_profiles(
    distance: FloatArray, regularisation: float, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Return 2πη T_t and 2πη (T_r - T_t) at distances above zero and up to the reach.

    Parameters
    ----------
    distance
        0 < r <= R [length unit].
    regularisation, reach
        ε and R [length unit].
    """
    series, mean = _blob_series(regularisation, reach)
    x = (distance / reach) ** 2
    u, log = np.sqrt(1 - x), np.log(x)
    c = (0.5 * distance / regularisation) ** 2
    own = exp1(c)
    a0 = -0.5 * (log + own) + series(u)
    a1 = 0.25 * (1 - log - own) + mean(u) + 0.25 * np.expm1(-c) / c
    return a0 - a1, 2 * a1 - a0


def near_on_itself(regularisation: float, reach: float) -> float:
    """Return 2πη T_t = 2πη T_r at zero distance: half of A₀ there, which is its own mean."""
    series, _ = _blob_series(regularisation, reach)
    log = 2 * math.log(2 * regularisation / reach) - float(np.euler_gamma)
    return 0.5 * (-0.5 * log + float(series(1.0)))


def _cell_of(squared: float) -> int:
    return int(np.array([squared]).view(np.int64)[0]) >> _SHIFT


def near_table(regularisation: float, reach: float) -> tuple[FloatArray, int]:
    """Return the near table, shape (cells, 6), and the number that its first cell has.

    The cells are those of the floating-point numbers r² themselves, 2^CELL_BITS to an octave, so
    that ε is resolved whatever the reach; the first cell goes down to zero. Each holds the
    coefficients, in rising powers of r², of the parabolas for 2πη T_t and 2πη (T_r - T_t)/r²
    through three Chebyshev points. The errors are below 2e-6, but for 3e-5 in the last cell, where
    the blob ends in a corner: less than what the far mesh leaves out.
    """
    first = _cell_of(FIRST_CELL * regularisation**2)
    numbers = np.arange(first, _cell_of(reach**2) + 1)
    low, high = ((numbers + step << _SHIFT).view(np.float64) for step in (0, 1))
    low[0], high[-1] = 0.0, reach**2
    nodes = np.cos(np.pi * np.array([1, 3, 5]) / 6)
    squared = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * nodes
    tangential, excess = near_profiles(np.sqrt(squared), regularisation, reach)
    table = [_parabolas(squared, values) for values in (tangential, excess / squared)]
    return np.ascontiguousarray(np.concatenate(table, axis=1)), first


def _parabolas(x: FloatArray, values: FloatArray) -> FloatArray:
    """Return the coefficients in rising powers of parabolas through three points a row."""
    first = (values[:, 1] - values[:, 0]) / (x[:, 1] - x[:, 0])
    last = (values[:, 2] - values[:, 1]) / (x[:, 2] - x[:, 1])
    c2 = (last - first) / (x[:, 2] - x[:, 0])
    c1 = first - c2 * (x[:, 0] + x[:, 1])
    c0 = values[:, 0] - x[:, 0] * (c1 + x[:, 0] * c2)
    return np.column_stack((c0, c1, c2))


@compiled
def _close_pairs(
    nodes: tuple[int, int],
    flat: FloatArray,
    starts: IntArray,
    partners: IndexArray,
    length: float,
    cutoff: float,
    found: IndexArray,
    ends: IndexArray,
    arms: FloatArray,
    squared: FloatArray,
) -> int:
    """Pick the pairs of some successive nodes within the reach out of the list; count them."""
    first, inverse, n, one, two = nodes[0], 1.0 / length, np.uint32(0), np.uint64(1), np.uint64(2)
    for i in range(nodes[0], nodes[1]):
        own_x, own_y = flat[2 * i], flat[2 * i + 1]
        for k in range(starts[i], starts[i + 1]):
            at = np.uint64(partners[k]) * two
            x, y = flat[at] - own_x, flat[at + one] - own_y
            x -= length * np.floor(x * inverse + 0.5)
            distance = x * x + y * y
            # Written where the next pair overwrites it unless it counts: no branch to mispredict.
            found[n], squared[n] = at, distance
            arms[two * np.uint64(n)], arms[two * np.uint64(n) + one] = x, y
            n += np.uint32(distance < cutoff)
        ends[i - first] = n
    return int(n)


@compiled
def _look_up(
    squared: FloatArray, count: int, table: FloatArray, first: int, functions: FloatArray
) -> None:
    """Set ``functions`` to T_t and (T_r - T_t)/r², by turns, at the first squared distances."""
    bits, lowest, shift = squared.view(np.uint64), np.uint64(first), np.uint64(_SHIFT)
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    four, five, six = np.uint64(4), np.uint64(5), np.uint64(6)
    flat = table.reshape(-1)
    for p in range(count):
        x = squared[p]
        at = six * (max(bits[p] >> shift, lowest) - lowest)
        functions[2 * p] = flat[at] + x * (flat[at + one] + x * flat[at + two])
        functions[2 * p + 1] = flat[at + three] + x * (flat[at + four] + x * flat[at + five])


@compiled
def _add_pairs(
    nodes: tuple[int, int],
    ends: IndexArray,
    found: IndexArray,
    arms: FloatArray,
    functions: FloatArray,
    forces: FloatArray,
    scale: float,
    flat: FloatArray,
) -> None:
    """Add the velocities of the pairs of some successive nodes to ``flat``, node after node."""
    first, p, one, two = nodes[0], np.uint64(0), np.uint64(1), np.uint64(2)
    for i in range(nodes[0], nodes[1]):
        fx, fy = scale * forces[2 * i], scale * forces[2 * i + 1]
        ux, uy, end = 0.0, 0.0, np.uint64(ends[i - first])
        while p < end:
            at = np.uint64(found[p])
            x, y = arms[two * p], arms[two * p + one]
            tangential, excess = functions[two * p], functions[two * p + one]
            gx, gy = forces[at], forces[at + one]
            there = excess * (gx * x + gy * y)
            back = excess * (fx * x + fy * y)
            ux += tangential * gx + there * x
            uy += tangential * gy + there * y
            flat[at] += tangential * fx + back * x
            flat[at + one] += tangential * fy + back * y
            p += one
        flat[2 * i] += scale * ux
        flat[2 * i + 1] += scale * uy


@compiled
def add_near(
    points: FloatArray,
    forces: FloatArray,
    starts: IntArray,
    partners: IndexArray,
    length: float,
    reach: float,
    table: FloatArray,
    first: int,
    scale: float,
    velocities: FloatArray,
) -> int:
    """Add the near velocities of all listed pairs closer than the reach; return their number.

    Listed pairs beyond the reach are passed over, so the sums do not depend on the age of the
    list.

    Parameters
    ----------
    points, forces
        Shape (nodes, 2), contiguous; x periodic with ``length``. The sum is worked out in the
        precision of the forces, distances in that of the points.
    starts, partners
        Pairs of `solver.neighbours.find_pairs`, complete within ``reach``; partners as unsigned
        numbers, which spare the loops a test for negative ones.
    length, reach
        [length unit].
    table, first
        From `near_table`.
    scale
        1/(2πη).
    velocities
        Added to, shape (nodes, 2), contiguous.
    """
    count, longest, total = starts.size - 1, 0, 0
    for i in range(count):
        longest = max(longest, starts[i + 1] - starts[i])
    # One place more: a pair beyond the reach is written, if not counted, after the last.
    room = BATCH * longest + 1
    found, ends = np.empty(room, np.uint32), np.empty(BATCH, np.uint32)
    arms, functions = np.empty(2 * room, forces.dtype), np.empty(2 * room, forces.dtype)
    squared = np.empty(room)
    flat, pushes, answers = points.reshape(-1), forces.reshape(-1), velocities.reshape(-1)
    for begin in range(0, count, BATCH):
        nodes = (begin, min(begin + BATCH, count))
        n = _close_pairs(
            nodes, flat, starts, partners, length, reach * reach, found, ends, arms, squared
        )
        _look_up(squared, n, table, first, functions)
        _add_pairs(nodes, ends, found, arms, functions, pushes, scale, answers)
        total += n
    return total


class RigidPairs:
    """Near velocities of nodes that keep their mutual distances: a constant sparse operator.

    Parameters
    ----------
    positions
        Reference positions, shape (nodes, 2) [length unit]; x periodic.
    starts, partners
        Their pairs within the reach (`solver.neighbours.find_pairs`).
    length
        Period L_x [length unit].
    table, first
        From `near_table`.
    scale
        1/(2πη).

    Attributes
    ----------
    nodes, pairs
        Numbers of nodes and of pairs.
    """

    def __init__(
        self,
        positions: FloatArray,
        starts: IntArray,
        partners: IntArray,
        length: float,
        table: FloatArray,
        first: int,
        scale: float,
    ) -> None:
        self.nodes, self.pairs = len(positions), len(partners)
        self._starts, self._partners = starts, partners
        arm = positions[partners] - positions[np.repeat(np.arange(len(positions)), np.diff(starts))]
        arm[:, 0] -= length * np.round(arm[:, 0] / length)
        squared = np.sum(arm**2, axis=1)
        functions = np.empty((squared.size, 2))
        _look_up(squared, squared.size, table, first, functions.reshape(-1))
        (tangential, excess), (x, y) = functions.T, arm.T
        self._blocks = scale * np.stack(
            (tangential + excess * x * x, excess * x * y, tangential + excess * y * y), axis=1
        )

    @classmethod
    def none(cls) -> "RigidPairs":
        """Return the operator of no nodes."""
        empty = np.empty(0, np.int64)
        return cls(np.empty((0, 2)), np.zeros(1, np.int64), empty, 1.0, np.zeros((1, 6)), 0, 1.0)

    def add(self, forces: FloatArray, velocities: FloatArray) -> None:
        """Add the velocities of these nodes, shape (nodes, 2), under forces of the same shape."""
        _add_rigid(self._starts, self._partners, self._blocks, forces, velocities)


@compiled
def _add_rigid(
    starts: IntArray,
    partners: IntArray,
    blocks: FloatArray,
    forces: FloatArray,
    velocities: FloatArray,
) -> None:
    for i in range(starts.size - 1):
        for k in range(starts[i], starts[i + 1]):
            j, xx, xy, yy = partners[k], blocks[k, 0], blocks[k, 1], blocks[k, 2]
            velocities[i, 0] += xx * forces[j, 0] + xy * forces[j, 1]
            velocities[i, 1] += xy * forces[j, 0] + yy * forces[j, 1]
            velocities[j, 0] += xx * forces[i, 0] + xy * forces[i, 1]
            velocities[j, 1] += xy * forces[i, 0] + yy * forces[i, 1]
