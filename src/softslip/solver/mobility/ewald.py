"""The regularised mobility as an Ewald sum: the mesh scheme's operator with less work.

In a periodic box, with ε the regularisation length,

    V(X_i) = Σ_j K_ε(X_i - X_j) F_j,    K̂_ε(k) = e^{-ε²k²} (I - k̂k̂ᵀ)/(η k²).

The mesh scheme responds in the same way up to O(k²) with ε of
`solver.mobility.grid.regularisation_length`. The sum is split,

    e^{-ε²k²} = far + near,

``far`` being a smooth blob of force as wide as the reach, for which a coarse mesh does, and
``near`` a sum over pairs within the reach (`solver.mobility.near` says what both are).
"""

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from softslip.solver.compilation import compiled
from softslip.solver.geometry import Box, FloatArray, IndexArray, IntArray
from softslip.solver.mobility.grid import inverse_or_zero
from softslip.solver.mobility.near import (
    MESH_REACH,
    RigidPairs,
    add_near,
    far_factor,
    near_on_itself,
    near_table,
)
from softslip.solver.mobility.transform import PaddedTransform
from softslip.solver.mobility.window import (
    WIDTH,
    fill_margins,
    fold_margins,
    gather_window,
    spread_window,
    window_transform,
)
from softslip.solver.neighbours import VerletList, find_pairs
from softslip.solver.splitting import EWALD_REACH

SKIN = 0.1
"""Thickness of the Verlet skin over the reach of the near sum: balances rebuilding and listing."""

TRANSFORM_COST = {1: 1.0, 5: 1.1, 25: 1.2, 3: 1.35, 15: 1.45, 9: 1.6}
"""Sizes of Fourier transforms, as odd factors of a power of two, and what a point of them costs
over one of a power of two (measured from 64 to 512)."""


def mesh_lines(fewest: float) -> int:
    """Return the cheapest number of mesh lines, an even one, that is not below ``fewest``."""
    sizes = {
        odd << max(math.ceil(math.log2(fewest / odd)), 1): cost
        for odd, cost in TRANSFORM_COST.items()
    }
    return min(sizes, key=lambda size: size * sizes[size])


@compiled
def respond(
    modes: NDArray[np.complex128], straight: FloatArray, crossed: NDArray[np.complex128]
) -> None:
    """Turn modes of the force into modes of the velocity, both as complex fields.

    For f = f_x + i f_y with modes F(k), the velocity u_x + i u_y has ½g [F(k) - (k_c²/k²) F*(-k)],
    k_c = k_x + i k_y: ``straight`` is ½g and ``crossed`` is -½g k_c²/k², both even in k.
    """
    nx, ny = modes.shape
    for i in range(nx // 2 + 1):
        opposite = (nx - i) % nx
        for j in range(ny if i != opposite else ny // 2 + 1):
            other = (ny - j) % ny
            here, there = modes[i, j], modes[opposite, other]
            modes[i, j] = straight[i, j] * here + crossed[i, j] * np.conj(there)
            modes[opposite, other] = straight[i, j] * there + crossed[i, j] * np.conj(here)


class EwaldMobility:
    """Regularised Stokes flow between nodes in a doubly periodic box, as an Ewald sum.

    Nodes must lie within the channel: the near sum sees images along x, but none across the
    outer gap, which must not be thinner than its reach (`config.checks` sees to both).

    Parameters
    ----------
    box
        The periodic box.
    regularisation
        Regularisation length ε [length unit].
    viscosity
        η.
    split
        Split length a > ε [length unit]: the near sum reaches no farther than `EWALD_REACH` times
        a. A longer one moves work from the far to the near sum and changes the result by the error
        of the sums only, about 1e-4; see `solver.splitting.best_split`.
    rigid
        Reference positions of wall nodes, shape (rows, 2), the lower wall's and then as many of
        the upper one's. They are the last nodes of every call, each wall displaced as a whole
        along x, so that their near pairs need working out only once.
    threads
        With more than one the far and the near sum run side by side, for the same bits.

    Attributes
    ----------
    shape
        Lines of the far mesh along x and y.
    reach
        Reach of the near sum [length unit].
    pairs
        Number of near pairs in the last evaluation, rigid ones included.

    Raises
    ------
    ValueError
        When the rigid walls are within each other's reach, so that their pairs change.
    """

    def __init__(
        self,
        box: Box,
        regularisation: float,
        viscosity: float,
        split: float,
        *,
        rigid: FloatArray | None = None,
        threads: int = 1,
    ) -> None:
        self._periods = (box.length, box.period)
        finest = math.pi * EWALD_REACH * split / MESH_REACH
        nx, ny = self.shape = (mesh_lines(box.length / finest), mesh_lines(box.period / finest))
        # Rounding up the lines has made the mesh finer: the near sum need not reach as far.
        self.reach = MESH_REACH / math.pi * max(box.length / nx, box.period / ny)
        self._straight, self._crossed = self._response(regularisation, viscosity)
        self._transform = PaddedTransform(nx, ny, WIDTH)
        self._table, self._first_cell = near_table(regularisation, self.reach)
        self._scale = 1 / (2 * math.pi * viscosity)
        self._on_itself = self._scale * near_on_itself(regularisation, self.reach)
        self._list = VerletList(box.length, self.reach, SKIN * self.reach)
        self._listed: tuple[IntArray, IntArray] | None = None
        self._partners: IndexArray = np.empty(0, np.uint32)
        self._rigid = RigidPairs.none() if rigid is None else self._rigid_pairs(rigid)
        self._aside = ThreadPoolExecutor(1) if threads > 1 else None
        self.pairs = 0

    def _response(
        self, regularisation: float, viscosity: float
    ) -> tuple[FloatArray, NDArray[np.complex128]]:
        """Return what `respond` takes, both windows divided out."""
        nx, ny = self.shape
        spacing = (self._periods[0] / nx, self._periods[1] / ny)
        kx = 2 * np.pi * np.asarray(np.fft.fftfreq(nx, spacing[0]), np.float64)[:, None]
        ky = 2 * np.pi * np.asarray(np.fft.fftfreq(ny, spacing[1]), np.float64)[None, :]
        squared = kx**2 + ky**2
        window = window_transform(kx, spacing[0]) * window_transform(ky, spacing[1])
        far = far_factor(np.sqrt(squared), regularisation, self.reach)
        straight = 0.5 * far * inverse_or_zero(viscosity * squared * window**2)
        straight *= spacing[0] * spacing[1] / (nx * ny)
        # Neither sign of the highest wavenumber is the right one; the blob has next to none of it.
        straight[nx // 2] = straight[:, ny // 2] = 0.0
        crossed: NDArray[np.complex128] = -straight * (kx + 1j * ky) ** 2 * inverse_or_zero(squared)
        return straight, crossed

    def _rigid_pairs(self, rigid: FloatArray) -> RigidPairs:
        lower, upper = rigid.reshape(2, -1, 2)
        apart = upper[:, 1].min() - lower[:, 1].max()
        if apart < self.reach:
            raise ValueError(
                f"the walls come within {apart:.3g} of each other, less than {self.reach:.3g}, the "
                "reach of the near sum: use a smaller split or no rigid nodes"
            )
        count, length = len(rigid), self._periods[0]
        starts, partners = find_pairs(rigid, np.arange(count), count, length, self.reach)
        return RigidPairs(
            rigid, starts, partners, length, self._table, self._first_cell, self._scale
        )

    def _spread(self, points: FloatArray, forces: FloatArray) -> None:
        """Set the far mesh to the forces; points and forces have shape (2, nodes)."""
        mesh = self._transform.mesh
        mesh[:] = 0.0
        spread_window(points, forces, self._periods, mesh)
        fold_margins(mesh)

    def _solve(self) -> None:
        """Turn the forces on the far mesh into velocities."""
        self._transform.forward()
        respond(self._transform.modes, self._straight, self._crossed)
        self._transform.backward()

    def _gather(self, points: FloatArray) -> FloatArray:
        """Return the far velocities at points of shape (2, points), shape (points, 2)."""
        mesh = self._transform.mesh
        fill_margins(mesh)
        result = np.empty((points.shape[1], 2))
        gather_window(points, mesh, self._periods, result)
        return result

    def near_pairs(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the pairs of nodes that may be within the reach, rigid ones left out."""
        count = len(positions)
        free = count - self._rigid.nodes
        if not free:
            # Between walls alone, whose pairs are rigid: nothing to search for, or to keep.
            return np.zeros(count + 1, np.int64), np.empty(0, np.int64)
        return self._list.pairs(positions, np.arange(count), free)

    def _listed_pairs(self, positions: FloatArray) -> tuple[IntArray, IndexArray]:
        """Return the same pairs with small indices."""
        listed = self.near_pairs(positions)
        if listed is not self._listed:
            self._listed, self._partners = listed, listed[1].astype(np.uint32)
        return listed[0], self._partners

    def _add_near(
        self,
        points: FloatArray,
        forces: FloatArray,
        listed: tuple[IntArray, IndexArray],
        velocities: FloatArray,
    ) -> None:
        """Add the near velocities of nodes; all arrays have shape (nodes, 2)."""
        velocities += self._on_itself * forces
        free_pairs = add_near(
            points,
            forces,
            *listed,
            self._periods[0],
            self.reach,
            self._table,
            self._first_cell,
            self._scale,
            velocities,
        )
        first = len(velocities) - self._rigid.nodes
        self._rigid.add(forces[first:], velocities[first:])
        self.pairs = free_pairs + self._rigid.pairs

    def _far(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        points = positions.T.copy()
        self._spread(points, forces.T.copy())
        self._solve()
        return self._gather(points)

    def _near(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        result = np.zeros_like(positions)
        self._add_near(positions, forces, self._listed_pairs(positions), result)
        return result

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        positions, forces = np.ascontiguousarray(positions), np.ascontiguousarray(forces)
        if self._aside is None:
            near = self._near(positions, forces)
            return self._far(positions, forces) + near
        pending = self._aside.submit(self._near, positions, forces)
        far = self._far(positions, forces)
        return far + pending.result()

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the regularised velocity at any points, shape (points, 2); see `Mobility`.

        Points are nodes without force, which have no pairs with each other.
        """
        count = len(points)
        everywhere = np.concatenate((points, positions))
        without = np.concatenate((np.zeros_like(points), forces))
        self._spread(positions.T.copy(), forces.T.copy())
        self._solve()
        result = self._gather(everywhere.T.copy())
        body = np.concatenate((np.zeros(count, np.int64), 1 + np.arange(len(positions))))
        free = 1 + len(positions) - self._rigid.nodes
        starts, partners = find_pairs(everywhere, body, free, self._periods[0], self.reach)
        self._add_near(everywhere, without, (starts, partners.astype(np.uint32)), result)
        return result[:count]
