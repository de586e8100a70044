"""Outlines of particles and walls as they are drawn: each whole, with its periodic images."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def images(contour: FloatArray, length: float) -> Iterator[tuple[int, FloatArray]]:
    """Yield the images of a particle that are seen between 0 and a period, each with its number.

    Parameters
    ----------
    contour
        Nodes of its membrane, shape (nodes, 2).
    length
        Period along x.
    """
    start = np.floor(contour[:, 0].min() / length) * length
    along = contour[:, 0] - start
    for number in range(int(np.floor(along.max() / length)) + 1):
        yield number, np.column_stack((along - number * length, contour[:, 1]))


def tiled(wall: FloatArray, length: float) -> FloatArray:
    """Return a wall's contour along [-L_x, 2 L_x], from left to right along the wall."""
    start = np.floor(wall[:, 0].min() / length) * length
    shifted = wall - [start, 0.0]
    return np.concatenate([np.add(shifted, (shift * length, 0.0)) for shift in (-2, -1, 0, 1, 2)])


def wall_bodies(
    walls: Sequence[FloatArray], length: float, height: float, depth: float
) -> list[FloatArray]:
    """Return polygons of the walls, which reach beyond ``depth`` outside the channel."""
    found = []
    for wall, outside in zip(walls, (-2 * depth, height + 2 * depth), strict=True):
        contour = tiled(wall, length)
        ends = [[contour[-1, 0], outside], [contour[0, 0], outside]]
        found.append(np.concatenate((contour, ends)))
    return found
