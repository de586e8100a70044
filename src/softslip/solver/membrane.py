"""Elastic membranes: tension (Eqs. 4-5) and area (Eqs. 18-21), at second or sixth order in Δs.

The nodes are equally spaced in the reference coordinate, so derivatives along a membrane are
differences of fixed stencils. Order 2 is the paper's: links between neighbours and the area of the
polygon. Order 6 replaces both differences by the six-point ones of that order, and derives forces
and normals from the discrete energy and area as before: total force, torque and area stay exact.
"""

import math
from dataclasses import dataclass

import numpy as np

from softslip.solver.chains import PADDING, longest_chain, unroll
from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray, Layout

ORDERS = (2, 6)
"""Orders of the differences along a membrane."""


@dataclass(frozen=True)
class MembraneLaw:
    """How membranes resist stretching, and whether they keep their area.

    Attributes
    ----------
    elastic_constant
        K_e [stress unit].
    order
        Of the differences, one of `ORDERS`.
    area_restoring
        Rate at which areas return to their references [1 / time unit]; None moves the nodes with
        the bare velocity of the fluid, and areas with them.
    """

    elastic_constant: float
    order: int
    area_restoring: float | None

    def add_forces(self, positions: FloatArray, layout: Layout, forces: FloatArray) -> None:
        """Add the membrane force on each particle node; see `add_tension`."""
        constant, order = self.elastic_constant, self.order
        add_tension(positions, layout.offsets, layout.spacing, constant, order, forces)

    def keep_areas(self, positions: FloatArray, layout: Layout, velocities: FloatArray) -> None:
        """Take from particle velocities what changes areas; see `remove_flux`."""
        if self.area_restoring is None:
            return
        order, restoring, areas = self.order, self.area_restoring, layout.reference_area
        remove_flux(positions, layout.offsets, order, restoring, areas, velocities)


_STAGGERED = ((1.0, 0.0, 0.0), (75.0 / 64.0, -25.0 / 384.0, 3.0 / 640.0))
"""Weights of X_{s+1} - X_s, X_{s+2} - X_{s-1}, X_{s+3} - X_{s-2} in Δs dX/ds, for each order.

The derivative is the one half-way between s and s+1, where the tension lives: there a zigzag of
the nodes stretches the membrane, which a central difference would not see.
"""

_CENTRAL = ((0.5, 0.0, 0.0), (3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0))
"""Weights of X_{s+k} - X_{s-k}, k = 1, 2, 3, in Δs dX/ds at node s, for each order."""


def staggered(order: int) -> tuple[float, float, float]:
    """Return the weights of X_{s+1} - X_s, X_{s+2} - X_{s-1}, X_{s+3} - X_{s-2} in Δs dX/ds.

    Raises
    ------
    ValueError
        When the order is none of `ORDERS`.
    """
    weights: tuple[float, float, float] = _of_order(order, _STAGGERED)
    return weights


@compiled
def _of_order(
    order: int, stencils: tuple[tuple[float, float, float], tuple[float, float, float]]
) -> tuple[float, float, float]:
    """Return the stencil of an order out of those of `ORDERS`."""
    if order == 2:
        return stencils[0]
    if order == 6:
        return stencils[1]
    raise ValueError("The order of the differences is 2 or 6.")


@compiled
def add_tension(
    positions: FloatArray,
    offsets: IntArray,
    spacing: FloatArray,
    elastic_constant: float,
    order: int,
    forces: FloatArray,
) -> None:
    """Add the membrane force on each node, the density ∂(T τ)/∂s of Eq. 5 times Δs.

    It is minus the gradient of E = Σ (K_e/2) (|D X|_{s+1/2} - 1)² Δs, D the staggered difference
    over Δs: T τ with T = K_e (|D X| - 1) and τ = D X/|D X|, carried to the nodes by the transpose
    of D. At order 2 that is T_{s+1/2} τ_{s+1/2} - T_{s-1/2} τ_{s-1/2}. Each membrane's total
    force and torque vanish, as T τ is parallel to D X.

    Parameters
    ----------
    positions
        Shape (nodes, 2), each membrane contiguous [length unit].
    offsets, spacing
        First row and rest distance Δs of each particle's nodes, at least 3 a particle.
    elastic_constant
        K_e [stress unit].
    order
        Of the difference, one of `ORDERS`.
    forces
        Added to, shape (nodes, 2).

    Raises
    ------
    ValueError
        When the order is none of `ORDERS`.
    """
    near, middle, far = _of_order(order, _STAGGERED)
    room = longest_chain(offsets) + 2 * PADDING
    x, y, tx, ty = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    for p in range(offsets.size - 1):
        count = unroll(positions, offsets[p], offsets[p + 1], 0.0, x, y)
        rest = 1.0 / spacing[p]
        # Entry s of the tension is half-way between the nodes s - 1 and s of the chain.
        for s in range(count + 1):
            dx = near * (x[s + 3] - x[s + 2])
            dx += middle * (x[s + 4] - x[s + 1]) + far * (x[s + 5] - x[s])
            dy = near * (y[s + 3] - y[s + 2])
            dy += middle * (y[s + 4] - y[s + 1]) + far * (y[s + 5] - y[s])
            tension = elastic_constant * (rest - 1.0 / math.sqrt(dx * dx + dy * dy))
            tx[s + 2] = tension * dx
            ty[s + 2] = tension * dy
        for k in range(2):
            tx[k], ty[k] = tx[k + count], ty[k + count]
            tx[k + count + 3], ty[k + count + 3] = tx[k + 3], ty[k + 3]
        own = forces[offsets[p] : offsets[p + 1]].reshape(-1)
        for s in range(count):
            own[2 * s] += near * (tx[s + 3] - tx[s + 2]) + (
                middle * (tx[s + 4] - tx[s + 1]) + far * (tx[s + 5] - tx[s])
            )
            own[2 * s + 1] += near * (ty[s + 3] - ty[s + 2]) + (
                middle * (ty[s + 4] - ty[s + 1]) + far * (ty[s + 5] - ty[s])
            )


@compiled
def remove_flux(
    positions: FloatArray,
    offsets: IntArray,
    order: int,
    restoring: float,
    reference_area: FloatArray,
    velocities: FloatArray,
) -> None:
    """Subtract from each membrane's velocity the mean normal part that changes its area (Eq. 21).

    What is left changes the area A of `membrane_areas` at the rate -r (A - A_0): zero with r = 0,
    which is Eq. 21; otherwise the error that time steps leave behind decays.

    Parameters
    ----------
    positions
        Shape (nodes, 2).
    offsets
        First row of each particle.
    order
        Of the difference, one of `ORDERS`.
    restoring
        r [1/time unit].
    reference_area
        A_0 of each particle, shape (particles,).
    velocities
        Changed in place, shape (nodes, 2).

    Raises
    ------
    ValueError
        When the order is none of `ORDERS`.
    """
    stencil = _of_order(order, _CENTRAL)
    room = longest_chain(offsets) + 2 * PADDING
    x, y, nx, ny = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    width = np.empty(room)
    for p in range(offsets.size - 1):
        count = unroll(positions, offsets[p], offsets[p + 1], 0.0, x, y)
        _fill_normals(x, y, stencil, count, nx, ny)
        own = velocities[offsets[p] : offsets[p + 1]].reshape(-1)
        flux, perimeter = 0.0, 0.0
        for s in range(count):
            width[s] = math.sqrt(nx[s] * nx[s] + ny[s] * ny[s])
            flux += own[2 * s] * nx[s] + own[2 * s + 1] * ny[s]
            perimeter += width[s]
        excess = _area(x, y, nx, ny, count) - reference_area[p]
        mean = (flux + restoring * excess) / perimeter
        for s in range(count):
            share = mean / width[s]
            own[2 * s] -= share * nx[s]
            own[2 * s + 1] -= share * ny[s]


@compiled
def _fill_normals(
    x: FloatArray,
    y: FloatArray,
    stencil: tuple[float, float, float],
    count: int,
    nx: FloatArray,
    ny: FloatArray,
) -> None:
    """Fill the outward normal times ΔS of each node, ∂A/∂X_s, of an unrolled chain (Eq. 19)."""
    near, middle, far = stencil
    for s in range(count):
        nx[s] = near * (y[s + 4] - y[s + 2]) + (
            middle * (y[s + 5] - y[s + 1]) + far * (y[s + 6] - y[s])
        )
        ny[s] = near * (x[s + 2] - x[s + 4]) + (
            middle * (x[s + 1] - x[s + 5]) + far * (x[s] - x[s + 6])
        )


@compiled
def area_gradients(positions: FloatArray, offsets: IntArray, order: int) -> FloatArray:
    """Return the gradient ∂A/∂X of each membrane's area of `membrane_areas`, shape (nodes, 2).

    Parameters
    ----------
    positions, offsets, order
        As in `membrane_areas`.

    Raises
    ------
    ValueError
        When the order is none of `ORDERS`.
    """
    stencil = _of_order(order, _CENTRAL)
    room = longest_chain(offsets) + 2 * PADDING
    x, y, nx, ny = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    gradients = np.empty_like(positions)
    for p in range(offsets.size - 1):
        first = offsets[p]
        count = unroll(positions, first, offsets[p + 1], 0.0, x, y)
        _fill_normals(x, y, stencil, count, nx, ny)
        for s in range(count):
            gradients[first + s, 0], gradients[first + s, 1] = nx[s], ny[s]
    return gradients


@compiled
def _area(x: FloatArray, y: FloatArray, nx: FloatArray, ny: FloatArray, count: int) -> float:
    """Return ½ Σ X·n of an unrolled chain, with coordinates taken from its first node."""
    x0, y0 = x[PADDING], y[PADDING]
    twice = 0.0
    for s in range(count):
        twice += (x[s + PADDING] - x0) * nx[s] + (y[s + PADDING] - y0) * ny[s]
    return 0.5 * twice


@compiled
def membrane_areas(positions: FloatArray, offsets: IntArray, order: int) -> FloatArray:
    """Return the area A = ½ Σ X × D₁X Δs inside each membrane; positive when anticlockwise.

    D₁ is the central difference; at order 2 this is the area of the polygon of the nodes.
    Coordinates are taken from each membrane's first node, so that areas keep their digits
    wherever the particle is.

    Parameters
    ----------
    positions
        Shape (nodes, 2), each membrane contiguous [length unit].
    offsets
        First row of each particle's nodes, at least 3 a particle.
    order
        Of the difference, one of `ORDERS`.

    Returns
    -------
    FloatArray
        Shape (particles,) [length unit squared].

    Raises
    ------
    ValueError
        When the order is none of `ORDERS`.
    """
    stencil = _of_order(order, _CENTRAL)
    room = longest_chain(offsets) + 2 * PADDING
    x, y, nx, ny = np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    areas = np.empty(offsets.size - 1)
    for p in range(offsets.size - 1):
        count = unroll(positions, offsets[p], offsets[p + 1], 0.0, x, y)
        _fill_normals(x, y, stencil, count, nx, ny)
        areas[p] = _area(x, y, nx, ny, count)
    return areas


@compiled
def wrap_particles(positions: FloatArray, offsets: IntArray, length: float) -> None:
    """Shift whole membranes by multiples of L_x so that their first node lies in [0, L_x).

    A membrane whose first node lies there already is left alone, to the last bit. One whose first
    node is infinite becomes NaN.
    """
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        # A node just below 0 rounds to L_x when shifted, and has to be shifted back: hence a loop.
        while positions[first, 0] < 0.0 or positions[first, 0] >= length:
            periods = np.floor(positions[first, 0] / length)
            # The quotient may round to the wrong side of an integer: take one period at least.
            periods = min(periods, -1.0) if positions[first, 0] < 0.0 else max(periods, 1.0)
            for s in range(first, end):
                positions[s, 0] -= length * periods


def rest_spacing(areas: FloatArray, offsets: IntArray) -> FloatArray:
    """Return Δs = L/N_s of each membrane, L the perimeter of the circle of the same area.

    The paper resets the rest distance to this when the shearing simulation starts (Sec. II B).
    """
    return 2 * np.sqrt(math.pi * areas) / np.diff(offsets)
