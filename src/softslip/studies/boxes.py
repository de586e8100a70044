"""The boxes that studies measure in: channels for N particles, and their parameters."""

import math
from collections.abc import Mapping
from typing import Any

from softslip.config.parameters import Parameters

MEAN_RADIUS, SIZE_RATIO, AREA_FRACTION = 0.00846, 1.4, 0.84
"""The particles of all benchmarks, those of the paper."""

PAPER_PARTICLES, PAPER_LENGTH = 800, 0.5
"""Size of the paper's channel: smaller boxes have its shape."""

SHORTEST = 3 / 32
"""Shortest period along the flow [length unit]: five diameters of the larger particles."""

CELL = 1 / 64
"""Sides of boxes are multiples of this, or of twice this [length unit]: their meshes then have
sizes that Fourier transforms like, at any resolution."""

GAP, PAPER_GAP = 0.03, 0.56
"""Least solvent outside the walls where little is enough, and that of the paper [length unit]."""

STRESS = 0.3
"""Stress of the sheared scenes, several times the yield stress [stress unit]."""

Tree = Mapping[str, Any]
"""Parameters as a nested mapping, not yet checked: what cannot be run is a result."""


def merged(tree: Tree, changes: Tree) -> dict[str, Any]:
    """Return a tree of parameters with some values of some groups replaced."""
    return {**tree, **{name: {**tree.get(name, {}), **new} for name, new in changes.items()}}


def particle_area() -> float:
    """Return the mean area of a particle [length unit²]."""
    small = 2 * MEAN_RADIUS / (1 + SIZE_RATIO)
    return 0.5 * math.pi * small**2 * (1 + SIZE_RATIO**2)


def channel_sides(particles: int) -> tuple[float, float]:
    """Return L_x and H of a channel that holds a number of particles at φ = 0.84 [length unit]."""
    wanted = PAPER_LENGTH * math.sqrt(particles / PAPER_PARTICLES)
    length = max(round(wanted / (2 * CELL)) * 2 * CELL, SHORTEST)
    return length, particles * particle_area() / (AREA_FRACTION * length)


def outer_gap(height: float, least: float = GAP) -> float:
    """Return the gap L_y - H of at least this size that makes L_y a multiple of `CELL`."""
    return math.ceil((height + least) / CELL) * CELL - height


def nearest_gap(height: float, wanted: float = PAPER_GAP) -> float:
    """Return the gap L_y - H nearest to a wanted one that makes L_y a multiple of `CELL`."""
    return round((height + wanted) / CELL) * CELL - height


def parameters_of(
    particles: int,
    fidelity: str | None = None,
    *,
    gap: float | None = None,
    seed: int = 1,
    **groups: Any,
) -> Parameters:
    """Return the parameters of a box of N particles between smooth walls.

    Parameters
    ----------
    particles
        N.
    fidelity
        Level of `config.fidelity`; None is the paper's scheme.
    gap
        Solvent outside the walls [length unit]; by default what `outer_gap` gives.
    seed
        Of the packing.
    groups
        Further settings, group by group.

    Raises
    ------
    ConfigError
        When so few particles make no channel, or there is no such level.
    """
    length, height = channel_sides(particles)
    gap = outer_gap(height) if gap is None else gap
    tree = {
        "fidelity": fidelity,
        "seed": seed,
        "channel": {"length": length, "height": height, "outer_gap": gap},
        "suspension": {"area_fraction": AREA_FRACTION, "mean_radius": MEAN_RADIUS},
        "rheometer": {"stress": STRESS},
        # Small channels have no bulk.
        "recording": {"bulk_margin": None},
    }
    return Parameters.from_mapping(merged(tree, groups))
