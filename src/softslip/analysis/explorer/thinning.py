"""Curves of very many runs through fewer of their points, whose numbers stay what they are.

A point is left out only where the line through its neighbours passes it so closely that nobody
sees a difference (Douglas and Peucker 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

TOLERANCES = (0.0, *(2.5e-4 * 2**number for number in range(13)))
"""Distances from the line within which points are left out, over the lengths of the axes.

At 0 none is, 2e-3 is less than a pixel, and at the last every curve is a straight line.
"""

MOST_POINTS = 40_000
"""Points of all runs together up to which none is left out: more take browsers long to draw."""


@dataclass(frozen=True)
class ThinnedCurves:
    """Which points of the curves of some runs are drawn.

    Attributes
    ----------
    kept
        Of each run the numbers of its points, ascending.
    tolerance
        One of `TOLERANCES`.
    share
        Points that are drawn over those that there are.
    """

    kept: tuple[IndexArray, ...]
    tolerance: float
    share: float


def thinned(
    x: FloatArray, curves: FloatArray, *, logarithmic: bool = False, most: int = MOST_POINTS
) -> ThinnedCurves:
    """Choose the points through which curves are drawn, by the least of `TOLERANCES` that does.

    Parameters
    ----------
    x
        Common to all curves and ascending, shape (points,).
    curves
        Shape (runs, points); what is not finite, or not positive on a logarithmic axis, leaves a
        gap, and so does it with fewer points.
    logarithmic
        Whether both axes are.
    most
        Points of all curves together that are wanted at most.
    """
    across, up = (_on_axis(values, logarithmic) for values in (x, curves))
    known = max(int(np.isfinite(curves).sum()), 1)
    for tolerance in TOLERANCES:
        kept = tuple(_kept(across, curve, tolerance) for curve in up)
        count = sum(map(len, kept))
        if count <= most:
            break
    return ThinnedCurves(kept, tolerance, min(count / known, 1.0))


def _on_axis(values: FloatArray, logarithmic: bool) -> FloatArray:
    """Return where values are on an axis that is 1 long, NaN where they cannot be."""
    with np.errstate(invalid="ignore", divide="ignore"):
        placed = np.where(values > 0, np.log(values), np.nan) if logarithmic else values
    known = placed[np.isfinite(placed)]
    length = float(np.ptp(known)) if known.size else 0.0
    return (placed - (known.min() if known.size else 0.0)) / (length or 1.0)


def _kept(x: FloatArray, y: FloatArray, tolerance: float) -> IndexArray:
    """Return the numbers of the points of one curve that are drawn."""
    drawn = np.isfinite(x) & np.isfinite(y)
    parts = [_part(x, y, part, tolerance) for part in _stretches(drawn)]
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.intp)


def _part(x: FloatArray, y: FloatArray, part: IndexArray, tolerance: float) -> IndexArray:
    """Return the numbers of the points that are drawn of one stretch; of a gap its first."""
    if not np.isfinite(y[part[0]]) or not np.isfinite(x[part[0]]):
        return part[:1]
    if tolerance == 0 or len(part) < 3:
        return part
    line = shapely.linestrings(np.column_stack((x[part], y[part])))
    corners = shapely.get_coordinates(shapely.simplify(line, tolerance, preserve_topology=False))
    return np.asarray(part[np.searchsorted(x[part], corners[:, 0])])


def _stretches(drawn: NDArray[np.bool_]) -> Sequence[IndexArray]:
    """Return the numbers of the points of each stretch that is drawn, and of each gap."""
    ends = np.flatnonzero(drawn[1:] != drawn[:-1]) + 1
    return [part for part in np.split(np.arange(len(drawn)), ends) if len(part)]
