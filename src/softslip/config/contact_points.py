"""Whether contact points resolve the films between membranes."""

import math

import numpy as np

from softslip.config.sections import Tree
from softslip.errors import ConfigError
from softslip.solver.films import contact_strength, film_under

FEWEST_POINTS = 1.0
"""Contact points of the other membrane that a point must touch."""


def points_in_range(parameters: Tree, refinement: int) -> float:
    """Return how many contact points of a membrane a point on the other one touches.

    Across the film under the larger of the membrane modulus and the imposed stress, which is what
    membranes press on each other with.

    Parameters
    ----------
    parameters
        Of a run with a contact energy.
    refinement
        Contact points per node.
    """
    steric, hydrodynamics = parameters.steric, parameters.hydrodynamics
    pressure = max(parameters.membrane.elastic_constant, parameters.rheometer.stress or 0.0)
    strength = contact_strength(steric.energy, steric.reading)
    film = film_under(pressure, steric.length, strength)
    apart = hydrodynamics.node_spacing / (hydrodynamics.resolution * refinement)
    return 2.0 * math.sqrt(steric.length**2 - film**2) / apart


def _check_points(parameters: Tree) -> None:
    """Refuse contact points that are too far apart for the films that they hold open.

    A stiff contact holds membranes apart at nearly its range, where a point touches few others:
    fewer than `FEWEST_POINTS`, and membranes interlock like gears instead of sliding, without any
    other sign. Scenes with 0.9 of a point sheared up to 8 % too slowly, with 1.2 right to 0.3 %.
    """
    steric = parameters.steric
    if steric.energy == 0 or parameters.suspension.area_fraction == 0:
        return
    points = points_in_range(parameters, steric.refinement)
    if points >= FEWEST_POINTS:
        return
    needed = math.ceil(FEWEST_POINTS / points_in_range(parameters, 1))
    raise ConfigError(
        "steric.refinement",
        steric.refinement,
        f"lets a contact point touch {points:.2g} others across a film under the membrane "
        f"modulus, less than {FEWEST_POINTS:g}: membranes interlock instead of sliding",
        f"use at least {needed}, a smaller hydrodynamics.node_spacing, or a steric.energy below "
        f"{steric.energy:g}",
    )


def check_films(parameters: Tree) -> None:
    """Check the films between membranes, and whether contact points are close enough for them.

    Parameters
    ----------
    parameters
        Of the run.

    Raises
    ------
    ConfigError
        Naming ``steric.refinement`` and how many points would do, or ``steric.energy`` for
        materials so far from any real one that their films have no number.
    """
    try:
        with np.errstate(divide="raise", over="raise", invalid="raise"):
            _check_points(parameters)
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
