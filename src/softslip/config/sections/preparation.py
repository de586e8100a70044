"""The preparation of a packing: discs, then membranes that grow."""

from softslip.config.fields import quantity
from softslip.config.sections.base import Section


class Packing(Section):
    """Equilibration of discs with LAMMPS (Table I)."""

    area_fraction: float = quantity(
        0.5,
        symbol="φ_0",
        unit="1",
        paper=0.5,
        gt=0,
        le=0.6,
        description="Area fraction of the discs, before they grow.",
    )
    temperature: float = quantity(
        0.1, symbol="T", unit="energy unit", paper=0.1, gt=0, description="Langevin temperature."
    )
    damping_time: float = quantity(
        0.01, symbol="τ", unit="time unit", paper=0.01, gt=0, description="Langevin time constant."
    )
    time_step: float = quantity(
        5.42e-6, symbol="Δt", unit="time unit", paper=5.42e-6, gt=0, description="Verlet time step."
    )
    equilibration_steps: int = quantity(
        5000,
        symbol="τ_eq/Δt",
        unit="1",
        paper=5000,
        ge=0,
        le=10**9,
        description="Langevin steps.",
    )


class Expansion(Section):
    """Growth of the discs into elastic membranes (Table II)."""

    elastic_constant: float = quantity(
        2.0, symbol="K_e", unit="stress unit", paper=2.0, gt=0, description="Membrane modulus."
    )
    contact_length: float = quantity(
        0.00125,
        symbol="σ_ss'",
        unit="length unit",
        paper=0.00125,
        gt=0,
        description="Range parameter of the contact repulsion while the particles grow.",
    )
    contact_pressure: float = quantity(
        35.0,
        symbol="P_c",
        unit="stress unit",
        gt=0,
        description="Contact pressure at 0.84 of the range while the particles grow; the default "
        "makes contacts settle about where the contact force of the shear stage holds them.",
    )
    growth_nodes: int = quantity(
        80,
        symbol="N_g",
        unit="1",
        paper=250,
        ge=24,
        le=1000,
        description="Nodes of a smaller particle while it grows.",
    )
    ramp_steps: int = quantity(
        2000,
        symbol="n_g",
        unit="1",
        ge=1,
        le=10**9,
        description="Steps in which areas grow to their targets.",
    )
    relaxation_steps: int = quantity(
        1000,
        symbol="n_r",
        unit="1",
        ge=0,
        le=10**9,
        description="Steps of rest at the final areas.",
    )
    closest_approach: float = quantity(
        0.55,
        symbol="h_min/σ_LJ",
        unit="1",
        ge=0,
        lt=1,
        description="Smallest distance between two bodies at the end, over steric.length; closer, "
        "the shear stage would start with an explosion.",
    )
    area_tolerance: float = quantity(
        1e-3,
        symbol="δA/A",
        unit="1",
        gt=0,
        le=0.05,
        description="Largest relative error of any particle's area at the end.",
    )
