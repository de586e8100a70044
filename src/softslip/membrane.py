"""Elastic membranes: tension (Eqs. 4-5) and area (Eqs. 18-21)."""

import math

import numpy as np

from softslip.geometry import FloatArray, IntArray
from softslip.kernels import compiled


@compiled
def add_tension(
    positions: FloatArray,
    offsets: IntArray,
    spacing: FloatArray,
    elastic_constant: float,
    forces: FloatArray,
) -> None:
    """Add the membrane force on each node, T_{s+1/2} τ_{s+1/2} - T_{s-1/2} τ_{s-1/2} (Eq. 5).

    The tension is T = K_e (|X_{s+1} - X_s|/Δs - 1); the force is the density of Eq. 5 times Δs.

    Parameters
    ----------
    positions
        Shape (nodes, 2), each membrane contiguous [length unit].
    offsets, spacing
        First row and rest distance Δs of each particle's nodes.
    elastic_constant
        K_e [stress unit].
    forces
        Added to, shape (nodes, 2).
    """
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        before = end - 1
        for s in range(first, end):
            dx = positions[s, 0] - positions[before, 0]
            dy = positions[s, 1] - positions[before, 1]
            distance = math.sqrt(dx * dx + dy * dy)
            tension = elastic_constant * (1.0 / spacing[p] - 1.0 / distance)
            forces[s, 0] -= tension * dx
            forces[s, 1] -= tension * dy
            forces[before, 0] += tension * dx
            forces[before, 1] += tension * dy
            before = s


@compiled
def remove_flux(positions: FloatArray, offsets: IntArray, velocities: FloatArray) -> None:
    """Subtract from each membrane's velocity the mean normal part that changes its area (Eq. 21).

    Parameters
    ----------
    positions
        Shape (nodes, 2).
    offsets
        First row of each particle.
    velocities
        Changed in place, shape (nodes, 2).
    """
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        flux, perimeter = 0.0, 0.0
        for s in range(first, end):
            nx, ny, width = _normal(positions, first, end, s)
            flux += velocities[s, 0] * nx + velocities[s, 1] * ny
            perimeter += width
        mean = flux / perimeter
        for s in range(first, end):
            nx, ny, width = _normal(positions, first, end, s)
            velocities[s, 0] -= mean * nx / width
            velocities[s, 1] -= mean * ny / width


@compiled
def _normal(positions: FloatArray, first: int, end: int, s: int) -> tuple[float, float, float]:
    """Return the outward normal times ΔS_s, and ΔS_s, of node s (below Eq. 19)."""
    before = s - 1 if s > first else end - 1
    after = s + 1 if s < end - 1 else first
    nx = 0.5 * (positions[after, 1] - positions[before, 1])
    ny = 0.5 * (positions[before, 0] - positions[after, 0])
    return nx, ny, math.sqrt(nx * nx + ny * ny)


@compiled
def membrane_areas(positions: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the area inside each membrane, shape (particles,); positive when anticlockwise.

    Coordinates are taken from each membrane's first node, so that areas keep their digits
    wherever the particle is.
    """
    areas = np.zeros(offsets.size - 1)
    for p in range(offsets.size - 1):
        first, end = offsets[p], offsets[p + 1]
        x0, y0 = positions[first, 0], positions[first, 1]
        twice = 0.0
        for s in range(first, end - 1):
            twice += (positions[s, 0] - x0) * (positions[s + 1, 1] - y0)
            twice -= (positions[s + 1, 0] - x0) * (positions[s, 1] - y0)
        areas[p] = 0.5 * twice
    return areas


@compiled
def wrap_particles(positions: FloatArray, offsets: IntArray, length: float) -> None:
    """Shift whole membranes by multiples of L_x so that their first node lies in [0, L_x)."""
    for p in range(offsets.size - 1):
        shift = length * math.floor(positions[offsets[p], 0] / length)
        if shift != 0.0:
            for s in range(offsets[p], offsets[p + 1]):
                positions[s, 0] -= shift


def rest_spacing(areas: FloatArray, offsets: IntArray) -> FloatArray:
    """Return Δs = L/N_s of each membrane, L the perimeter of the circle of the same area.

    The paper resets the rest distance to this when the shearing simulation starts (Sec. II B).
    """
    return 2 * np.sqrt(math.pi * areas) / np.diff(offsets)
