"""Transfer between boundary nodes and the periodic mesh (Eqs. 15 and 28).

A mesh field has shape (N_x, N_y); mesh point (i, j) lies at (i dx, j dx) in the channel frame, and
indices wrap around both ways. Node forces are integrated: the force density times Δs.
"""

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.kernels import SUPPORT, difference_weights, kernel_weights

_WIDE = SUPPORT + 2

_PADDED = _WIDE + 1
"""Mesh lines that the inner loops run over: one more, of weight zero, makes whole vectors."""


@compiled
def _wrap(first: int, size: int, lines: IntArray) -> None:
    """Fill the indices of consecutive mesh lines from ``first`` on, modulo ``size``."""
    line = first % size
    for k in range(lines.size):
        lines[k] = line
        line += 1
        if line == size:
            line = 0


@compiled
def _stencil(coordinate: float, weights: FloatArray, differences: FloatArray) -> int:
    """Fill the weights and their central differences; return the mesh line of the first."""
    first = kernel_weights(coordinate, weights[1 : SUPPORT + 1])
    difference_weights(weights[1 : SUPPORT + 1], differences)
    return first - 1


@compiled
def spread_curl(
    positions: FloatArray, forces: FloatArray, mesh_size: float, curl: FloatArray
) -> None:
    """Add the curl (D × f)·ẑ of the spread force density to a mesh field (Eqs. 12 and 28).

    The central difference acts on the kernel instead of on the mesh, so that one scalar field is
    written and none is differentiated; the result is the same operator.

    Parameters
    ----------
    positions, forces
        Shape (nodes, 2).
    mesh_size
        dx [length unit].
    curl
        Mesh field that is added to, shape (N_x, N_y).
    """
    nx, ny = curl.shape
    wx, wy = np.zeros(_PADDED), np.zeros(_PADDED)
    dwx, dwy = np.zeros(_PADDED), np.zeros(_PADDED)
    ix, iy = np.empty(_PADDED, np.int64), np.empty(_PADDED, np.int64)
    per_area = 1.0 / (mesh_size * mesh_size * mesh_size)
    for s in range(positions.shape[0]):
        _wrap(_stencil(positions[s, 0] / mesh_size, wx, dwx), nx, ix)
        _wrap(_stencil(positions[s, 1] / mesh_size, wy, dwy), ny, iy)
        force_x, force_y = forces[s, 0] * per_area, forces[s, 1] * per_area
        for a in range(_WIDE):
            along, across = force_y * dwx[a], force_x * wx[a]
            if iy[_WIDE] > iy[0]:
                row = curl[ix[a], iy[0] : iy[0] + _PADDED]
                for b in range(_PADDED):
                    row[b] += along * wy[b] - across * dwy[b]
            else:
                for b in range(_WIDE):
                    curl[ix[a], iy[b]] += along * wy[b] - across * dwy[b]


@compiled
def interpolate_curl(
    positions: FloatArray, streamfunction: FloatArray, mesh_size: float, velocities: FloatArray
) -> None:
    """Interpolate the velocity D × (ψ ẑ) of a streamfunction to the nodes (Eqs. 12 and 15).

    The transpose of `spread_curl` up to the cell area dx².

    Parameters
    ----------
    positions
        Shape (nodes, 2).
    streamfunction
        ψ on the mesh, shape (N_x, N_y).
    mesh_size
        dx [length unit].
    velocities
        Output, shape (nodes, 2).
    """
    nx, ny = streamfunction.shape
    wx, wy = np.zeros(_PADDED), np.zeros(_PADDED)
    dwx, dwy = np.zeros(_PADDED), np.zeros(_PADDED)
    ix, iy = np.empty(_PADDED, np.int64), np.empty(_PADDED, np.int64)
    for s in range(positions.shape[0]):
        _wrap(_stencil(positions[s, 0] / mesh_size, wx, dwx), nx, ix)
        _wrap(_stencil(positions[s, 1] / mesh_size, wy, dwy), ny, iy)
        velocity_x, velocity_y = 0.0, 0.0
        for a in range(_WIDE):
            plain, steep = 0.0, 0.0
            if iy[_WIDE] > iy[0]:
                row = streamfunction[ix[a], iy[0] : iy[0] + _PADDED]
                for b in range(_PADDED):
                    plain += wy[b] * row[b]
                    steep += dwy[b] * row[b]
            else:
                for b in range(_WIDE):
                    psi = streamfunction[ix[a], iy[b]]
                    plain += wy[b] * psi
                    steep += dwy[b] * psi
            velocity_x -= wx[a] * steep
            velocity_y += dwx[a] * plain
        velocities[s, 0] = velocity_x / mesh_size
        velocities[s, 1] = velocity_y / mesh_size


@compiled
def spread_across(
    heights: FloatArray, amounts: FloatArray, mesh_size: float, density: FloatArray
) -> None:
    """Add Σ_s A_s δ_h(y_j - Y_s) to a field of mesh heights: the x-sum of Eq. 28 times dx.

    Parameters
    ----------
    heights, amounts
        Node heights and one force component, shape (nodes,).
    mesh_size
        dx [length unit].
    density
        Field that is added to, shape (N_y,).
    """
    ny = density.size
    wy = np.empty(SUPPORT)
    for s in range(heights.size):
        line = kernel_weights(heights[s] / mesh_size, wy)
        scale = amounts[s] / mesh_size
        for b in range(SUPPORT):
            density[(line + b) % ny] += scale * wy[b]
