"""The multiplication by P_g of one membrane after the other; see `solver.membrane_response`."""

import numpy as np

from softslip.solver.chains import PADDING, longest_chain, unroll
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.long_modes import LONG_MODES, add_longest, fill_rows, invert
from softslip.solver.membrane_strain import (
    convolve,
    difference,
    strain_along,
    take_strained,
    wrap,
)


@compiled
def prepare_solve(
    positions: FloatArray,
    offsets: IntArray,
    spacing: FloatArray,
    weights: tuple[float, float, float],
    symbols: FloatArray,
    kind: IntArray,
    cosine: FloatArray,
    waves: FloatArray,
    shift: float,
    tangents: FloatArray,
    kernels: FloatArray,
    longest: FloatArray,
) -> None:
    """Fill the tangents, the convolutions of the short modes, and the inverses of the long ones.

    Parameters
    ----------
    positions, offsets, spacing, weights
        Of the particle nodes, and of the difference.
    symbols
        Q, R over what the tension gains by a turn, and D̂², in the first columns of each membrane.
    kind, cosine, waves
        Row of each membrane in the tables of cos(2πdk/N), over distances d and modes k, and of the
        unit cosines and sines of the longest modes.
    shift
        g.
    tangents, kernels, longest
        Output, shapes (2, nodes), (2, nodes) and (particles, 2 `LONG_MODES`, 2 `LONG_MODES`).
    """
    room = longest_chain(offsets) + 2 * PADDING
    x, y, dx, dy = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    symbol = np.empty((2, room))
    rows = np.empty((2 * LONG_MODES, 2 * room))
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        count = unroll(positions, first, end, 0.0, x, y)
        difference(x, weights, count, dx)
        difference(y, weights, count, dy)
        tx, ty = tangents[0, first:end], tangents[1, first:end]
        excess, sharpest = 0.0, 0.0
        for s in range(count):
            inverse = 1.0 / np.sqrt(dx[s] * dx[s] + dy[s] * dy[s])
            tx[s], ty[s] = inverse * dx[s], inverse * dy[s]
            excess += 1.0 / spacing[p] - inverse
        for s in range(count):
            after = s + 1 if s + 1 < count else 0
            turn = tx[s] * ty[after] - ty[s] * tx[after]
            sharpest = max(sharpest, turn * turn)
        tension = max(excess / count, 0.0)
        modes = min(LONG_MODES, (count - 1) // 2)
        symbol[:, : count // 2 + 1] = 0.0
        for k in range(modes + 1, count // 2 + 1):
            bent = shift * (symbols[2, first + k] + sharpest)
            symbol[0, k] = 1.0 / (1.0 / symbols[0, first + k] + bent)
            symbol[1, k] = tension / (1.0 / symbols[1, first + k] + tension * bent)
        _fill_kernels(symbol, cosine[kind[p]], count, kernels[:, first:end])
        fill_rows(tx, ty, waves[kind[p]], weights, modes, count, dx, dy, rows)
        block = longest[p]
        # Two rows by two, each loaded once for two products.
        for i in range(0, 2 * modes, 2):
            for j in range(0, i + 2, 2):
                a, b, c, d = 0.0, 0.0, 0.0, 0.0
                for s in range(2 * count):
                    a += rows[i, s] * rows[j, s]
                    b += rows[i, s] * rows[j + 1, s]
                    c += rows[i + 1, s] * rows[j, s]
                    d += rows[i + 1, s] * rows[j + 1, s]
                block[i, j], block[i, j + 1] = shift * a, shift * b
                block[i + 1, j], block[i + 1, j + 1] = shift * c, shift * d
            own = 1.0 / symbols[0, first + i // 2 + 1]
            block[i, i] += own
            block[i + 1, i + 1] += own
        invert(block, 2 * modes)


@compiled
def _fill_kernels(symbol: FloatArray, cosine: FloatArray, count: int, kernels: FloatArray) -> None:
    """Fill the convolutions over distances 0 ... N/2 that multiply mode k by its symbols."""
    for d in range(count // 2 + 1):
        along, normal = 0.0, 0.0
        for k in range(1, (count + 1) // 2):
            along += symbol[0, k] * cosine[d, k]
            normal += symbol[1, k] * cosine[d, k]
        along, normal = 2.0 * along, 2.0 * normal
        if count % 2 == 0:
            sign = 1.0 if d % 2 == 0 else -1.0
            along += sign * symbol[0, count // 2]
            normal += sign * symbol[1, count // 2]
        kernels[0, d], kernels[1, d] = along / count, normal / count


@compiled
def solve_membranes(
    displacements: FloatArray,
    offsets: IntArray,
    weights: tuple[float, float, float],
    kind: IntArray,
    waves: FloatArray,
    shift: float,
    tangents: FloatArray,
    kernels: FloatArray,
    longest: FloatArray,
    gradients: FloatArray,
    pressed: FloatArray,
    by_pressure: FloatArray,
) -> None:
    """Multiply displacements by P_g in place.

    Parameters
    ----------
    displacements
        Shape (nodes, 2); the others as `prepare_solve` fills them, but for the last three.
    gradients, pressed, by_pressure
        a, u and aᵀ u of each membrane, by which its area is kept; zero, zero and one where it is
        not.
    """
    room = longest_chain(offsets) + 2 * PADDING
    x, y, dx, dy = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    strain, answer = np.empty(2 * room), np.empty(room)
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        count = unroll(displacements, first, end, 0.0, x, y)
        tx, ty = tangents[0, first:end], tangents[1, first:end]
        modes = min(LONG_MODES, (count - 1) // 2)
        change = 0.0
        for s in range(count):
            change += gradients[first + s, 0] * x[s + PADDING]
            change += gradients[first + s, 1] * y[s + PADDING]
        strain_along(x, y, tx, ty, 1.0, weights, count, dx, dy, strain)
        convolve(strain, kernels[0, first:end], count, answer)
        add_longest(strain, longest[p], waves[kind[p]], 2 * modes, count, answer)
        take_strained(answer, tx, ty, 1.0, weights, shift, count, dx, dy, x, y)
        wrap(x, count)
        wrap(y, count)
        # The normal is (τ_y, -τ_x).
        strain_along(x, y, ty, tx, -1.0, weights, count, dx, dy, strain)
        convolve(strain, kernels[1, first:end], count, answer)
        take_strained(answer, ty, tx, -1.0, weights, shift, count, dx, dy, x, y)
        for s in range(count):
            change -= gradients[first + s, 0] * x[s + PADDING]
            change -= gradients[first + s, 1] * y[s + PADDING]
        change /= by_pressure[p]
        for s in range(count):
            displacements[first + s, 0] = x[s + PADDING] + change * pressed[first + s, 0]
            displacements[first + s, 1] = y[s + PADDING] + change * pressed[first + s, 1]
