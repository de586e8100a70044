"""Shapes of particles and their films along the walls, at one moment."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from softslip.analysis.observables.series import FloatArray

IntArray = NDArray[np.int64]


def contours(run: xr.Dataset, snapshot: int) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the nodes of each particle, and of the lower and the upper wall.

    Returns
    -------
    tuple of list of numpy.ndarray
        Each of shape (nodes, 2); a particle is in one piece, whatever period it lies in.
    """
    nodes = run["node_position"].transpose("snapshot", "node", "axis").values[snapshot]
    sizes = run["nodes_per_particle"].values.astype(int)
    wall = int(run.attrs["wall_nodes"])
    *particles, lower, upper = np.split(nodes, np.cumsum([*sizes, wall]))
    return particles, [lower, upper]


def shapes(particles: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return centroids of polygons and how they are stretched.

    Parameters
    ----------
    particles
        Corners of each polygon, shape (corners, 2).

    Returns
    -------
    tuple of numpy.ndarray
        Centroids, shape (particles, 2), and D (cos 2θ, sin 2θ), shape (particles, 2), with
        D = (a − b)/(a + b) of the semi-axes a ≥ b of the ellipse of the same second moments of
        area, and θ the angle of its long axis to x.
    """
    found = [_moments(corners) for corners in particles]
    centroids = np.array([centroid for centroid, _ in found]).reshape(-1, 2)
    return centroids, np.array([_stretch(moments) for _, moments in found]).reshape(-1, 2)


def _moments(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centroid of a polygon and its second moments of area about that, (2, 2)."""
    origin = corners.mean(axis=0)
    here = corners - origin
    after = np.roll(here, -1, axis=0)
    cross = here[:, 0] * after[:, 1] - after[:, 0] * here[:, 1]
    area = 0.5 * cross.sum()
    centroid = ((here + after) * cross[:, None]).sum(axis=0) / (6 * area)
    both = here + after
    products = np.einsum("n,ni,nj->ij", cross, here, here)
    products += np.einsum("n,ni,nj->ij", cross, after, after)
    products += np.einsum("n,ni,nj->ij", cross, both, both)
    return origin + centroid, products / (24 * area) - np.outer(centroid, centroid)


def _stretch(moments: FloatArray) -> FloatArray:
    """Return D (cos 2θ, sin 2θ) of second moments."""
    (small, large), axes = np.linalg.eigh(moments)
    long, short = np.sqrt(large), np.sqrt(small)
    x, y = axes[:, 1]
    return np.asarray((long - short) / (long + short) * np.array([x * x - y * y, 2 * x * y]))


def film_thickness(
    wall: FloatArray, particles: Sequence[FloatArray], length: float
) -> tuple[FloatArray, IntArray]:
    """Return the distance of each node of a wall to the nearest membrane, and which that is.

    Parameters
    ----------
    wall
        Nodes, shape (nodes, 2).
    particles
        See `shapes`.
    length
        Period along x.

    Returns
    -------
    tuple of numpy.ndarray
        Distances to the polygons' sides that meet in the nearest node, and the number of the
        particle, both of shape (nodes,).
    """
    corners = np.concatenate(particles)
    before = np.concatenate([np.roll(each, 1, axis=0) for each in particles])
    after = np.concatenate([np.roll(each, -1, axis=0) for each in particles])
    # Wide enough for no image but those along x to be seen.
    span = 4 * (np.ptp(np.concatenate((corners[:, 1], wall[:, 1]))) + length)
    low = min(corners[:, 1].min(), wall[:, 1].min())

    def wrapped(points: FloatArray) -> FloatArray:
        along = np.mod(points[:, 0], length)
        # A tiny negative number rounds to the period itself.
        return np.column_stack((np.where(along >= length, 0.0, along), points[:, 1] - low))

    _, nearest = cKDTree(wrapped(corners), boxsize=(length, span)).query(wrapped(wall))
    shift = np.round((wall[:, 0] - corners[nearest, 0]) / length) * length
    point = wall - np.column_stack((shift, np.zeros(len(wall))))
    ends = (before[nearest], after[nearest])
    film = np.minimum(*(_to_side(point, corners[nearest], end) for end in ends))
    return film, np.repeat(np.arange(len(particles)), [len(each) for each in particles])[nearest]


def _to_side(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return distances of points to segments, all of shape (points, 2)."""
    side, offset = end - start, point - start
    share = np.einsum("ni,ni->n", offset, side) / np.einsum("ni,ni->n", side, side)
    nearest = np.clip(share, 0.0, 1.0)[:, None] * side
    return np.asarray(np.linalg.norm(offset - nearest, axis=1))
