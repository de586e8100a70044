"""The regularised mobility as an Ewald sum: the mesh scheme's operator with less work.

In a periodic box, with ε the regularisation length,

    V(X_i) = Σ_j K_ε(X_i - X_j) F_j,    K̂_ε(k) = e^{-ε²k²} (I - k̂k̂ᵀ)/(η k²).

The mesh scheme responds in the same way up to O(k²) with ε of
`softslip.mobility.grid.regularisation_length`. The sum is split at a length a > ε,

    e^{-ε²k²} = far + near,    far = e^{-a²k²} [1 + (a² - ε²) k²],    near = O(k⁴),

so that ``far`` needs a mesh of spacing about a only, and ``near`` decays like a Gaussian in real
space. With c = r²/4, a force f at distance r causes the near velocity T_t f + (T_r - T_t)(f·r̂) r̂,

    2πη T_r = A₁,    2πη T_t = A₀ - A₁,
    A₀ = ½ [E₁(c/a²) - E₁(c/ε²)] - (a² - ε²)/(2a²) e^{-c/a²},
    A₁ r² = [s (1 - e^{-c/s}) + c E₁(c/s)]_{s=ε²}^{s=a²} - (a² - ε²)(1 - e^{-c/a²}).
"""

import math

import numpy as np
from scipy.fft import next_fast_len
from scipy.interpolate import CubicSpline
from scipy.special import exp1

from softslip.geometry import Box, FloatArray, IntArray
from softslip.kernels import compiled
from softslip.mobility.grid import inverse_or_zero
from softslip.mobility.transform import PeriodicTransform
from softslip.mobility.window import (
    gather_window,
    spread_window,
    window_polynomials,
    window_transform,
)
from softslip.neighbours import VerletList
from softslip.parameters import EWALD_REACH

MESH_RATIO = 1.05
"""Spacing of the far mesh over a: the modes beyond it weigh less than 2e-3."""

TABLE_SIZE = 4096
"""Intervals in r² of the near table, each with a cubic (relative error 2e-5)."""

SKIN = 0.25
"""Thickness of the Verlet skin over the reach of the near sum."""


def near_profiles(
    distance: FloatArray, regularisation: float, split: float
) -> tuple[FloatArray, FloatArray]:
    """Return 2πη T_t and 2πη (T_r - T_t) at positive distances, by the closed forms above.

    Parameters
    ----------
    distance
        r > 0 [length unit].
    regularisation, split
        ε and a [length unit].
    """
    c, s0, s1 = 0.25 * distance**2, regularisation**2, split**2
    a0 = 0.5 * (exp1(c / s1) - exp1(c / s0)) - 0.5 * (s1 - s0) / s1 * np.exp(-c / s1)
    upper = -s1 * np.expm1(-c / s1) + c * exp1(c / s1)
    lower = -s0 * np.expm1(-c / s0) + c * exp1(c / s0)
    a1 = (upper - lower + (s1 - s0) * np.expm1(-c / s1)) / distance**2
    return a0 - a1, 2 * a1 - a0


def near_on_itself(regularisation: float, split: float) -> float:
    """Return 2πη T_t = 2πη T_r at zero distance."""
    ratio = (regularisation / split) ** 2
    return -0.25 * (math.log(ratio) + 1 - ratio)


def near_table(regularisation: float, split: float) -> FloatArray:
    """Return cubics in r² of 2πη T_t and of 2πη (T_r - T_t)/r², shape (TABLE_SIZE, 8)."""
    squared = np.linspace(0, (EWALD_REACH * split) ** 2, TABLE_SIZE + 1)
    # The closed forms cancel at zero; so close to it the functions no longer change.
    inner = np.maximum(squared, 1e-3 * squared[1])
    tangential, excess = near_profiles(np.sqrt(inner), regularisation, split)
    cubics = [CubicSpline(squared, values).c[::-1].T for values in (tangential, excess / inner)]
    return np.ascontiguousarray(np.concatenate(cubics, axis=1))


@compiled
def add_near(
    positions: FloatArray,
    forces: FloatArray,
    starts: IntArray,
    partners: IntArray,
    length: float,
    reach: float,
    table: FloatArray,
    on_itself: float,
    scale: float,
    velocities: FloatArray,
) -> None:
    """Add the near velocities of all pairs closer than the reach, and of each node on itself.

    Parameters
    ----------
    positions, forces
        Shape (nodes, 2); x periodic with ``length``.
    starts, partners
        Pairs of `softslip.neighbours.find_pairs`, complete within ``reach``.
    table, on_itself
        From `near_table` and `near_on_itself`.
    scale
        1/(2πη).
    velocities
        Added to, shape (nodes, 2).
    """
    cutoff = reach * reach
    width = cutoff / table.shape[0]
    for i in range(starts.size - 1):
        fx, fy = forces[i, 0], forces[i, 1]
        ux, uy = on_itself * fx, on_itself * fy
        for k in range(starts[i], starts[i + 1]):
            j = partners[k]
            dx = positions[j, 0] - positions[i, 0]
            dx -= length * math.floor(dx / length + 0.5)
            dy = positions[j, 1] - positions[i, 1]
            squared = dx * dx + dy * dy
            if squared >= cutoff:
                continue
            cell = min(int(squared / width), table.shape[0] - 1)
            t = squared - cell * width
            row = table[cell]
            tangential = row[0] + t * (row[1] + t * (row[2] + t * row[3]))
            excess = row[4] + t * (row[5] + t * (row[6] + t * row[7]))
            gx, gy = forces[j, 0], forces[j, 1]
            there = excess * (gx * dx + gy * dy)
            back = excess * (fx * dx + fy * dy)
            ux += tangential * gx + there * dx
            uy += tangential * gy + there * dy
            velocities[j, 0] += scale * (tangential * fx + back * dx)
            velocities[j, 1] += scale * (tangential * fy + back * dy)
        velocities[i, 0] += scale * ux
        velocities[i, 1] += scale * uy


class EwaldMobility:
    """Regularised Stokes flow between nodes in a doubly periodic box, as an Ewald sum.

    Nodes must lie within the channel: the near sum sees images along x, but none across the
    outer gap, which must not be thinner than its reach (`softslip.parameters` checks both).

    Parameters
    ----------
    box
        The periodic box.
    regularisation
        Regularisation length ε [length unit].
    viscosity
        η.
    split
        Split length a > ε [length unit]: a longer one moves work from the far to the near sum and
        changes the result by the error of the sums only, about 1e-4.
    """

    def __init__(self, box: Box, regularisation: float, viscosity: float, split: float) -> None:
        self._length, self._reach = box.length, EWALD_REACH * split
        nx, ny = (
            next_fast_len(math.ceil(side / (MESH_RATIO * split)), real=True)
            for side in (box.length, box.period)
        )
        self._spacing = (box.length / nx, box.period / ny)
        self._kx = 2 * np.pi * np.fft.fftfreq(nx, self._spacing[0])[:, None]
        self._ky = 2 * np.pi * np.fft.rfftfreq(ny, self._spacing[1])[None, :]
        self._response = self._far_response(box, regularisation, viscosity, split)
        self._polynomials = window_polynomials()
        self._transform = PeriodicTransform(2, nx, ny)
        self._table = near_table(regularisation, split)
        self._on_itself = near_on_itself(regularisation, split)
        self._scale = 1 / (2 * math.pi * viscosity)
        self._near = VerletList(box.length, self._reach, SKIN * self._reach)

    def _far_response(
        self, box: Box, regularisation: float, viscosity: float, split: float
    ) -> FloatArray:
        """Return far/(η k⁴) over both windows' transforms, from forces to streamfunction modes."""
        squared = self._kx**2 + self._ky**2
        difference = split**2 - regularisation**2
        far = np.exp(-(split**2) * squared) * (1 + difference * squared)
        window = window_transform(self._kx, self._spacing[0]) * window_transform(
            self._ky, self._spacing[1]
        )
        cell = self._spacing[0] * self._spacing[1]
        inverse = inverse_or_zero(viscosity * squared**2 * window**2)
        response: FloatArray = far * inverse * cell**2 / (box.length * box.period)
        return response

    def _far(self, points: FloatArray, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the far velocities at any points, shape (points, 2)."""
        mesh, modes = self._transform.field, self._transform.modes
        mesh[:] = 0.0
        spread_window(positions, forces, self._spacing, self._polynomials, mesh)
        self._transform.forward()
        streamfunction = (self._ky * modes[0] - self._kx * modes[1]) * self._response
        np.multiply(self._ky, streamfunction, out=modes[0])
        np.multiply(-self._kx, streamfunction, out=modes[1])
        self._transform.backward()
        result = np.empty_like(points)
        gather_window(points, mesh, self._spacing, self._polynomials, result)
        return result

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        result = self._far(positions, positions, forces)
        count = len(positions)
        starts, partners = self._near.pairs(positions, np.arange(count), count)
        add_near(
            positions,
            forces,
            starts,
            partners,
            self._length,
            self._reach,
            self._table,
            self._on_itself,
            self._scale,
            result,
        )
        return result

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the regularised velocity at any points, shape (points, 2); see `Mobility`.

        Points are nodes without force.
        """
        everywhere = np.concatenate((points, positions))
        without = np.zeros_like(points)
        return self.velocities(everywhere, np.concatenate((without, forces)))[: len(points)]
