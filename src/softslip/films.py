"""Films between membranes: what they carry, and whether contact points resolve them."""

import math
from functools import cache

import numpy as np

from softslip.derived import contact_strength
from softslip.errors import ConfigError
from softslip.sections import Tree

FEWEST_POINTS = 1.0
"""Contact points of the other membrane that a point must touch."""

_ABSCISSAE, _WEIGHTS = np.polynomial.legendre.leggauss(64)
"""Gauss points on (-1, 1), enough for the pressure to be exact to six digits."""

_THINNEST, _THICKEST = 0.05, 1.0 - 1e-12
"""Where a film is looked for, over the contact range."""


def contact_pressure(thickness: float, contact_range: float, strength: float) -> float:
    """Return the pressure that two parallel membranes exert on each other across a film.

    p = c ∫ (96/r) [(σ_LJ/r)^8 - (σ_LJ/r)^6] (h/r) dx over |x| < √(σ_LJ² - h²), r² = h² + x²: the
    pair force of `softslip.steric` between continuous membranes.

    Parameters
    ----------
    thickness, contact_range
        h and σ_LJ [length unit].
    strength
        c of `softslip.steric.contact_strength`.
    """
    half = math.sqrt(contact_range**2 - thickness**2)
    x = 0.5 * half * (_ABSCISSAE + 1.0)
    square = thickness**2 + x**2
    ratio = contact_range**2 / square
    density = 96.0 / square * (ratio**4 - ratio**3) * thickness
    # Twice the half; the weights sum to 2.
    return strength * half * float(np.sum(_WEIGHTS * density))


@cache
def film_under(pressure: float, contact_range: float, strength: float) -> float:
    """Return the film that carries a pressure between parallel membranes [length unit]."""

    def excess(ratio: float) -> float:
        return contact_pressure(ratio * contact_range, contact_range, strength) - pressure

    if excess(_THINNEST) < 0:
        return _THINNEST * contact_range
    # Halved here: every command reads a scenario, and importing SciPy's solvers takes it half a
    # second more.
    thin, thick = _THINNEST, _THICKEST
    while thick - thin > 1e-12:
        middle = 0.5 * (thin + thick)
        thin, thick = (middle, thick) if excess(middle) > 0 else (thin, middle)
    return contact_range * 0.5 * (thin + thick)


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


def check_contacts(parameters: Tree) -> None:
    """Raise when contact points are too far apart for the films that they hold open.

    A stiff contact holds membranes apart at nearly its range, where a point touches few others:
    fewer than `FEWEST_POINTS`, and membranes interlock like gears instead of sliding, without any
    other sign. Scenes with 0.9 of a point sheared up to 8 % too slowly, with 1.2 right to 0.3 %.

    Parameters
    ----------
    parameters
        Of the run.

    Raises
    ------
    ConfigError
        Naming ``steric.refinement`` and how many points would do.
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
