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

from collections.abc import Callable

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray, Layout
from softslip.solver.long_modes import LONG_MODES, long_waves
from softslip.solver.membrane import MembraneLaw, area_gradients, staggered
from softslip.solver.membrane_solve import prepare_solve, solve_membranes
from softslip.solver.mobility.line import line_symbols

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
        self._cosine = np.zeros((kinds.size, room // 2 + 1, room // 2 + 1))
        for kind, count in enumerate(kinds):
            half = np.arange(count // 2 + 1)
            cosine = np.cos(2 * np.pi / count * (np.outer(half, half) % count))
            self._cosine[kind, : half.size, : half.size] = cosine
            waves = long_waves(int(count))
            self._waves[kind, : len(waves), :count] = waves
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
        prepare_solve(
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

        def multiply(displacements: FloatArray, *pressure: FloatArray) -> None:
            solve_membranes(
                displacements,
                self._offsets,
                staggered(self._law.order),
                self._kind,
                self._waves,
                shift,
                tangents,
                kernels,
                longest,
                *pressure,
            )

        gradients = area_gradients(positions, self._offsets, self._law.order)
        pressed, nothing = gradients.copy(), np.zeros_like(gradients)
        multiply(pressed, nothing, nothing, np.ones(particles))
        by_pressure = _products(gradients, pressed, self._offsets)

        def solve(displacements: FloatArray) -> None:
            multiply(displacements, gradients, pressed, by_pressure)

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
def _products(first: FloatArray, second: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the scalar product of two vectors of each membrane, shape (particles,)."""
    products = np.empty(offsets.size - 1)
    for p in range(offsets.size - 1):
        total = 0.0
        for s in range(offsets[p], offsets[p + 1]):
            total += first[s, 0] * second[s, 0] + first[s, 1] * second[s, 1]
        products[p] = total
    return products
