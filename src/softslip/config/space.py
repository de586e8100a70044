"""Whether the bumps of the walls, the particles and a bulk have space in the channel."""

import math

from softslip.config.sections import Tree
from softslip.errors import ConfigError
from softslip.solver.geometry import WallContour

SMALLEST_BUMP = 0.5
"""Smallest bump radius over the mesh size; a smaller one would fall between the mesh points."""

DENSEST = 0.97
"""Largest part of the free area between the bumps that particles may fill."""

MOST_PARTICLES = 100_000
"""More particles than this are taken for a typo in a length."""


def _contour(parameters: Tree) -> WallContour:
    wall, channel = parameters.wall, parameters.channel
    bump_radius = wall.roughness * parameters.suspension.mean_radius
    return WallContour.fitted(channel.length, bump_radius, wall.bump_separation)


def check_bumps(parameters: Tree) -> None:
    """Check that bumps fit into the channel, are seen by the mesh and do not overlap.

    Raises
    ------
    ConfigError
        Naming ``wall.roughness`` or ``wall.bump_separation``.
    """
    wall, channel = parameters.wall, parameters.channel
    radius, contour = parameters.suspension.mean_radius, _contour(parameters)
    bump = contour.bump_radius
    limit = min(channel.length, channel.height) / 2
    if bump >= limit:
        raise ConfigError(
            "wall.roughness",
            wall.roughness,
            f"makes bumps of radius {bump:.4g}, which must stay below {limit:.4g}, half the "
            "smaller of channel.length and channel.height",
            f"use less than {limit / radius:.4g} or a larger channel",
        )
    smallest = SMALLEST_BUMP / parameters.hydrodynamics.resolution
    if wall.roughness > 0 and bump < smallest:
        raise ConfigError(
            "wall.roughness",
            wall.roughness,
            f"makes bumps of radius {bump:.4g}, too small for the mesh to see: at least "
            f"{smallest:.4g} is needed at hydrodynamics.resolution "
            f"{parameters.hydrodynamics.resolution}",
            f"use 0 for a smooth wall, or at least {smallest / radius:.4g}",
        )
    if contour.bumps * 2 * bump > channel.length:
        raise ConfigError(
            "wall.bump_separation",
            wall.bump_separation,
            "makes neighbouring bumps overlap",
            "use a value well above 2, for example 5.0, as the paper",
        )


def check_free_area(parameters: Tree) -> None:
    """Check that the area between the bumps can hold the particles.

    Raises
    ------
    ConfigError
        Naming ``suspension.area_fraction``.
    """
    fraction, channel = parameters.suspension.area_fraction, parameters.channel
    contour = _contour(parameters)
    bump_area = contour.bumps * math.pi * contour.bump_radius**2
    taken = bump_area if parameters.suspension.area_reference == "channel" else 0.0
    free = 1.0 - taken / (channel.length * channel.height)
    if fraction > DENSEST * free:
        raise ConfigError(
            "suspension.area_fraction",
            fraction,
            f"cannot fit: the bumps leave {free:.4g} of the channel free, of which at most "
            f"{DENSEST:g} can be filled",
            f"use at most {math.floor(1e4 * DENSEST * free) / 1e4:g}, or a smaller wall.roughness",
        )


def check_particles(parameters: Tree) -> None:
    """Check that single particles fit, and that there is a sensible number of them.

    Raises
    ------
    ConfigError
        Naming ``suspension.mean_radius``.
    """
    suspension, channel = parameters.suspension, parameters.channel
    if suspension.area_fraction == 0:
        return
    larger = 2 * suspension.size_ratio / (1 + suspension.size_ratio) * suspension.mean_radius
    room = {
        "channel.height between bumps": channel.height - 2 * _contour(parameters).bump_radius,
        "channel.length": channel.length,
    }
    for name, width in room.items():
        if 2 * larger > width:
            raise ConfigError(
                "suspension.mean_radius",
                suspension.mean_radius,
                f"makes particles of diameter {2 * larger:.4g}, wider than the {name} "
                f"of {width:.4g}",
                "use a smaller radius or a larger channel",
            )
    smaller = larger / suspension.size_ratio
    area = 0.5 * math.pi * (smaller**2 + larger**2)
    count = suspension.area_fraction * channel.length * channel.height / area
    if not 0.5 <= count <= MOST_PARTICLES:
        raise ConfigError(
            "suspension.mean_radius",
            suspension.mean_radius,
            f"makes {count:.4g} particles at area fraction {suspension.area_fraction:g}, "
            f"which must be 1 to {MOST_PARTICLES}",
            "use another radius or channel, or suspension.area_fraction 0 for no particles",
        )


def check_bulk(parameters: Tree) -> None:
    """Check that there is a bulk between the margins at the walls.

    Raises
    ------
    ConfigError
        Naming ``channel.height``.
    """
    margin, radius = parameters.recording.bulk_margin, parameters.suspension.mean_radius
    if margin is None:
        return
    mesh_size = 1.0 / parameters.hydrodynamics.resolution
    needed = 2 * margin * radius + 3 * mesh_size
    if parameters.channel.height < needed:
        raise ConfigError(
            "channel.height",
            parameters.channel.height,
            f"leaves no bulk between the two margins of {margin:g} mean radii: at least "
            f"{needed:.4g} is needed",
            "use a larger height, or set recording.bulk_margin to null to record no bulk "
            "observables",
        )
