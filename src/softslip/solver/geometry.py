"""Channel frame, wall contours and the layout of nodes.

The channel frame has x along the flow, periodic with L_x, and y across it: the flat part of the
lower wall lies at y = 0, that of the upper wall at y = H, and the solvent outside the walls at
H < y < L_y, which is the same as -(L_y - H) < y < 0.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.uint32]
BoolArray = NDArray[np.bool_]

LOWER, UPPER = 0, 1
"""Index of each wall wherever an array has one entry a wall."""


@dataclass(frozen=True)
class Box:
    """Doubly periodic box with a channel inside.

    Attributes
    ----------
    length
        Period L_x along the flow [length unit].
    height
        Distance H between the flat parts of the walls [length unit].
    outer_gap
        Thickness L_y - H of the solvent outside the walls [length unit].
    """

    length: float
    height: float
    outer_gap: float

    @property
    def period(self) -> float:
        """Period L_y across the flow [length unit]."""
        return self.height + self.outer_gap


@dataclass(frozen=True)
class WallContour:
    """The lower wall: a flat line with equally spaced semicircular bumps towards the channel.

    The upper wall is its mirror image about the middle of the channel.

    Attributes
    ----------
    length
        Period L_x [length unit].
    bump_radius
        Radius b [length unit]; 0 for a smooth wall.
    bumps
        Number of bumps in a period.
    """

    length: float
    bump_radius: float
    bumps: int

    @classmethod
    def fitted(cls, length: float, bump_radius: float, separation: float) -> "WallContour":
        """Return the contour with the whole number of bumps nearest to a separation.

        Parameters
        ----------
        length
            Period L_x [length unit].
        bump_radius
            Radius b [length unit]; 0 for a smooth wall.
        separation
            Wanted B/b.
        """
        if bump_radius == 0:
            return cls(length, 0.0, 0)
        return cls(length, bump_radius, max(1, round(length / (separation * bump_radius))))

    @property
    def arc_length(self) -> float:
        """Length of the contour over one period [length unit]."""
        return self.length + self.bumps * (math.pi - 2) * self.bump_radius

    @property
    def bump_area(self) -> float:
        """Channel area that the bumps of one wall take up [length unit squared]."""
        return 0.5 * self.bumps * math.pi * self.bump_radius**2

    @property
    def separation(self) -> float:
        """Actual distance B between bump centres [length unit]; infinite for a smooth wall."""
        return self.length / self.bumps if self.bumps else math.inf

    def points(self, count: int) -> FloatArray:
        """Return ``count`` points equally spaced along the contour, shape (count, 2)."""
        arc = (np.arange(count) + 0.5) * (self.arc_length / count)
        if self.bumps == 0:
            return np.column_stack((arc, np.zeros(count)))
        b, separation = self.bump_radius, self.separation
        cell_length = self.arc_length / self.bumps
        cell, local = np.divmod(arc, cell_length)
        rise = 0.5 * separation - b
        angle = np.clip((local - rise) / b, 0.0, math.pi)
        after = np.maximum(local - rise - math.pi * b, 0.0)
        x = np.minimum(local, rise) + b * (1 - np.cos(angle)) + after
        return np.column_stack((cell * separation + x, b * np.sin(angle)))


def polygon_area(x: FloatArray, y: FloatArray) -> float:
    """Return the signed area of a closed polygon, positive when it runs anticlockwise."""
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def chain_neighbours(offsets: IntArray) -> tuple[IntArray, IntArray]:
    """Return the rows before and after every node along its own closed chain, each (nodes,).

    Parameters
    ----------
    offsets
        First row of each chain and, last, the number of nodes, shape (chains + 1,).
    """
    rows = np.arange(offsets[-1])
    before, after = rows - 1, rows + 1
    before[offsets[:-1]] = offsets[1:] - 1
    after[offsets[1:] - 1] = offsets[:-1]
    return before, after


@dataclass(frozen=True)
class Layout:
    """Which rows of a node array belong to which membrane or wall, and what each row weighs.

    Particle nodes come first, membrane by membrane, each anticlockwise; then the lower wall's
    nodes, then the upper wall's.

    Attributes
    ----------
    offsets
        First row of each particle and, last, the first row of the lower wall, shape (P + 1,).
    spacing
        Quadrature weight Δs of the nodes of each particle [length unit], shape (P,).
    wall_reference
        Positions of the wall nodes at zero wall displacement, shape (2, nodes of one wall, 2).
    wall_spacing
        Quadrature weight Δs of the wall nodes [length unit].
    """

    offsets: IntArray
    spacing: FloatArray
    wall_reference: FloatArray
    wall_spacing: float

    @property
    def particles(self) -> int:
        """Number of particles."""
        return len(self.offsets) - 1

    @property
    def particle_nodes(self) -> int:
        """Number of nodes on all particles together."""
        return int(self.offsets[-1])

    @property
    def wall_nodes(self) -> int:
        """Number of nodes of one wall."""
        return int(self.wall_reference.shape[1])

    @property
    def nodes(self) -> int:
        """Number of all nodes."""
        return self.particle_nodes + 2 * self.wall_nodes

    def wall_rows(self, wall: int) -> slice:
        """Return the rows of one wall's nodes."""
        first = self.particle_nodes + wall * self.wall_nodes
        return slice(first, first + self.wall_nodes)

    @cached_property
    def weights(self) -> FloatArray:
        """Quadrature weight Δs of every node [length unit], shape (nodes,)."""
        return np.concatenate(
            (
                np.repeat(self.spacing, np.diff(self.offsets)),
                np.full(2 * self.wall_nodes, self.wall_spacing),
            )
        )

    @cached_property
    def body(self) -> IntArray:
        """Body of every node: its particle's number, or P and P + 1 for the walls, (nodes,)."""
        sizes = np.append(np.diff(self.offsets), [self.wall_nodes, self.wall_nodes])
        return np.repeat(np.arange(self.particles + 2), sizes)

    @cached_property
    def chains(self) -> IntArray:
        """First row of each particle and wall and, last, the number of nodes, shape (P + 3,)."""
        walls = self.particle_nodes + self.wall_nodes * np.arange(1, 3)
        return np.concatenate((self.offsets, walls))

    @cached_property
    def neighbours(self) -> tuple[IntArray, IntArray]:
        """Rows before and after every node along its own membrane or wall, each (nodes,)."""
        return chain_neighbours(self.chains)

    @cached_property
    def reference_area(self) -> FloatArray:
        """Area of each particle: that of the circle whose nodes lie Δs apart, shape (P,)."""
        return (self.spacing * np.diff(self.offsets)) ** 2 / (4 * math.pi)


def wall_positions(contour: WallContour, height: float, spacing: float) -> FloatArray:
    """Return both walls' nodes about a spacing apart, shape (2, nodes of one wall, 2)."""
    lower = contour.points(max(round(contour.arc_length / spacing), 8))
    upper = np.column_stack((lower[:, 0], height - lower[:, 1]))
    return np.stack((lower, upper))
