"""Corrected quadrature: what the trapezoidal rule misses of each node's own neighbourhood.

The sum over the nodes of a membrane is a trapezoidal rule for a kernel that is nearly singular
where the membrane passes the node itself, and nowhere else. A locally straight membrane, with
nodes h apart, has the Fourier symbols of the kernel across its plane, with x = εq,

    4ηq T̂_t = (1 + 2x²) erfc x - 2x e^{-x²}/√π,    4ηq T̂_n = (1 - 2x²) erfc x + 2x e^{-x²}/√π,

for forces along (t) and normal (n) to it. By Poisson's formula the rule exceeds the integral by
2 Σ_{m≥1} T̂(2πm/h), so that adding, for a node force F,

    -(1/4πη) Σ_{m≥1} g(2πmε/h)/m F,    g = 4ηq T̂,

to the node's own velocity, along and normal to the membrane each with its g, corrects it. The
correction depends on ε/h alone and stays right as ε → 0.
"""

import math

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import erfc

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray, IndexArray, Layout
from softslip.solver.mobility import Mobility

TABLE_SIZE = 2048
"""Intervals of the correction's table in the squared spacing (relative error 1e-6 at worst)."""

WIDEST = 4.0
"""Largest stretch, and compression, of a membrane that the table covers."""

DECAYED = 6.0
"""Argument x beyond which g counts as zero: e^{-36} is the rounding of 1."""


def across(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return g = 4ηq T̂ at x = εq for forces along and normal to a plane, each of the shape of x."""
    complement, bell = erfc(x), 2 * x * np.exp(-(x**2)) / math.sqrt(math.pi)
    return (1 + 2 * x**2) * complement - bell, (1 - 2 * x**2) * complement + bell


def missed(spacing: FloatArray | float, regularisation: float) -> tuple[FloatArray, FloatArray]:
    """Return Σ_{m≥1} g(2πmε/h)/m for forces along and normal to the membrane.

    Parameters
    ----------
    spacing
        Distances h between nodes, any shape [length unit].
    regularisation
        ε [length unit].
    """
    modes = np.arange(1, math.ceil(DECAYED * np.max(spacing) / (2 * np.pi * regularisation)) + 1)
    along, normal = across(2 * np.pi * regularisation * modes / np.asarray(spacing)[..., None])
    return (along / modes).sum(axis=-1), (normal / modes).sum(axis=-1)


def _table(spacing: float, regularisation: float) -> FloatArray:
    """Return cubics in (h/Δs)² of both sums around a mean spacing Δs, shape (TABLE_SIZE, 8)."""
    knots = np.linspace(WIDEST**-2, WIDEST**2, TABLE_SIZE + 1)
    sums = missed(spacing * np.sqrt(knots), regularisation)
    cubics = [CubicSpline(knots, values).c[::-1].T for values in sums]
    return np.ascontiguousarray(np.concatenate(cubics, axis=1))


@compiled
def add_missed(
    positions: FloatArray,
    before: IndexArray,
    after: IndexArray,
    length: float,
    spacing: float,
    table: FloatArray,
    scale: float,
    forces: FloatArray,
    velocities: FloatArray,
) -> None:
    """Add the correction of nodes whose neighbours along the membrane are given.

    Parameters
    ----------
    positions
        Shape (nodes, 2); x periodic with ``length``.
    before, after
        Rows of each node's neighbours, shape (nodes,).
    spacing, table
        Mean spacing and table around it.
    scale
        -1/(4πη).
    forces, velocities
        Shape (nodes, 2); velocities are added to. A node whose membrane is stretched beyond
        `WIDEST` gets NaN, which the guards report.
    """
    least = WIDEST**-2
    per_unit = table.shape[0] / (WIDEST**2 - least)
    # The neighbours are two spacings apart.
    unit = 0.25 / (spacing * spacing)
    for s in range(forces.shape[0]):
        i, j = before[s], after[s]
        tx = positions[j, 0] - positions[i, 0]
        tx -= length * np.floor(tx / length + 0.5)
        ty = positions[j, 1] - positions[i, 1]
        squared = tx * tx + ty * ty
        place = (unit * squared - least) * per_unit
        if not 0 <= place < table.shape[0]:
            velocities[s] = math.nan
            continue
        cell = int(place)
        t = (place - cell) / per_unit
        row = table[cell]
        along = row[0] + t * (row[1] + t * (row[2] + t * row[3]))
        normal = row[4] + t * (row[5] + t * (row[6] + t * row[7]))
        fx, fy = forces[s, 0], forces[s, 1]
        more = (along - normal) * (fx * tx + fy * ty) / squared
        velocities[s, 0] += scale * (normal * fx + more * tx)
        velocities[s, 1] += scale * (normal * fy + more * ty)


class CorrectedQuadrature:
    """A mobility whose velocities at the nodes miss nothing of the nodes' own neighbourhood.

    Parameters
    ----------
    mobility
        The plain sum over nodes.
    layout
        Which nodes are neighbours, and their spacing.
    length
        Period L_x [length unit].
    regularisation, viscosity
        ε and η of the mobility.
    """

    def __init__(
        self,
        mobility: Mobility,
        layout: Layout,
        length: float,
        regularisation: float,
        viscosity: float,
    ) -> None:
        self._mobility = mobility
        self._length = length
        self._spacing = float(np.mean(layout.weights))
        self._table = _table(self._spacing, regularisation)
        self._scale = -1 / (4 * math.pi * viscosity)
        before, after = layout.neighbours
        self._before, self._after = before.astype(np.uint32), after.astype(np.uint32)

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        result = self._mobility.velocities(positions, forces)
        add_missed(
            positions,
            self._before,
            self._after,
            self._length,
            self._spacing,
            self._table,
            self._scale,
            forces,
            result,
        )
        return result

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the velocity at points that lie off the membranes; see `Mobility`.

        Farther from every membrane than a node spacing, the plain sum misses nothing.
        """
        return self._mobility.velocities_at(points, positions, forces)
