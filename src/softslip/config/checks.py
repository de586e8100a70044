"""What must hold between values of different keys.

Values are checked once, here and by their own fields; below this module nobody checks again.
"""

import math

import numpy as np

from softslip.config.contact_points import check_contacts
from softslip.config.sections import Tree
from softslip.errors import ConfigError
from softslip.messages import brief
from softslip.solver.geometry import Box, WallContour
from softslip.solver.splitting import (
    EWALD_REACH,
    SPLIT_OVER_REGULARISATION,
    farthest_reach,
    split_length,
)

PLAIN_SPACING = 2.5
"""Largest node spacing over the regularisation length for the plain trapezoidal rule: it misses
e^{-(2π/2.5)²} = 0.2 % of a smooth force."""

LEAST_REGULARISATION = 0.01
"""Smallest regularisation length over the node spacing for the corrected rule: the velocity of a
node then takes half of its digits from the difference of two logarithms."""

WIDEST_NODES = 0.7
"""Largest node spacing over the contact range: films settle at 0.65 to 0.8 of it, and nodes that
are farther apart than a film is thick let it collapse (0.67 held in the tightest scenes tried,
0.78 did not)."""

MOST_CELLS_APART = 4.0
"""Largest node spacing over the mesh size on the mesh of the paper's scheme."""

MESH_TOLERANCE = 1e-6
"""A box counts as divided by the mesh if its size is a whole number of cells to this many cells."""

FEWEST_CELLS = 16
"""Smallest number of mesh cells on a side of the box."""

SMALLEST_BUMP = 0.5
"""Smallest bump radius over the mesh size; a smaller one would fall between the mesh points."""

DENSEST = 0.97
"""Largest part of the free area between the bumps that particles may fill."""

MOST_PARTICLES = 100_000
"""More particles than this are taken for a typo in a length."""

MOST_STEPS = 10**9
"""More time steps than this are taken for a typo in a time."""


def _check_level(parameters: Tree) -> None:
    if parameters.accuracy is not None and parameters.fidelity is not None:
        raise ConfigError(
            "accuracy",
            parameters.accuracy,
            f"is given together with fidelity {parameters.fidelity!r}, which sets the same keys",
            "give one of the two",
        )


def _check_box(parameters: Tree) -> None:
    channel, resolution = parameters.channel, parameters.hydrodynamics.resolution
    sides = {
        "channel.length": (channel.length, 0.0),
        "channel.outer_gap": (channel.outer_gap, channel.height),
    }
    for key, (value, other) in sides.items():
        cells = (value + other) * resolution
        if abs(cells - round(cells)) <= MESH_TOLERANCE and round(cells) >= FEWEST_CELLS:
            continue
        fewest = max(FEWEST_CELLS, math.floor(other * resolution) + 1)
        nearest = max(round(cells), fewest) / resolution - other
        raise ConfigError(
            key,
            value,
            f"makes {'the period across the flow' if other else 'a period'} of {cells:.8g} mesh "
            f"cells, not a whole number of at least {FEWEST_CELLS}, "
            f"at hydrodynamics.resolution {resolution}",
            f"the nearest value that fits is {nearest:.15g}",
        )


def _check_ewald(parameters: Tree) -> None:
    hydrodynamics, channel = parameters.hydrodynamics, parameters.channel
    if hydrodynamics.mobility != "ewald":
        return
    room = farthest_reach(Box(channel.length, channel.height, channel.outer_gap))
    spread, spacing = hydrodynamics.regularisation or 1.0, hydrodynamics.node_spacing
    split = split_length(hydrodynamics.split, spread, spacing, hydrodynamics.resolution, room)
    reach = EWALD_REACH * split
    if reach > room * (1 + 1e-12):
        raise ConfigError(
            "hydrodynamics.split",
            brief(hydrodynamics.split),
            f"makes the near sum reach {reach:.4g}, beyond {room:.4g}, the smaller of "
            "channel.outer_gap and a third of channel.length",
            f"use a split of at most {room / EWALD_REACH * hydrodynamics.resolution:.4g}, a "
            "larger channel.outer_gap, or mobility 'grid'",
        )
    smallest = SPLIT_OVER_REGULARISATION * spread
    if split * hydrodynamics.resolution < smallest:
        raise ConfigError(
            "hydrodynamics.split",
            brief(hydrodynamics.split),
            f"makes the split {split * hydrodynamics.resolution:.4g}, below {smallest:.4g}, "
            f"{SPLIT_OVER_REGULARISATION:g} regularisation lengths, which leaves nothing to the "
            "near sum",
            "use null, which takes the split that costs least, and a channel.outer_gap with room "
            "for it",
        )


def _check_nodes(parameters: Tree) -> None:
    """Check that nodes are close enough for the quadrature and for what they stand for."""
    hydrodynamics = parameters.hydrodynamics
    for key in ("quadrature", "regularisation"):
        value = getattr(hydrodynamics, key)
        if hydrodynamics.mobility == "grid" and value not in ("plain", None):
            raise ConfigError(
                f"hydrodynamics.{key}",
                value,
                "has no meaning on the mesh of hydrodynamics.mobility 'grid'",
                "use mobility 'ewald'",
            )
    spacing, spread = hydrodynamics.node_spacing, hydrodynamics.regularisation or 1.0
    limits: list[tuple[float, str]] = []
    if parameters.suspension.area_fraction > 0:
        apart = WIDEST_NODES * parameters.steric.length * hydrodynamics.resolution
        limits.append((apart, f"{WIDEST_NODES:g} steric.length, beyond which films collapse"))
    if hydrodynamics.mobility == "grid":
        limits.append((MOST_CELLS_APART, "mesh sizes, beyond which solvent leaks between nodes"))
    elif hydrodynamics.quadrature == "plain":
        limits.append(
            (PLAIN_SPACING * spread, "what the plain sum resolves; 'corrected' reaches further")
        )
    else:
        limits.append((spread / LEAST_REGULARISATION, "a hundred regularisation lengths"))
    limit, what = min(limits)
    if spacing > limit * (1 + 1e-12):
        raise ConfigError(
            "hydrodynamics.node_spacing",
            spacing,
            f"is more than {limit:.4g}, {what}",
            "use a smaller spacing",
        )


def _contour(parameters: Tree) -> WallContour:
    wall, channel = parameters.wall, parameters.channel
    bump_radius = wall.roughness * parameters.suspension.mean_radius
    return WallContour.fitted(channel.length, bump_radius, wall.bump_separation)


def _check_bumps(parameters: Tree) -> None:
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


def _check_free_area(parameters: Tree) -> None:
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


def _check_particles(parameters: Tree) -> None:
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


def _check_bulk(parameters: Tree) -> None:
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


def _check_rheometer(parameters: Tree) -> None:
    rheometer = parameters.rheometer
    given: dict[str, float | None] = {
        "stress": rheometer.stress,
        "shear_rate": rheometer.shear_rate,
    }
    imposed = "stress" if rheometer.mode == "stress" else "shear_rate"
    if given.pop(imposed) is None:
        raise ConfigError(
            f"rheometer.{imposed}",
            brief(None),
            f"must be a number when rheometer.mode is '{rheometer.mode}'",
            f"give rheometer.{imposed}",
        )
    for other, value in given.items():
        if value is not None:
            raise ConfigError(
                f"rheometer.{other}",
                value,
                f"has no effect when rheometer.mode is '{rheometer.mode}'",
                f"set rheometer.{other} to null",
            )
    if rheometer.mode == "rate" and rheometer.control == "printed":
        raise ConfigError(
            "rheometer.control",
            "printed",
            "is defined for an imposed stress only",
            "use 'exact' when rheometer.mode is 'rate'",
        )


def _check_times(parameters: Tree) -> None:
    stepping = parameters.time_stepping
    durations = {"shear_time": stepping.shear_time, "ageing_time": stepping.ageing_time}
    for name, duration in durations.items():
        if 0 < duration < stepping.step:
            raise ConfigError(
                f"time_stepping.{name}",
                duration,
                f"is shorter than one step of {stepping.step:g}",
                f"use a longer {name} or a smaller time_stepping.step",
            )
        if duration > MOST_STEPS * stepping.step:
            raise ConfigError(
                f"time_stepping.{name}",
                duration,
                f"takes more than {MOST_STEPS:.0e} steps of {stepping.step:g}",
                f"use a shorter {name} or a larger time_stepping.step",
            )


def _check_snapshots(parameters: Tree) -> None:
    shear_time, earlier = parameters.time_stepping.shear_time, -math.inf
    for index, time in enumerate(parameters.recording.snapshots):
        if not 0 <= time <= shear_time:
            raise ConfigError(
                f"recording.snapshots[{index}]",
                time,
                f"lies outside the shear stage, 0 to {shear_time:g}",
                "use times within time_stepping.shear_time",
            )
        if time <= earlier:
            raise ConfigError(
                f"recording.snapshots[{index}]",
                time,
                f"does not come after the time before it, {earlier:g}",
                "list each time once, in increasing order",
            )
        earlier = time


def _check_films(parameters: Tree) -> None:
    """Refuse materials so far from any real one that the film between membranes has no number."""
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            check_contacts(parameters)
    except (ArithmeticError, ValueError):
        steric = parameters.steric
        raise ConfigError(
            "steric.energy",
            steric.energy,
            f"makes no film that can be computed at steric.length {steric.length:g}, "
            f"membrane.elastic_constant {parameters.membrane.elastic_constant:g} and "
            f"hydrodynamics.node_spacing {parameters.hydrodynamics.node_spacing:g}",
            "use values nearer to the defaults",
        ) from None


CHECKS = (
    _check_level,
    _check_bumps,
    _check_free_area,
    _check_particles,
    _check_bulk,
    _check_box,
    _check_ewald,
    _check_nodes,
    _check_rheometer,
    _check_times,
    _check_snapshots,
    _check_films,
)
"""What must hold between values of different keys, in the order in which it is checked."""
