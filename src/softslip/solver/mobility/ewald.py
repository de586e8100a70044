"""The regularised mobility as an Ewald sum: the mesh scheme's operator with less work.

In a periodic box, with ε the regularisation length,

    V(X_i) = Σ_j K_ε(X_i - X_j) F_j,    K̂_ε(k) = e^{-ε²k²} (I - k̂k̂ᵀ)/(η k²).

The mesh scheme responds in the same way up to O(k²) with ε of
`solver.mobility.grid.regularisation_length`. The sum is split,

    e^{-ε²k²} = far + near,

``far`` being a smooth blob of force as wide as the reach, for which a coarse mesh does, and
``near`` a sum over pairs within the reach (`solver.mobility.blob` says what both are).
"""

import math
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
from numpy.typing import NDArray

from softslip.solver.clusters import Slots
from softslip.solver.compilation import compiled
from softslip.solver.geometry import Box, FloatArray, IntArray
from softslip.solver.mobility.blob import MESH_REACH, Blob
from softslip.solver.mobility.grid import inverse_or_zero
from softslip.solver.mobility.near import NearSum
from softslip.solver.mobility.rigid import RigidPairs
from softslip.solver.mobility.transform import PaddedTransform
from softslip.solver.mobility.window import (
    WIDTH,
    fill_margins,
    fold_margins,
    gather_window,
    spread_window,
    window_transform,
)
from softslip.solver.neighbours import find_pairs
from softslip.solver.splitting import EWALD_REACH
from softslip.solver.verlet_list import VerletList

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
        self._over_reach = (box.length / self.reach, box.period / self.reach)
        self._blob = Blob.fitted(regularisation / self.reach)
        self._straight, self._crossed = self._response(viscosity)
        self._transform = PaddedTransform(nx, ny, WIDTH)
        self._scale = 1 / (2 * math.pi * viscosity)
        self._list = VerletList(box.length, self.reach, SKIN * self.reach)
        self._rigid = RigidPairs.none() if rigid is None else self._rigid_pairs(rigid)
        self._aside = ThreadPoolExecutor(1) if threads > 1 else None
        self._room = _Room(self._blob, Slots([0, 0]), 1.0)
        self.pairs = 0

    def _response(self, viscosity: float) -> tuple[FloatArray, NDArray[np.complex128]]:
        """Return what `respond` takes, both windows divided out."""
        nx, ny = self.shape
        spacing = (self._periods[0] / nx, self._periods[1] / ny)
        kx = 2 * np.pi * np.asarray(np.fft.fftfreq(nx, spacing[0]), np.float64)[:, None]
        ky = 2 * np.pi * np.asarray(np.fft.fftfreq(ny, spacing[1]), np.float64)[None, :]
        squared = kx**2 + ky**2
        window = window_transform(kx, spacing[0]) * window_transform(ky, spacing[1])
        far = self._blob.far_factor(self.reach * np.sqrt(squared))
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
        return RigidPairs(rigid, starts, partners, length, self._blob, self.reach, self._scale)

    def _spread(self, room: "_Room") -> None:
        """Set the far mesh to the forces."""
        mesh = self._transform.mesh
        mesh[:] = 0.0
        spread_window(room.points, room.forces, self._over_reach, mesh)
        fold_margins(mesh)

    def _solve(self) -> None:
        """Turn the forces on the far mesh into velocities."""
        self._transform.forward()
        respond(self._transform.modes, self._straight, self._crossed)
        self._transform.backward()

    def _gather(self, room: "_Room") -> None:
        """Fill the far velocities."""
        mesh = self._transform.mesh
        fill_margins(mesh)
        gather_window(room.points, mesh, self._over_reach, room.far)

    def near_pairs(self, positions: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the pairs of nodes that may be within the reach, rigid ones left out."""
        count = len(positions)
        free = count - self._rigid.nodes
        if not free:
            # Between walls alone, whose pairs are rigid: nothing to search for, or to keep.
            return _nothing_listed(count)
        return self._list.pairs(positions, np.arange(count), free)

    def _far(self, room: "_Room") -> None:
        self._spread(room)
        self._solve()
        self._gather(room)

    def _near(self, room: "_Room", listed: tuple[IntArray, IntArray]) -> int:
        """Fill the near velocities and return the number of pairs."""
        return room.near_sum.fill(room.points, room.forces, listed, room.near)

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the fluid velocity at the nodes, shape (nodes, 2); see `Mobility`."""
        positions, forces = np.ascontiguousarray(positions), np.ascontiguousarray(forces)
        count, free = len(positions), len(positions) - self._rigid.nodes
        if self._room.slots.nodes != count:
            self._room = _Room(self._blob, Slots([0, free, count]), self._over_reach[0])
        room, listed = self._room, self.near_pairs(positions)
        room.take(positions, forces, self.reach)
        if self._aside is None:
            found = self._near(room, listed)
            self._far(room)
        else:
            pending = self._aside.submit(self._near, room, listed)
            self._far(room)
            found = pending.result()
        self.pairs = found + self._rigid.pairs
        result = np.empty_like(positions)
        self._give(room, forces, result)
        return result

    def _give(self, room: "_Room", forces: FloatArray, result: FloatArray) -> None:
        """Set the velocities of all nodes, shape (nodes, 2), to the sum of their parts."""
        room.slots.sum_of(room.far, room.near, self._scale, result)
        first = len(result) - self._rigid.nodes
        self._rigid.add(forces[first:], result[first:])

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the regularised velocity at any points, shape (points, 2); see `Mobility`.

        Points are nodes without force, which have no pairs with each other.
        """
        count, nodes = len(points), len(positions)
        everywhere = np.concatenate((points, positions))
        without = np.concatenate((np.zeros_like(points), forces))
        # Bodies whose nodes are no pairs: all points, and all nodes.
        body = np.repeat([0, 1], [count, nodes])
        listed = find_pairs(everywhere, body, 2, self._periods[0], self.reach)
        room = _Room(self._blob, Slots([0, count, count + nodes]), self._over_reach[0])
        room.take(everywhere, without, self.reach)
        self._near(room, listed)
        self._far(room)
        result = np.empty_like(everywhere)
        room.slots.sum_of(room.far, room.near, self._scale, result)
        return result[:count]


class _Room:
    """Arrays of an evaluation, in slots, used again by the next.

    Attributes
    ----------
    points, forces
        Places over the reach, and forces, shape (2, slots).
    near, far
        Velocities, the near ones over 1/(2πη), shape (2, slots).
    """

    def __init__(self, blob: Blob, slots: Slots, length: float) -> None:
        self.slots, self.near_sum = slots, NearSum(blob, slots, length)
        self.points, self.forces = slots.places(), slots.values()
        self.near, self.far = slots.values(), slots.values()

    def take(self, positions: FloatArray, forces: FloatArray, reach: float) -> None:
        """Take the nodes of an evaluation, shape (nodes, 2)."""
        self.slots.fill(positions, 1 / reach, self.points)
        self.slots.fill(forces, 1.0, self.forces)


@cache
def _nothing_listed(count: int) -> tuple[IntArray, IntArray]:
    return np.zeros(count + 1, np.int64), np.empty(0, np.int64)
