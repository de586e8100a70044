"""How fast particles move against their neighbours, at one moment."""

import numpy as np
import shapely
import xarray as xr

from softslip.analysis.observables.contours import contours, shapes
from softslip.analysis.observables.series import FloatArray, parameters_of
from softslip.errors import DatasetError

NEIGHBOURS = 3.0
"""Distance between centroids up to which particles are neighbours [mean radius]: in a dense packing
those that touch, six on average."""

FEWEST = 3
"""Fewest neighbours: two can always be moved affinely."""


def particle_velocities(run: xr.Dataset, snapshot: int) -> tuple[FloatArray, FloatArray]:
    """Return where particles are and how fast each moves as a whole.

    Parameters
    ----------
    run
        A shear run with snapshots.
    snapshot
        Which of them.

    Returns
    -------
    tuple of numpy.ndarray
        Centroids [length unit] and mean velocities [length unit / time unit] over the points of
        the kept field that lie inside, shape (particles, 2) each.

    Raises
    ------
    DatasetError
        When the field is so coarse that a particle has no point inside.
    """
    particles, _ = contours(run, snapshot)
    centroids, _ = shapes(particles)
    length = parameters_of(run).channel.length
    x, y = (run[name].values.astype(np.float64) for name in ("field_x", "field_y"))
    field = run["velocity"].transpose("snapshot", "field_y", "field_x", "axis").values[snapshot]
    found = np.empty_like(centroids)
    for number, (corners, centre) in enumerate(zip(particles, centroids, strict=True)):
        along = x - np.round((x - centre[0]) / length) * length
        (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
        columns = np.flatnonzero((along >= left) & (along <= right))
        rows = np.flatnonzero((y >= low) & (y <= high))
        points = np.meshgrid(along[columns], y[rows])
        inside = shapely.contains_xy(shapely.Polygon(corners), *points)
        if not inside.any():
            spacing = parameters_of(run).recording.field_spacing
            raise DatasetError(
                f"run {run.attrs.get('run', '?')}: its velocity field has no point inside particle "
                f"{number}; set recording.field_spacing, now {spacing:g}, to 0.5 or less"
            )
        found[number] = field[np.ix_(rows, columns)][inside].mean(axis=0)
    return centroids, found


def non_affine_speeds(
    centroids: FloatArray, velocities: FloatArray, length: float, reach: float
) -> FloatArray:
    """Return by how much each particle's neighbours depart from affine motion.

    The square of it is the least mean over the neighbours j of |v_j − v_i − J (r_j − r_i)|², among
    all velocity gradients J: the rate at which D²_min of Falk and Langer (Phys. Rev. E 57, 7192,
    1998) begins to grow, (D²_min)^½/Δt of an ever shorter Δt. It vanishes in any uniform flow, and
    needs no second moment, however far snapshots are apart.

    Parameters
    ----------
    centroids, velocities
        From `particle_velocities`.
    length
        Period along x [length unit].
    reach
        Distance up to which particles are neighbours, by their nearest images [length unit].

    Returns
    -------
    numpy.ndarray
        Speeds [length unit / time unit], shape (particles,); NaN with fewer than `FEWEST`
        neighbours.
    """
    apart = centroids[None] - centroids[:, None]
    apart[..., 0] -= np.round(apart[..., 0] / length) * length
    distance = np.hypot(apart[..., 0], apart[..., 1])
    found = np.full(len(centroids), np.nan)
    for number, (offsets, far) in enumerate(zip(apart, distance, strict=True)):
        near = np.flatnonzero((far <= reach) & (np.arange(len(far)) != number))
        if len(near) < FEWEST:
            continue
        relative = velocities[near] - velocities[number]
        gradient, *_ = np.linalg.lstsq(offsets[near], relative, rcond=None)
        departure = relative - offsets[near] @ gradient
        found[number] = np.sqrt((departure**2).sum(axis=1).mean())
    return found


def non_affine_motion(run: xr.Dataset, snapshot: int) -> tuple[FloatArray, FloatArray]:
    """Return the centroids of particles, and their non-affine speeds over the mean radius.

    Returns
    -------
    tuple of numpy.ndarray
        Centroids [length unit], shape (particles, 2), and `non_affine_speeds` over the mean radius
        [1 / time unit], shape (particles,), to be compared with the shear rate.

    Raises
    ------
    DatasetError
        See `particle_velocities`.
    """
    given = parameters_of(run)
    radius = given.suspension.mean_radius
    centroids, velocities = particle_velocities(run, snapshot)
    reach = NEIGHBOURS * radius
    return centroids, non_affine_speeds(centroids, velocities, given.channel.length, reach) / radius
