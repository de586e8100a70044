"""Exact geometry of a state: areas, and what crosses what, by polygons and real walls."""

import math

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import translate

from softslip.config.parameters import Parameters
from softslip.simulation.contour import PolygonArray, segment_clearance, split
from softslip.simulation.sample import wall_contour
from softslip.solver.chains import lagrange_weights, refine
from softslip.solver.geometry import LOWER, UPPER, FloatArray, IntArray, Layout
from softslip.solver.state import State

FINER = 4
"""Points per node of the membranes that are checked for crossings."""


def polygon_area_error(state: State, layout: Layout) -> float:
    """Return the largest relative change of the area inside interpolated membranes."""
    points, offsets = _finer_membranes(state.node_position, layout)
    areas = [Polygon(each).area for each in split(points, offsets)]
    error = np.asarray(areas) / layout.reference_area - 1
    return float(np.abs(error).max(initial=0.0))


def _finer_membranes(nodes: FloatArray, layout: Layout) -> tuple[FloatArray, IntArray]:
    """Return `FINER` points per node of each membrane, and the first row of each."""
    points = np.empty((FINER * len(nodes), 2))
    chains, begins = layout.offsets, FINER * layout.offsets
    every, jumps = np.ones(layout.particles, np.bool_), np.zeros(layout.particles)
    refine(nodes, chains, jumps, every, lagrange_weights(FINER), begins, *points.T)
    return points, begins


def crossing_of(state: State, layout: Layout, parameters: Parameters) -> str:
    """Say which membranes cross each other, themselves or a wall; nothing if none do.

    Exact for the polygons through `FINER` points per node and the walls where they are now.
    """
    points, offsets = _finer_membranes(state.node_position, layout)
    polygons = np.array([Polygon(each) for each in split(points, offsets)], dtype=np.object_)
    if not len(polygons):
        return ""
    simple = shapely.is_valid(polygons)
    if not simple.all():
        return f"membrane {int(np.argmin(simple))} crosses itself"
    behind = _behind_walls(points, offsets, state, parameters)
    return behind or _crossing_pair(polygons, parameters.channel.length)


FAR = 1e3
"""Height at which the other wall is out of the way [length unit]."""


def _behind_walls(points: FloatArray, offsets: IntArray, state: State, given: Parameters) -> str:
    contour, height = wall_contour(given), given.channel.height
    following = np.arange(1, len(points) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    for wall in (LOWER, UPPER):
        seen = points - (state.wall_displacement[wall], 0.0)
        if wall == UPPER:
            seen[:, 1] = height - seen[:, 1]
        clearance = segment_clearance(seen, seen[following], contour, FAR)
        if not clearance.min() > 0:
            worst = np.searchsorted(offsets, np.argmin(clearance), side="right") - 1
            return f"membrane {worst} reaches {-clearance.min():.2g} into wall {wall}"
    return ""


def _crossing_pair(polygons: PolygonArray, length: float) -> str:
    bounds = shapely.bounds(polygons)
    images = 1 + math.ceil((bounds[:, 2].max() - bounds[:, 0].min()) / length)
    shifts = range(-images, images + 1)
    copies = [translate(each, length * shift) for shift in shifts for each in polygons]
    tree = shapely.STRtree(np.array(copies, dtype=np.object_))
    first, second = tree.query(polygons, predicate="intersects")
    home = images * len(polygons)
    others = second != first + home
    if not others.any():
        return ""
    a, b = int(first[others][0]), int(second[others][0]) % len(polygons)
    return f"membranes {a} and {b} cross or overlap"
