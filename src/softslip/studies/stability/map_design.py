"""What the map of stability covers: the values along each of its axes."""

from typing import Annotated

from pydantic import Strict

from softslip.config.fields import quantity
from softslip.config.sections import Standalone

Values = Annotated[tuple[float, ...], Strict(False)]
Counts = Annotated[tuple[int, ...], Strict(False)]


class MapDesign(Standalone):
    """Values along the axes of the map, and the size of its scenes.

    The defaults are the map at its full size; that of `config/numerics/ci.yaml` is the smallest.
    """

    particles: int = quantity(
        16,
        symbol="N",
        unit="1",
        ge=8,
        le=100,
        description="Particles of the scenes in which neither walls nor their number vary.",
    )
    seed: int = quantity(1, symbol="seed", unit="1", ge=0, description="Seed of the packings.")
    resolution: int = quantity(
        4096,
        symbol="1/dx",
        unit="1 / length unit",
        ge=2048,
        le=8192,
        multiple_of=2048,
        description="Mesh of the paper's scheme, coarser than its own so that a cell is cheap.",
    )
    ageing: float = quantity(
        1.0, symbol="t_w", unit="time unit", gt=0, description="Time at rest before a cell."
    )
    duration: float = quantity(
        0.5,
        symbol="t",
        unit="time unit",
        gt=0,
        description="Length of a cell at the paper's material; stiffer and faster ones are shorter "
        "in proportion, so that all end before neighbouring trajectories part.",
    )
    steps: Values = quantity(
        (0.1, 0.2, 0.5, 0.8, 0.95, 1.05, 1.2, 1.5, 2.0, 5.0, 10.0),
        symbol="Δt ρ/2",
        unit="1",
        description="Steps over the stability limit of explicit Euler at the start.",
    )
    stresses: Values = quantity(
        (1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0, 2.0, 5.0),
        symbol="σ",
        unit="stress unit",
        description="Imposed stresses.",
    )
    wall_stiffnesses: Values = quantity(
        (200.0, 2e3, 2e4, 6e4, 2e5, 2e6),
        symbol="K_w",
        unit="stress unit / length unit",
        description="Rate constants of the tethers.",
    )
    membrane_moduli: Values = quantity(
        (0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0),
        symbol="K_e",
        unit="stress unit",
        description="Membrane moduli.",
    )
    contact_energies: Values = quantity(
        (0.0, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7),
        symbol="K_LJ",
        unit="energy unit",
        description="Contact energies.",
    )
    contact_ranges: Values = quantity(
        (0.78, 1.5, 3.0, 6.0, 9.0),
        symbol="σ_LJ/dx_ref",
        unit="1",
        description="Contact ranges over the paper's mesh size, down to its regularisation length.",
    )
    roughnesses: Values = quantity(
        (0.0, 0.1, 0.3, 0.59, 1.0, 1.5), symbol="β", unit="1", description="Wall roughnesses."
    )
    area_fractions: Values = quantity(
        (0.3, 0.5, 0.7, 0.84, 0.9, 0.95), symbol="φ", unit="1", description="Area fractions."
    )
    separations: Values = quantity(
        (12.0, 24.0, 48.0),
        symbol="H/R",
        unit="1",
        description="Distances of the walls over the mean radius.",
    )
    counts: Counts = quantity(
        (0, 1, 2, 6), symbol="N", unit="1", description="Numbers of particles, in boxes that fit."
    )
    rests: Counts = quantity(
        (10_000, 1_000_000),
        symbol="n",
        unit="1",
        description="Explicit steps of a particle at rest.",
    )
    periods: Values = quantity(
        (1.0, 10.0, 120.0),
        symbol="x_w/L_x",
        unit="1",
        description="Periods of the channel by which the walls are sheared past each other.",
    )
    node_spacings: Values = quantity(
        (2.0, 5.0),
        symbol="α",
        unit="1",
        description="Node spacings over the paper's mesh size at which limits of the step are "
        "measured.",
    )
    regularisations: Values = quantity(
        (0.2, 0.78, 1.5),
        symbol="ε/dx_ref",
        unit="1",
        description="Regularisation lengths over the paper's mesh size at which limits of the "
        "step are measured.",
    )
    stages: Counts = quantity(
        (2, 3, 5, 8, 12, 20),
        symbol="s",
        unit="1",
        description="Stages of 'rkc2' of which the limit of the step is measured.",
    )
