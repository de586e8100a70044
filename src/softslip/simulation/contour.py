"""Geometry of closed contours between walls: area, resampling, and exact checks for crossings."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from shapely import Polygon
from shapely.affinity import translate

from softslip.config.parameters import Parameters
from softslip.errors import ExpansionError
from softslip.simulation.sample import reference_area, wall_contour
from softslip.solver.geometry import (
    FloatArray,
    IntArray,
    WallContour,
    chain_neighbours,
    polygon_area,
)

PolygonArray = NDArray[np.object_]

AREA_FRACTION_TOLERANCE = 1e-3
"""Largest relative error of the area fraction of all membranes together."""

_SPLINE_POINTS_PER_NODE = 8


def wall_clearance(points: FloatArray, contour: WallContour, height: float) -> FloatArray:
    """Return how far points are from the nearer wall, negative beyond it, shape (points,).

    Parameters
    ----------
    points
        Positions in the channel frame, shape (points, 2) [length unit].
    contour, height
        Contour of the lower wall, and distance H of the flat parts [length unit].
    """
    return segment_clearance(points, points, contour, height)


def segment_clearance(
    start: FloatArray, end: FloatArray, contour: WallContour, height: float
) -> FloatArray:
    """Return how far straight segments are from the nearer wall, shape (segments,).

    The solid below the lower wall is a half plane and discs of radius b centred on its edge, so
    that the distance is exact outside the wall; inside it is negative. Segments are taken to be
    shorter than the distance between bumps.

    Parameters
    ----------
    start, end
        Ends of the segments in the channel frame, shape (segments, 2) [length unit].
    contour, height
        Contour of the lower wall, and distance H of the flat parts [length unit].
    """
    clearance = np.full(len(start), np.inf)
    along = end - start
    for first in (start, np.column_stack((start[:, 0], height - start[:, 1]))):
        step = along if first is start else along * (1.0, -1.0)
        clearance = np.minimum(clearance, np.minimum(first[:, 1], (first + step)[:, 1]))
        if contour.bumps:
            middle = first[:, 0] + 0.5 * step[:, 0]
            centre = contour.separation * (np.floor(middle / contour.separation) + 0.5)
            arm = first - np.column_stack((centre, np.zeros(len(first))))
            square = np.maximum(np.sum(step**2, axis=1), np.finfo(float).tiny)
            fraction = np.clip(-np.sum(arm * step, axis=1) / square, 0.0, 1.0)
            nearest = arm + fraction[:, None] * step
            bump = np.hypot(nearest[:, 0], nearest[:, 1]) - contour.bump_radius
            clearance = np.minimum(clearance, bump)
    return clearance


def split(position: FloatArray, offsets: IntArray) -> Iterator[FloatArray]:
    """Yield each membrane's nodes as a view, shape (nodes of the membrane, 2)."""
    for first, last in pairwise(offsets):
        yield position[first:last]


def signed_areas(position: FloatArray, offsets: IntArray) -> FloatArray:
    """Return the area of each polygon, positive when it runs anticlockwise, (particles,)."""
    return np.array([_signed_area(nodes) for nodes in split(position, offsets)], dtype=float)


def _signed_area(nodes: FloatArray) -> float:
    # Relative to the first node, so that distance from the origin costs no digits.
    x, y = (nodes - nodes[0]).T
    return polygon_area(x, y)


def centroid(nodes: FloatArray) -> FloatArray:
    """Return the centre of area of a polygon, shape (2,)."""
    x, y = (nodes - nodes[0]).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    moment = [np.sum((axis + np.roll(axis, -1)) * cross) for axis in (x, y)]
    centre: FloatArray = nodes[0] + np.array(moment) / (3 * np.sum(cross))
    return centre


def resample(nodes: FloatArray, count: int) -> FloatArray:
    """Return equally spaced nodes on the periodic cubic spline through a closed contour.

    Parameters
    ----------
    nodes
        Points of the contour in order, shape (points, 2), the first not repeated.
    count
        Number of points.

    Returns
    -------
    ndarray
        Points at equal arc length, beginning at the first point of ``nodes``, shape (count, 2).
    """
    closed = np.vstack((nodes, nodes[:1]))
    chord = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    spline = CubicSpline(chord, closed, bc_type="periodic")
    fine = np.linspace(0.0, chord[-1], _SPLINE_POINTS_PER_NODE * max(count, len(nodes)) + 1)
    arc = np.append(0.0, np.cumsum(np.hypot(*np.diff(spline(fine), axis=0).T)))
    equal = np.arange(count) * (arc[-1] / count)
    return np.asarray(spline(np.interp(equal, arc, fine)), dtype=float)


def with_area(nodes: FloatArray, area: float) -> FloatArray:
    """Return an anticlockwise polygon shifted along its normals to a given area.

    Each step moves nodes along the gradient of the area, which is the outward normal times half
    the distance between neighbours; a handful suffices for rounding accuracy.
    """
    for _ in range(20):
        error = area - _signed_area(nodes)
        if abs(error) <= 1e-14 * area:
            break
        across = np.roll(nodes, -1, axis=0) - np.roll(nodes, 1, axis=0)
        gradient = 0.5 * np.column_stack((across[:, 1], -across[:, 0]))
        nodes = nodes + error / np.sum(gradient**2) * gradient
    return nodes


@dataclass(frozen=True)
class ContourReport:
    """What `check_contours` measured.

    Attributes
    ----------
    area_fraction
        Area of all membranes over the area that suspension.area_fraction refers to.
    largest_area_error
        Largest relative error of a membrane's area.
    smallest_distance
        Smallest distance between two membranes or of a membrane from a wall [length unit].
    """

    area_fraction: float
    largest_area_error: float
    smallest_distance: float


def check_contours(
    position: FloatArray, offsets: IntArray, target_area: FloatArray, parameters: Parameters
) -> ContourReport:
    """Make sure that membranes cross nothing, enclose no other and have their areas.

    The polygons through the nodes are checked, as they are, with robust predicates: each is
    simple and anticlockwise, lies between the walls, and shares no point with another polygon
    or a periodic image, of which one that another encloses is a case.

    Parameters
    ----------
    position, offsets
        Nodes of all membranes in the channel frame, unwrapped, shape (nodes, 2), and the first
        row of each membrane and, last, the number of nodes, shape (particles + 1,).
    target_area
        Prescribed area of each membrane, shape (particles,) [length unit squared].
    parameters
        The channel, the walls, the area fraction and the tolerances.

    Raises
    ------
    ExpansionError
        Naming the first particles at fault, the value and the limit.
    """
    finite = np.all(np.isfinite(position), axis=1)
    if not finite.all():
        node = int(np.argmin(finite))
        particle = int(np.searchsorted(offsets, node, side="right")) - 1
        raise ExpansionError(f"particle {particle} has a node at {position[node]}; {_REMEDY}")
    polygons = _object_array([Polygon(nodes) for nodes in split(position, offsets)])
    _check_simple(polygons)
    fraction, error = _check_areas(position, offsets, target_area, parameters)
    distance = _check_walls(position, offsets, parameters)
    distance = _check_pairs(polygons, parameters.channel.length, distance)
    return ContourReport(fraction, error, distance)


def _object_array(polygons: list[Polygon]) -> PolygonArray:
    return np.array(polygons, dtype=np.object_)


_REMEDY = "lower suspension.area_fraction or expansion.contact_length, or try another seed"


def _check_simple(polygons: PolygonArray) -> None:
    simple = shapely.is_valid(polygons)
    if not np.all(simple):
        raise ExpansionError(
            f"the membrane of particle {np.argmin(simple)} crosses itself; {_REMEDY}"
        )


def _check_areas(
    position: FloatArray, offsets: IntArray, target: FloatArray, parameters: Parameters
) -> tuple[float, float]:
    area = signed_areas(position, offsets)
    error = np.abs(area / target - 1)
    tolerance = parameters.expansion.area_tolerance
    if not np.all(error <= tolerance):
        worst = int(np.argmax(error))
        raise ExpansionError(
            f"particle {worst} has area {area[worst]:.6g} instead of {target[worst]:.6g}, off by "
            f"more than expansion.area_tolerance {tolerance:g}; {_REMEDY}"
        )
    prescribed = parameters.suspension.area_fraction
    fraction = float(area.sum()) / reference_area(parameters)
    if abs(fraction - prescribed) > AREA_FRACTION_TOLERANCE * prescribed:
        raise ExpansionError(
            f"the area fraction is {fraction:.6g} instead of {prescribed:g}, off by more than one "
            f"part in {1 / AREA_FRACTION_TOLERANCE:g}; {_REMEDY}"
        )
    return fraction, float(error.max(initial=0.0))


def _check_walls(position: FloatArray, offsets: IntArray, parameters: Parameters) -> float:
    """Return the smallest distance of any membrane from a wall."""
    _, following = chain_neighbours(offsets)
    contour, height = wall_contour(parameters), parameters.channel.height
    clearance = segment_clearance(position, position[following], contour, height)
    if not np.all(clearance > 0):
        node = int(np.argmin(clearance))
        particle = int(np.searchsorted(offsets, node, side="right")) - 1
        raise ExpansionError(
            f"particle {particle} reaches {-clearance[node]:.3g} into a wall; {_REMEDY}"
        )
    return float(clearance.min(initial=np.inf))


def _check_pairs(polygons: PolygonArray, length: float, reach: float) -> float:
    """Return the smallest distance between two membranes, or ``reach`` if none is below it."""
    count = len(polygons)
    if not count:
        return reach
    bounds = shapely.bounds(polygons)
    images = 1 + int(np.ceil((bounds[:, 2].max() - bounds[:, 0].min()) / length))
    shifts = np.arange(-images, images + 1)
    copies = _object_array(
        [translate(polygon, length * shift) for shift in shifts for polygon in polygons]
    )
    first, second = shapely.STRtree(copies).query(polygons, predicate="dwithin", distance=reach)
    itself = (second % count == first) & (shifts[second // count] == 0)
    first, second = first[~itself], second[~itself]
    distance = shapely.distance(polygons[first], copies[second])
    if np.any(distance <= 0):
        a, b = sorted((first[np.argmin(distance)], second[np.argmin(distance)] % count))
        raise ExpansionError(f"the membranes of particles {a} and {b} cross or overlap; {_REMEDY}")
    return float(min(distance.min(initial=np.inf), reach))
