"""Where the Ewald sum is split into its far and its near part, and how far the near one reaches."""

from softslip.solver.geometry import Box

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


def split_length(
    split: float | None,
    regularisation: float,
    node_spacing: float,
    resolution: int,
    farthest_reach: float,
) -> float:
    """Return the split length a of the Ewald sum [length unit], chosen where none is given.

    The one that costs least, or the longest that the box allows.

    Parameters
    ----------
    split, regularisation, node_spacing
        a, None to choose it, ε and Δs, all in mesh sizes.
    resolution
        Mesh sizes per unit length.
    farthest_reach
        See `farthest_reach` [length unit].
    """
    if split is not None:
        return split / resolution
    best = best_split(regularisation, node_spacing)
    return min(best / resolution, farthest_reach / EWALD_REACH)


def farthest_reach(box: Box) -> float:
    """Return how far the near sum may reach [length unit].

    Not across the outer gap, nor twice around the period.
    """
    return min(box.outer_gap, box.length / 3)
