"""What follows from several parameters: bumps, the split of the Ewald sum, contact forces."""

from typing import Literal

from softslip.sections import REFERENCE_NODE_SPACING, Tree

EWALD_REACH = 5.5
"""Reach of the Ewald sum's near part over its split length at most, where it ends by itself."""

SPLIT_OVER_SPACING = 1.2
"""Split length over the node spacing at which the two parts of the Ewald sum cost least."""

SPLIT_OVER_REGULARISATION = 1.5
"""Smallest split length over the regularisation length: below, the near sum has nothing to do."""


def best_split(regularisation: float, node_spacing: float) -> float:
    """Return the split length a of the Ewald sum that costs least, in the unit of its arguments.

    Parameters
    ----------
    regularisation, node_spacing
        ε and Δs.
    """
    return max(SPLIT_OVER_SPACING * node_spacing, SPLIT_OVER_REGULARISATION * regularisation)


def split_length(parameters: Tree) -> float:
    """Return the split length a of the Ewald sum [length unit], chosen where none is given.

    Where the box has no room for the one that costs least, it is as long as there is room for.
    """
    hydrodynamics = parameters.hydrodynamics
    if hydrodynamics.split is not None:
        return hydrodynamics.split / hydrodynamics.resolution
    best = best_split(hydrodynamics.regularisation or 1.0, hydrodynamics.node_spacing)
    return min(best / hydrodynamics.resolution, farthest_reach(parameters) / EWALD_REACH)


def farthest_reach(parameters: Tree) -> float:
    """Return how far the near sum may reach [length unit].

    Not across the outer gap, nor twice around the period.
    """
    return min(parameters.channel.outer_gap, parameters.channel.length / 3)


def bump_radius(parameters: Tree) -> float:
    """Return the bump radius b [length unit]; 0 for a smooth wall."""
    return parameters.wall.roughness * parameters.suspension.mean_radius


def bump_count(parameters: Tree) -> int:
    """Return the whole number of bumps in a period that is nearest to the wanted separation."""
    bump = bump_radius(parameters)
    separation = parameters.wall.bump_separation * bump
    return max(1, round(parameters.channel.length / separation)) if bump > 0 else 0


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
