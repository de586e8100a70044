"""The particles and walls of a run's last snapshot, as polygons to be drawn small.

Corners are whole numbers on a grid of `GRID` steps along the longer side of the channel: a thousand
runs would not fit into a page otherwise, and nobody reads them as numbers.
"""

from typing import Any

import numpy as np
import shapely
import xarray as xr
from numpy.typing import NDArray

from softslip.analysis.explorer.embedding import embedded
from softslip.analysis.observables import parameters_of
from softslip.analysis.observables.contours import contours

FloatArray = NDArray[np.float64]

GRID = 16_000
"""Steps of the grid of corners along the longer side of the channel."""

TOLERANCE = 8e-4
"""How closely polygons with fewer corners follow those of the nodes, over that side."""

MARGIN = 0.25
"""What lies around the channel and is kept, over its longer side: a wall's bumps, and the part of
a particle that lies beyond the period."""


def outlines(run: xr.Dataset) -> dict[str, Any] | None:
    """Return the polygons of a run's last snapshot for JSON.

    Returns
    -------
    dict or None
        ``time`` of the snapshot; ``length`` and ``height`` of the channel; ``corners`` of all
        polygons one after the other, x and y, to be divided by ``grid`` and lessened by ``origin``;
        ``sizes``, the number of corners of each: particles, then the lower and the upper wall,
        which are open lines of one period. None for a run without snapshots.
    """
    count = run.sizes.get("snapshot", 0)
    if not count:
        return None
    channel = parameters_of(run).channel
    side = max(channel.length, channel.height)
    particles, walls = contours(run, count - 1)
    shapes = [_simplified(_closed(each), side)[:-1] for each in particles]
    shapes += [_simplified(each, side) for each in walls]
    shapes = [_in_first_period(each, channel.length) for each in shapes]
    steps = [np.rint((each / side + MARGIN) * GRID) for each in shapes]
    return {
        "time": float(run["snapshot_time"].values[-1]),
        "length": channel.length,
        "height": channel.height,
        "grid": GRID / side,
        "origin": MARGIN * side,
        "corners": embedded(np.concatenate(steps), "u2"),
        "sizes": embedded([len(each) for each in shapes], "u2"),
    }


def _closed(corners: FloatArray) -> FloatArray:
    return np.concatenate((corners, corners[:1]))


def _simplified(line: FloatArray, side: float) -> FloatArray:
    short = shapely.simplify(shapely.linestrings(line), TOLERANCE * side, preserve_topology=False)
    return np.asarray(shapely.get_coordinates(short))


def _in_first_period(corners: FloatArray, length: float) -> FloatArray:
    """Shift a polygon so that its leftmost corner lies in the first period."""
    shift = np.floor(corners[:, 0].min() / length) * length
    return np.asarray(corners - [shift, 0.0])
