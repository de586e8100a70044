"""How membranes answer their own tension, linearised: in closed form, one by one.

A membrane that is displaced by δ changes its tension, and the tension moves it. Of this
response, the part of the membrane's own neighbourhood is known without a flow to be solved:

    L δ = -Bᵀ Q B δ - Cᵀ R C δ,    (B δ)_{s+½} = τ·(D δ),    (C δ)_{s+½} = n·(D δ),

with D the staggered difference of the tension, τ and n the tangent and the normal there, and
Q and R diagonal in the Fourier modes of the membrane: the mobility of a straight line of nodes
(`solver.mobility.line`) for forces along and normal to it, times what the tension gains by a
strain, K_e/Δs, and by a turn, T̄/|D X|. Moving and turning as a whole, and bending without
stretching but for the tension itself, cost nothing. R counts in the short modes only, where the
membrane is nearly straight, and not at all where the mean tension T̄ is negative.

An implicit stage wants (1 - g L)⁻¹. The two parts hardly mix; so P_g is one inverse after the
other,

    P_g = [1 - g Cᵀ (R⁻¹ + g C Cᵀ)⁻¹ C] [1 - g Bᵀ (Q⁻¹ + g B Bᵀ)⁻¹ B],

each with B Bᵀ = D Dᵀ but for the curvature κ: exactly so for the longest modes, and with
D̂² + κ² in its place for the others, where that is a small correction. It must not be too small:
P_g would have negative eigenvalues, and steps with it no stability.

L alone would change the areas that membranes enclose, which the fluid inside keeps by its pressure.
Its place is taken by (1 - a aᵀ/a²) L, a being the gradient of a membrane's area, and P_g becomes

    P_g + u (aᵀ - aᵀ P_g)/(aᵀ u),    u = P_g a.
"""

import math
from collections.abc import Callable

import numpy as np

from softslip.solver.chains import PADDING, longest_chain, unroll
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray, Layout
from softslip.solver.membrane import MembraneLaw, area_gradients, staggered
from softslip.solver.mobility.line import line_symbols

LONG_MODES = 12
"""Modes of a membrane whose curvature is treated exactly: shapes in dense packings have corners,
whose κ² is up to four times the mean one, as much as D̂² of mode 2 and 1/40 of that of mode 13.
What is left of the next mode costs stages: the radius of P_g J is 49 with 8 modes, 31 with 12."""

Solve = Callable[[FloatArray], None]
"""Multiplies displacements of all particle nodes, shape (nodes, 2), by P_g in place."""


class MembraneResponse:
    """The linear response of all membranes to their own tension; see the module.

    Parameters
    ----------
    layout
        The run's nodes.
    law
        Of the membranes.
    regularisation, viscosity
        ε and η of the flow.
    corrected
        Whether the quadrature is corrected.
    """

    def __init__(
        self,
        layout: Layout,
        law: MembraneLaw,
        regularisation: float,
        viscosity: float,
        *,
        corrected: bool,
    ) -> None:
        self._offsets, self._spacing, self._law = layout.offsets, layout.spacing, law
        counts = np.diff(layout.offsets)
        kinds, self._kind = np.unique(counts, return_inverse=True)
        room = int(counts.max(initial=0))
        self._waves = np.zeros((kinds.size, 2 * LONG_MODES, room))
        self._cosine = np.zeros((kinds.size, room))
        for kind, count in enumerate(kinds):
            angle = 2 * np.pi * np.arange(count) / count
            self._cosine[kind, :count] = np.cos(angle)
            for mode in range(min(LONG_MODES, (count - 1) // 2)):
                phase = (mode + 1) * angle
                waves = math.sqrt(2.0 / count) * np.stack((np.cos(phase), np.sin(phase)))
                self._waves[kind, 2 * mode : 2 * mode + 2, :count] = waves
        self._symbols = np.zeros((3, layout.particle_nodes))
        known: dict[tuple[int, float], FloatArray] = {}
        for first, count, spacing in zip(layout.offsets[:-1], counts, layout.spacing, strict=True):
            key = int(count), float(spacing)
            if key not in known:
                known[key] = _symbols(*key, law, regularisation, viscosity, corrected)
            self._symbols[:, first : first + known[key].shape[1]] = known[key]

    def at(self, positions: FloatArray, shift: float) -> Solve:
        """Return the multiplication by P_g of the membranes at given places.

        Parameters
        ----------
        positions
            Of the particle nodes, shape (nodes, 2), each membrane contiguous [length unit].
        shift
            g, positive [time unit].
        """
        nodes, particles = positions.shape[0], self._offsets.size - 1
        tangents = np.empty((2, nodes))
        kernels = np.zeros((2, nodes))
        longest = np.zeros((particles, 2 * LONG_MODES, 2 * LONG_MODES))
        _prepare(
            positions,
            self._offsets,
            self._spacing,
            staggered(self._law.order),
            self._symbols,
            self._kind,
            self._cosine,
            self._waves,
            shift,
            tangents,
            kernels,
            longest,
        )

        def stretched(displacements: FloatArray) -> None:
            _solve(
                displacements,
                self._offsets,
                staggered(self._law.order),
                self._kind,
                self._waves,
                shift,
                tangents,
                kernels,
                longest,
            )

        gradients = area_gradients(positions, self._offsets, self._law.order)
        pressed = gradients.copy()
        stretched(pressed)
        by_pressure = _area_changes(pressed, self._offsets, gradients)

        def solve(displacements: FloatArray) -> None:
            changes = _area_changes(displacements, self._offsets, gradients)
            stretched(displacements)
            changes -= _area_changes(displacements, self._offsets, gradients)
            _add_multiples(pressed, self._offsets, changes / by_pressure, displacements)

        return solve


def _symbols(
    count: int,
    spacing: float,
    law: MembraneLaw,
    regularisation: float,
    viscosity: float,
    corrected: bool,
) -> FloatArray:
    """Return Q, R over what the tension gains by a turn, and D̂², shape (3, count // 2 + 1)."""
    half = np.pi * np.arange(count // 2 + 1) / count
    along, normal = line_symbols(
        2 * half / spacing, spacing, regularisation, viscosity, corrected=corrected
    )
    weights = enumerate(staggered(law.order))
    difference = sum(2 * weight * np.sin((2 * k + 1) * half) for k, weight in weights)
    elastic = law.elastic_constant
    return np.stack((elastic / spacing * along, elastic * normal, difference**2))


@compiled
def _area_changes(
    displacements: FloatArray, offsets: IntArray, gradients: FloatArray
) -> FloatArray:
    """Return by how much displacements change the area of each membrane, shape (particles,)."""
    changes = np.empty(offsets.size - 1)
    for p in range(offsets.size - 1):
        total = 0.0
        for s in range(offsets[p], offsets[p + 1]):
            total += gradients[s, 0] * displacements[s, 0] + gradients[s, 1] * displacements[s, 1]
        changes[p] = total
    return changes


@compiled
def _add_multiples(
    directions: FloatArray, offsets: IntArray, multiples: FloatArray, displacements: FloatArray
) -> None:
    """Add a multiple of a direction to the displacement of each membrane."""
    for p in range(offsets.size - 1):
        multiple = multiples[p]
        for s in range(offsets[p], offsets[p + 1]):
            displacements[s, 0] += multiple * directions[s, 0]
            displacements[s, 1] += multiple * directions[s, 1]


@compiled
def _difference(
    x: FloatArray, weights: tuple[float, float, float], count: int, out: FloatArray
) -> None:
    """Fill D x half-way after each node of an unrolled chain."""
    near, middle, far = weights
    for s in range(count):
        out[s] = near * (x[s + 4] - x[s + 3]) + (
            middle * (x[s + 5] - x[s + 2]) + far * (x[s + 6] - x[s + 1])
        )


@compiled
def _wrap(x: FloatArray, count: int) -> None:
    """Fill the wrap of an unrolled chain from its nodes."""
    for k in range(PADDING):
        x[k] = x[k + count]
        x[k + count + PADDING] = x[k + PADDING]


@compiled
def _take_transpose(
    x: FloatArray, weights: tuple[float, float, float], scale: float, count: int, out: FloatArray
) -> None:
    """Subtract scale Dᵀ x from a quantity of the nodes; x is unrolled, half-way after the nodes."""
    near, middle, far = weights
    for s in range(count):
        out[s] -= scale * (
            near * (x[s + 2] - x[s + 3])
            + (middle * (x[s + 1] - x[s + 4]) + far * (x[s] - x[s + 5]))
        )


@compiled
def _prepare(
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
        Of `_symbols`, in the first columns of each membrane.
    kind, cosine, waves
        Row of each membrane in the tables of cos(2πs/N), and of the unit cosines and sines of the
        longest modes.
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
        _difference(x, weights, count, dx)
        _difference(y, weights, count, dy)
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
        _fill_rows(tx, ty, waves[kind[p]], weights, modes, count, dx, dy, rows)
        block = longest[p]
        for i in range(2 * modes):
            for j in range(i + 1):
                total = 0.0
                for s in range(2 * count):
                    total += rows[i, s] * rows[j, s]
                block[i, j] = shift * total
            block[i, i] += 1.0 / symbols[0, first + i // 2 + 1]
        _invert(block, 2 * modes)


@compiled
def _fill_kernels(symbol: FloatArray, cosine: FloatArray, count: int, kernels: FloatArray) -> None:
    """Fill the convolutions over distances 0 ... N/2 that multiply mode k by its symbols."""
    for d in range(count // 2 + 1):
        along, normal = 0.0, 0.0
        place = 0
        for k in range(1, (count + 1) // 2):
            place += d
            place -= count if place >= count else 0
            along += symbol[0, k] * cosine[place]
            normal += symbol[1, k] * cosine[place]
        along, normal = 2.0 * along, 2.0 * normal
        if count % 2 == 0:
            sign = 1.0 if d % 2 == 0 else -1.0
            along += sign * symbol[0, count // 2]
            normal += sign * symbol[1, count // 2]
        kernels[0, d], kernels[1, d] = along / count, normal / count


@compiled
def _fill_rows(
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
        _wrap(x, count)
        _wrap(y, count)
        rows[k, : 2 * count] = 0.0
        _take_transpose(x, weights, -1.0, count, rows[k, :count])
        _take_transpose(y, weights, -1.0, count, rows[k, count:])


@compiled
def _invert(block: FloatArray, size: int) -> None:
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
def _convolve(x: FloatArray, kernel: FloatArray, count: int, out: FloatArray) -> None:
    """Fill Σ_d kernel(|d|) x_{s+d} over all nodes; x goes on for a whole period after the first."""
    half = (count - 1) // 2
    for s in range(count):
        out[s] = kernel[0] * x[s]
    for d in range(1, half + 1):
        weight = kernel[d]
        ahead, behind = x[d : d + count], x[count - d : 2 * count - d]
        for s in range(count):
            out[s] += weight * (ahead[s] + behind[s])
    if count % 2 == 0:
        weight = kernel[count // 2]
        for s in range(count):
            out[s] += weight * x[s + count // 2]


@compiled
def _solve(
    displacements: FloatArray,
    offsets: IntArray,
    weights: tuple[float, float, float],
    kind: IntArray,
    waves: FloatArray,
    shift: float,
    tangents: FloatArray,
    kernels: FloatArray,
    longest: FloatArray,
) -> None:
    """Multiply displacements by P_g in place; parameters as `_prepare` fills them."""
    room = longest_chain(offsets) + 2 * PADDING
    x, y, dx, dy = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    strain, answer = np.empty(2 * room), np.empty(room)
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        count = unroll(displacements, first, end, 0.0, x, y)
        tx, ty = tangents[0, first:end], tangents[1, first:end]
        modes = min(LONG_MODES, (count - 1) // 2)
        _strain(x, y, tx, ty, 1.0, weights, count, dx, dy, strain)
        _convolve(strain, kernels[0, first:end], count, answer)
        _add_longest(strain, longest[p], waves[kind[p]], 2 * modes, count, answer)
        _take_strained(answer, tx, ty, 1.0, weights, shift, count, dx, dy, x, y)
        _wrap(x, count)
        _wrap(y, count)
        # The normal is (τ_y, -τ_x).
        _strain(x, y, ty, tx, -1.0, weights, count, dx, dy, strain)
        _convolve(strain, kernels[1, first:end], count, answer)
        _take_strained(answer, ty, tx, -1.0, weights, shift, count, dx, dy, x, y)
        for s in range(count):
            displacements[first + s, 0] = x[s + PADDING]
            displacements[first + s, 1] = y[s + PADDING]


@compiled
def _strain(
    x: FloatArray,
    y: FloatArray,
    along_x: FloatArray,
    along_y: FloatArray,
    sign: float,
    weights: tuple[float, float, float],
    count: int,
    dx: FloatArray,
    dy: FloatArray,
    strain: FloatArray,
) -> None:
    """Fill the component of D δ along a direction (a_x, sign a_y), twice in a row."""
    _difference(x, weights, count, dx)
    _difference(y, weights, count, dy)
    for s in range(count):
        strain[s] = along_x[s] * dx[s] + sign * along_y[s] * dy[s]
    for s in range(count):
        strain[s + count] = strain[s]


@compiled
def _take_strained(
    answer: FloatArray,
    along_x: FloatArray,
    along_y: FloatArray,
    sign: float,
    weights: tuple[float, float, float],
    shift: float,
    count: int,
    dx: FloatArray,
    dy: FloatArray,
    x: FloatArray,
    y: FloatArray,
) -> None:
    """Subtract g Dᵀ of a quantity along a direction from unrolled displacements."""
    for s in range(count):
        dx[s + PADDING] = along_x[s] * answer[s]
        dy[s + PADDING] = sign * along_y[s] * answer[s]
    _wrap(dx, count)
    _wrap(dy, count)
    _take_transpose(dx, weights, shift, count, x[PADDING:])
    _take_transpose(dy, weights, shift, count, y[PADDING:])


@compiled
def _add_longest(
    strain: FloatArray,
    inverse: FloatArray,
    waves: FloatArray,
    size: int,
    count: int,
    answer: FloatArray,
) -> None:
    """Add the part of the longest modes: the inverse between their waves."""
    amount = np.empty(2 * LONG_MODES)
    for k in range(size):
        total = 0.0
        for s in range(count):
            total += strain[s] * waves[k, s]
        amount[k] = total
    for k in range(size):
        total = 0.0
        for j in range(size):
            total += inverse[k, j] * amount[j]
        for s in range(count):
            answer[s] += total * waves[k, s]
