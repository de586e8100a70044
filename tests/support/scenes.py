"""Small scenes that the tests of the solver share: parameters, foams and rings."""

import numpy as np
import xarray as xr
from scipy.spatial import ConvexHull, HalfspaceIntersection, Voronoi

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.solver.geometry import Layout, polygon_area, wall_positions
from softslip.solver.state import State

BASE = {
    "channel": {"length": 0.0625, "height": 0.109375, "outer_gap": 0.015625},
    "hydrodynamics": {"resolution": 2048},
    "time_stepping": {"step": 0.002, "ageing_time": 0.2, "shear_time": 0.2},
    "recording": {"stride": 1},
}
"""A channel of some two dozen particles on a coarse mesh of 128 x 256 points."""

FILM = 0.8
"""Distance between the membranes of a foam over σ_LJ, about where contacts settle."""

CORNER = 0.35
"""Radius of the corners of a foam's cells over the mean particle radius."""


NUMBER = {"units": "1", "long_name": "number of nodes of each membrane"}
AREA = {"units": "length unit squared", "long_name": "area of the polygon of each membrane"}


def generator(*key):
    return np.random.default_rng(np.random.SeedSequence(key))


def parameters(**groups):
    """Parameters of the small scene, changed group by group."""
    tree = {name: dict(group) for name, group in BASE.items()}
    for name, group in groups.items():
        tree[name] = {**tree.get(name, {}), **group} if isinstance(group, dict) else group
    return Parameters.from_mapping(tree)


def empty(**groups):
    """Parameters of a channel without particles."""
    groups.setdefault("recording", {"bulk_margin": None})
    return parameters(suspension={"area_fraction": 0.0}, **groups)


def foam(given, seed=1):
    """Rounded Voronoi cells that fill the channel, in the schema of the expansion stage."""
    length, film = given.channel.length, FILM * given.steric.length
    low = wall_contour(given).bump_radius + 0.5 * film
    high = given.channel.height - low
    sites = generator(seed).random((len(particle_radii(given)), 2)) * (length, high - low)
    sites[:, 1] += low
    for _ in range(30):  # Lloyd's iterations even out the cells.
        cells = _cells(sites, length, low, high)
        sites = np.array([_corners(cell, site, 0.0).mean(axis=0) for cell, site in cells])
    corner = CORNER * given.suspension.mean_radius
    spacing = given.hydrodynamics.node_spacing / given.hydrodynamics.resolution
    rings = [
        _rounded(_corners(cell, site, 0.5 * film + corner), corner, spacing)
        for cell, site in _cells(sites, length, low, high)
    ]
    return xr.Dataset(
        {
            "node_position": (("node", "axis"), np.concatenate(rings)),
            "nodes_per_particle": ("particle", [len(ring) for ring in rings], NUMBER),
            "area": ("particle", [polygon_area(*ring.T) for ring in rings], AREA),
        }
    )


def _cells(sites, length, low, high):
    """Yield each site's half-planes (normal, -support); walls and periods by mirror images."""
    images = np.concatenate(
        [
            np.column_stack((sites[:, 0] + shift * length, y))
            for shift in (0, -1, 1)
            for y in (sites[:, 1], 2 * low - sites[:, 1], 2 * high - sites[:, 1])
        ]
    )
    neighbours = [[] for _ in sites]
    for pair in Voronoi(images).ridge_points:
        for own, other in (pair, pair[::-1]):
            if own < len(sites):
                neighbours[own].append(other)
    for own, others in enumerate(neighbours):
        arm = images[others] - sites[own]
        distance = np.hypot(*arm.T)
        normal = arm / distance[:, None]
        yield np.column_stack((normal, -normal @ sites[own] - 0.5 * distance)), sites[own]


def _corners(cell, site, inset):
    """Corners of a cell whose sides are moved inwards, anticlockwise."""
    corners = HalfspaceIntersection(cell + np.array([0.0, 0.0, inset]), site).intersections
    return corners[ConvexHull(corners).vertices]


def _rounded(corners, radius, spacing):
    """Equally spaced points on the outline of a polygon grown by a disc."""
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.arctan2(-along[:, 0], along[:, 1])
    before = np.roll(outward, 1)
    turn = np.mod(outward - before, 2 * np.pi)
    angle = before[:, None] + turn[:, None] * np.linspace(0, 1, 40)
    outline = corners[:, None] + radius * np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    closed = np.concatenate((outline.reshape(-1, 2), outline[:1, 0]))
    arc = np.append(0.0, np.cumsum(np.hypot(*np.diff(closed, axis=0).T)))
    count = round(arc[-1] / spacing)
    at = np.arange(count) * arc[-1] / count
    return np.column_stack([np.interp(at, arc, axis) for axis in closed.T])


def ellipse(centre, half_axes, count, tilt=0.0):
    angle = 2 * np.pi * np.arange(count) / count
    x, y = half_axes[0] * np.cos(angle), half_axes[1] * np.sin(angle)
    turned = (np.cos(tilt) * x - np.sin(tilt) * y, np.sin(tilt) * x + np.cos(tilt) * y)
    return np.column_stack(turned) + centre


def layout_of_rings(rings, given, spacing=None):
    """Layout of membranes at hand between the walls of a scene."""
    contour = wall_contour(given)
    wanted = given.hydrodynamics.node_spacing / given.hydrodynamics.resolution
    walls = wall_positions(contour, given.channel.height, wanted)
    offsets = np.append(0, np.cumsum([len(ring) for ring in rings])).astype(np.int64)
    if spacing is None:
        areas = np.array([polygon_area(*ring.T) for ring in rings])
        spacing = 2 * np.sqrt(np.pi * areas) / np.diff(offsets)
    return Layout(offsets, np.asarray(spacing, float), walls, contour.arc_length / walls.shape[1])


def of_rings(rings, given, spacing=None, **drive):
    """Suspension and state of membranes at hand; ``drive`` is a stress or a shear rate."""
    layout = layout_of_rings(rings, given, spacing)
    drive = drive or {"stress": given.rheometer.stress}
    drive.setdefault("stress", None)
    nodes = np.concatenate([np.empty((0, 2)), *rings])
    return assembly.assemble(given, layout, **drive), State.at_rest(nodes, layout)


def of_foam(packing, given, **drive):
    """Suspension and state of a foam, or of an aged one."""
    if "area" in packing:
        packing = packing.rename(area="reference_area")
    layout = assembly.layout_of(packing, given)
    drive = drive or {"stress": given.rheometer.stress}
    drive.setdefault("stress", None)
    return assembly.assemble(given, layout, **drive), State.at_rest(
        packing["node_position"].values, layout
    )


def stepped(suspension, state, steps, time_step):
    """State after some explicit Euler steps, without guards and records."""
    for _ in range(steps):
        vector = state.vector + time_step * suspension.rate(state)
        state = state.replace(vector, state.time + time_step, state.step + 1)
    return state
