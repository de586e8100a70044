"""One particle between smooth walls far away, for cases whose exact solution is unbounded."""

import math
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError
from softslip.simulation import assembly
from softslip.simulation.expansion import membrane_node_counts
from softslip.solver.geometry import FloatArray, Layout
from softslip.studies.boxes import CELL, outer_gap
from softslip.studies.membrane_nodes import membrane_dataset
from softslip.studies.scenes import Scene, at_rest
from softslip.studies.validation.case import Fidelity
from softslip.studies.validation.solvent_channel import level_of

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
    fidelity: Fidelity, side: float, radius: float, rheometer: dict[str, Any]
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

    Raises
    ------
    ConfigError
        When they make no scene.
    """
    tree = {
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
    return Parameters.from_mapping(tree)


def unit_circle(nodes: int, turn: float = 0.0) -> FloatArray:
    """Return nodes on the circle of radius 1, turned by some spacings, shape (nodes, 2)."""
    angle = 2 * np.pi * (np.arange(nodes) + turn) / nodes
    return np.column_stack((np.cos(angle), np.sin(angle)))


def layout_of_circles(parameters: Parameters, radius: float) -> Layout:
    """Return the layout of a run whose particles, if any, are circles of one radius at rest."""
    counts = membrane_node_counts(parameters)
    areas, nodes = np.full(len(counts), math.pi * radius**2), np.empty((counts.sum(), 2))
    return assembly.layout_of(membrane_dataset(nodes, counts, areas), parameters)


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
    middle = 0.5 * np.array([parameters.channel.length, parameters.channel.height])
    return at_rest(shape + middle, layout, parameters)
