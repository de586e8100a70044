"""Whether mesh, nodes and near sum resolve what they stand for."""

import math

from softslip.config.sections import Tree
from softslip.errors import ConfigError
from softslip.messages import brief
from softslip.solver.geometry import Box
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


def check_box(parameters: Tree) -> None:
    """Check that the sides of the box are whole numbers of mesh cells.

    Raises
    ------
    ConfigError
        Naming ``channel.length`` or ``channel.outer_gap``.
    """
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


def check_ewald(parameters: Tree) -> None:
    """Check that the near sum of the Ewald sum fits into the box and has something to do.

    Raises
    ------
    ConfigError
        Naming ``hydrodynamics.split``.
    """
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


def check_nodes(parameters: Tree) -> None:
    """Check that nodes are close enough for the quadrature and for what they stand for.

    Raises
    ------
    ConfigError
        Naming ``hydrodynamics.quadrature``, ``regularisation`` or ``node_spacing``.
    """
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
