"""The sample that a run's parameters describe: its box, its walls and its particles."""

import math

import numpy as np

from softslip.config.parameters import Parameters
from softslip.solver.geometry import Box, FloatArray, WallContour


def channel_box(parameters: Parameters) -> Box:
    """Return the periodic box with the run's channel inside."""
    channel = parameters.channel
    return Box(channel.length, channel.height, channel.outer_gap)


def wall_contour(parameters: Parameters) -> WallContour:
    """Return the run's lower wall."""
    bump_radius = parameters.wall.roughness * parameters.suspension.mean_radius
    return WallContour.fitted(
        parameters.channel.length, bump_radius, parameters.wall.bump_separation
    )


def reference_area(parameters: Parameters) -> float:
    """Return the area that the area fraction refers to [length unit squared]."""
    area = parameters.channel.length * parameters.channel.height
    if parameters.suspension.area_reference == "free":
        area -= 2 * wall_contour(parameters).bump_area
    return area


def particle_radii(parameters: Parameters) -> FloatArray:
    """Return the radius of each particle as a disc of its area, shape (particles,).

    Half of the particles (rounded up) are small, half are larger by the size ratio. Their number
    is the one nearest to the prescribed mean radius; the radii then give the exact area fraction.
    """
    suspension = parameters.suspension
    area = suspension.area_fraction * reference_area(parameters)
    ratio = suspension.size_ratio
    small = 2 * suspension.mean_radius / (1 + ratio)
    count = round(area / (0.5 * math.pi * small**2 * (1 + ratio**2)))
    if area > 0:
        count = max(count, 1)
    small_count = (count + 1) // 2
    shape = np.where(np.arange(count) < small_count, 1.0, ratio)
    return shape * math.sqrt(area / (math.pi * np.sum(shape**2))) if count else shape
