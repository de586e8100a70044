"""One particle between smooth walls far away, for cases whose exact solution is unbounded."""

import math
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError
from softslip.simulation import assembly
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.state import State
from softslip.studies.scenes import CELL, Scene, outer_gap
from softslip.studies.validation.case import Fidelity
from softslip.studies.validation.solvent_channel import level_of

RADIUS = 0.00846
"""Mean radius of the paper's particles [length unit]."""

FEWEST_CELLS = 4
"""Sides of the box over `CELL` at least: the near sum must not meet itself around the box."""


def side_of(box: float, radius: float) -> float:
    """Return the side nearest to a number of radii that meshes divide [length unit]."""
    return max(round(box * radius / CELL), FEWEST_CELLS) * CELL


def two_sides(box: float, radius: float) -> tuple[float, float]:
    """Return the sides of a box of a number of radii and of one half as large [length unit].

    Raises
    ------
    ConfigError
        When the smaller one has no room for half the side.
    """
    small, large = side_of(0.5 * box, radius), side_of(box, radius)
    if small < large:
        return small, large
    raise ConfigError(
        "box",
        box,
        f"leaves no room for a smaller box to compare with, whose side is at least {small:g}, "
        f"{small / radius:.3g} radii",
        f"use at least {math.ceil(2 * small / radius)}",
    )


def lone_parameters(
    fidelity: Fidelity, side: float, radius: float, rheometer: dict[str, Any], **groups: Any
) -> Parameters:
    """Return the parameters of one particle in a square channel of some side.

    Parameters
    ----------
    fidelity
        A level, or 'literal' for the paper's own scheme.
    side
        L_x and H [length unit].
    radius
        Of the particle [length unit].
    rheometer
        What is imposed.
    groups
        Further settings, group by group.

    Raises
    ------
    ConfigError
        When they make no scene.
    """
    tree: dict[str, Any] = {
        "fidelity": level_of(fidelity),
        "channel": {"length": side, "height": side, "outer_gap": outer_gap(side)},
        "suspension": {
            "area_fraction": math.pi * radius**2 / side**2,
            "mean_radius": radius,
            "size_ratio": 1.0,
        },
        "rheometer": rheometer,
        "recording": {"bulk_margin": None},
    }
    for group, values in groups.items():
        tree[group] = {**tree.get(group, {}), **values}
    return Parameters.from_mapping(tree)


def lone_scene(parameters: Parameters, shape: FloatArray, layout: Layout) -> Scene:
    """Return a membrane about the middle of the channel, between walls without tether tractions.

    The tethers need not be in balance at the start, as `solver.suspension.Suspension.load` makes
    them: the membrane presses on nothing, and they hold the walls within a few thousandths of a
    time unit.

    Parameters
    ----------
    parameters
        Of `lone_parameters`.
    shape
        Nodes about their centre, shape (nodes, 2) [length unit].
    layout
        Of its nodes, with their rest lengths.
    """
    rheometer = parameters.rheometer
    suspension = assembly.assemble(
        parameters, layout, stress=rheometer.stress, shear_rate=rheometer.shear_rate
    )
    middle = 0.5 * np.array([parameters.channel.length, parameters.channel.height])
    state = State.at_rest(shape + middle, layout)
    return Scene(parameters, layout, suspension, state)
