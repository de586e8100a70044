"""Films between membranes: the contact force that holds them open, and what they carry."""

import math
from functools import cache
from typing import Literal

REFERENCE_MESH_SIZE = 1.0 / 8192
"""Mesh size dx_ref of the paper [length unit]."""

REFERENCE_NODE_SPACING = 1.42 * REFERENCE_MESH_SIZE
"""Spacing Δs_ref of the paper's boundary nodes [length unit], on which K_LJ is defined."""

_THINNEST, _THICKEST = 0.05, 1.0 - 1e-12
"""Where a film is looked for, over the contact range."""


def contact_strength(energy: float, reading: Literal["energy", "density"]) -> float:
    """Return the constant c of the pair force c w_i w_j g(r) that a reading of K_LJ stands for.

    The pair sum stands for a double integral along two membranes, so each node of weight w = Δs
    counts in proportion to it, and the sum does not depend on how fine the nodes are. At the
    paper's spacing Δs_ref, 'energy' makes -K_LJ dE/dr the force between two nodes, and 'density'
    makes it their force density, which Eq. 28 multiplies by Δs (design §1).

    Parameters
    ----------
    energy
        K_LJ.
    reading
        'energy' or 'density'.
    """
    power = 2 if reading == "energy" else 1
    return energy / REFERENCE_NODE_SPACING**power


def contact_pressure(thickness: float, contact_range: float, strength: float) -> float:
    """Return the pressure that two parallel membranes exert on each other across a film.

    p = c ∫ (96/r) [(σ_LJ/r)^8 - (σ_LJ/r)^6] (h/r) dx over |x| < √(σ_LJ² - h²), r² = h² + x²: the
    pair force of `solver.steric` between continuous membranes.

    Parameters
    ----------
    thickness, contact_range
        h and σ_LJ [length unit].
    strength
        c of `contact_strength`.
    """
    # In units of the range, with I_n = ∫ dx/r^2n from 0 to √(1 - h²), p = 192 c h (I_5 - I_4):
    # both by I_{n+1} = (√(1 - h²) + (2n - 1) I_n) / 2nh², as r = 1 at the end.
    square = (thickness / contact_range) ** 2
    half = math.sqrt(1 - square)
    integral = math.atan2(half, math.sqrt(square)) / math.sqrt(square)
    for n in (1, 2, 3):
        integral = (half + (2 * n - 1) * integral) / (2 * n * square)
    difference = (half + (7 - 8 * square) * integral) / (8 * square)
    return strength * 192 * math.sqrt(square) * difference


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
