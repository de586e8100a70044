"""The groups of a scenario's parameters, each value with its unit, symbol, bounds and the paper's.

"Eq.", "Table" and "Sec." mean those of Jung & Fielding, *Wall slip and bulk yielding in soft
particle suspensions*. Lengths are in units of the paper's box height, stresses in units of its
membrane modulus, and the time unit follows from the viscosity. What must hold between values of
different keys is checked in `softslip.parameters`.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Strict

from softslip.fields import quantity

REFERENCE_MESH_SIZE = 1.0 / 8192.0
"""Mesh size dx_ref of the paper [length unit]."""

REFERENCE_NODE_SPACING = 1.42 * REFERENCE_MESH_SIZE
"""Spacing Δs_ref of the paper's boundary nodes [length unit], on which K_LJ is defined."""


class Section(BaseModel):
    """A group of parameters: frozen, and strict about what it is given."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class Solvent(Section):
    """The Newtonian fluid inside and around the particles (Table III)."""

    viscosity: float = quantity(
        1.0, symbol="η", unit="viscosity unit", paper=1.0, gt=0, description="Solvent viscosity."
    )


class Channel(Section):
    """The sheared gap and the solvent outside it (Sec. III)."""

    length: float = quantity(
        0.5,
        symbol="L_x",
        unit="length unit",
        paper=0.5,
        gt=0,
        le=100,
        description="Period along the flow.",
    )
    height: float = quantity(
        0.44,
        symbol="H",
        unit="length unit",
        paper=0.44,
        gt=0,
        le=100,
        label="wall_separation",
        description="Distance between the flat parts of the two walls.",
    )
    outer_gap: float = quantity(
        0.02875,
        symbol="L_y - H",
        unit="length unit",
        paper=0.56,
        gt=0,
        le=100,
        description="Pure solvent outside the walls, a numerical parameter: a few radii do.",
    )
    outside: Literal["still", "periodic"] = quantity(
        "still",
        symbol="τ_out",
        unit="1",
        paper="periodic",
        description="Solvent outside the walls: 'still' carries no stress, so that nothing depends "
        "on the outer gap; 'periodic' is sheared backwards, as in the paper's box.",
    )


class Wall(Section):
    """Hard walls with semicircular bumps (Fig. 2)."""

    roughness: float = quantity(
        0.0,
        symbol="β",
        unit="1",
        ge=0,
        le=3,
        description="Bump radius b over the mean particle radius; 0 is a smooth wall.",
    )
    bump_separation: float = quantity(
        5.0,
        symbol="B/b",
        unit="1",
        paper=5.0,
        ge=2,
        description="Wanted distance between bump centres over the bump radius; the actual one "
        "divides the channel length.",
    )
    stiffness: float = quantity(
        20000.0,
        symbol="K_w",
        unit="stress unit / length unit",
        paper=20000.0,
        gt=0,
        description="Rate constant of the tether tractions that keep each wall rigid (Eq. 25).",
    )


class Suspension(Section):
    """The soft particles (Sec. II A and III)."""

    area_fraction: float = quantity(
        0.84,
        symbol="φ",
        unit="1",
        paper=0.84,
        ge=0,
        le=0.95,
        description="Particle area over the area of the channel; 0 means no particles.",
    )
    area_reference: Literal["channel", "free"] = quantity(
        "channel",
        symbol="A_φ",
        unit="1",
        paper="channel",
        description="Area that the area fraction refers to: 'channel' is L_x H, 'free' leaves out "
        "what the bumps of the walls take up, so that smooth and rough walls of a small channel "
        "hold equally dense suspensions.",
    )
    mean_radius: float = quantity(
        0.00846,
        symbol="R",
        unit="length unit",
        paper=0.0085,
        ge=1e-6,
        le=10,
        description="Mean particle radius. The number of particles follows from it, and the radii "
        "are then adjusted (by less than one part in 4N) so that the area fraction is exact; "
        "0.00846 gives the paper's 800 particles.",
    )
    size_ratio: float = quantity(
        1.4,
        symbol="R_2/R_1",
        unit="1",
        paper=1.4,
        ge=1,
        le=3,
        description="Radius of the larger half of the particles over that of the smaller half.",
    )


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


class Membrane(Section):
    """Elastic boundary of a particle while it is sheared (Eqs. 4-5, 18-21)."""

    elastic_constant: float = quantity(
        1.0, symbol="K_e", unit="stress unit", paper=1.0, gt=0, description="Membrane modulus."
    )
    area_correction: Literal["flux", "none"] = quantity(
        "flux",
        symbol="M",
        unit="1",
        paper="flux",
        description="'flux' subtracts the mean normal velocity of each membrane (Eqs. 20-21); "
        "'none' moves nodes with the bare velocity.",
    )
    area_restoring: float = quantity(
        0.0,
        symbol="κ_A",
        unit="1 / time unit",
        paper=0.0,
        ge=0,
        le=100,
        description="Rate at which 'flux' also brings a particle's area back to what it should be; "
        "without it the errors of time steps add up.",
    )
    order: Literal[2, 6] = quantity(
        2,
        symbol="p",
        unit="1",
        paper=2,
        description="Order in the node spacing of tension, normals and areas; 6 goes with nodes "
        "that are several mesh sizes apart.",
    )


class Steric(Section):
    """Short-ranged contact repulsion between nodes (Eqs. 2 and 22)."""

    length: float = quantity(
        9 * REFERENCE_MESH_SIZE,
        symbol="σ_LJ",
        unit="length unit",
        paper=9 * REFERENCE_MESH_SIZE,
        gt=0,
        description="Contact range and cutoff.",
    )
    energy: float = quantity(
        1e-9, symbol="K_LJ", unit="energy unit", paper=1e-9, ge=0, description="Contact energy."
    )
    reading: Literal["energy", "density"] = quantity(
        "energy",
        symbol="K_LJ",
        unit="1",
        description="'energy' takes K_LJ as an energy of a pair of nodes at the paper's spacing; "
        "'density' takes the pair force as a force density, as Eq. 28 reads literally.",
    )
    refinement: int = quantity(
        1,
        symbol="m",
        unit="1",
        paper=1,
        ge=1,
        le=8,
        description="Contact points per node, the others interpolated between nodes. Contact "
        "points more than 2.5 of the paper's mesh sizes apart interlock like gears.",
    )


class Rheometer(Section):
    """What drives the walls: a shear stress or an apparent shear rate."""

    mode: Literal["stress", "rate"] = quantity(
        "stress", symbol="mode", unit="1", paper="stress", description="What is imposed."
    )
    stress: float | None = quantity(
        0.3,
        symbol="σ",
        unit="stress unit",
        ge=0,
        description="Shear stress carried by the packing; null when the rate is imposed.",
    )
    shear_rate: float | None = quantity(
        None,
        symbol="γ̇_wall",
        unit="1 / time unit",
        ge=0,
        label="imposed_shear_rate",
        description="Relative wall speed over H; null when the stress is imposed.",
    )
    control: Literal["exact", "printed"] = quantity(
        "exact",
        symbol="control",
        unit="1",
        paper="printed",
        description="'exact' solves the momentum balance in closed form at every evaluation; "
        "'printed' integrates Eq. 26, which feeds back positively on itself.",
    )


class Hydrodynamics(Section):
    """The Stokes solver and its nodes (Table III)."""

    mobility: Literal["grid", "ewald"] = quantity(
        "grid",
        symbol="K",
        unit="1",
        paper="grid",
        description="'grid' is the paper's immersed-boundary mesh (Eqs. 7-16); 'ewald' is the same "
        "operator as an Ewald sum, which costs less where the mesh is fine.",
    )
    split: float | None = quantity(
        None,
        symbol="a/dx",
        unit="1",
        ge=1,
        le=64,
        description="Split length of the Ewald sum over the mesh size. Numerical: it moves work "
        "between its two parts; null takes the one that costs least.",
    )
    resolution: int = quantity(
        8192,
        symbol="1/dx",
        unit="1 / length unit",
        paper=8192,
        ge=64,
        le=65536,
        description="Mesh points per unit length. 'ewald' has no such mesh, but measures lengths "
        "in its size.",
    )
    regularisation: float | None = quantity(
        None,
        symbol="ε/dx",
        unit="1",
        gt=0,
        le=8,
        description="Regularisation length of 'ewald' over the mesh size: forces act on the fluid "
        "over a few of it; null takes that of the mesh of 'grid', to compare with.",
    )
    quadrature: Literal["plain", "corrected"] = quantity(
        "plain",
        symbol="Σ Δs",
        unit="1",
        paper="plain",
        description="Sum over the nodes of a membrane: 'corrected' adds what the trapezoidal rule "
        "misses of a node's own neighbourhood, so that fewer nodes do ('ewald' only).",
    )
    symbol: Literal["compact", "wide"] = quantity(
        "compact",
        symbol="D²",
        unit="1",
        paper="compact",
        description="Laplacian of the streamfunction equation: 'compact' as Eq. 14 prints it, "
        "'wide' as Eq. 9 squared.",
    )
    node_spacing: float = quantity(
        1.42,
        symbol="α",
        unit="1",
        paper=1.42,
        gt=0,
        le=16,
        description="Distance between boundary nodes over the mesh size.",
    )


class TimeStepping(Section):
    """Integration in time."""

    integrator: Literal["euler", "rkc2"] = quantity(
        "euler",
        symbol="scheme",
        unit="1",
        paper="euler",
        description="'euler' takes explicit steps of one length (Eq. 17); 'rkc2' is Runge-Kutta-"
        "Chebyshev of second order, which chooses its steps from the tolerance.",
    )
    step: float = quantity(
        0.002,
        symbol="Δt",
        unit="time unit",
        paper=0.002,
        gt=0,
        description="Time step of 'euler'; first step of 'rkc2'. Records end at multiples of it.",
    )
    tolerance: float = quantity(
        2e-3,
        symbol="δ/σ_LJ",
        unit="1",
        gt=0,
        le=0.1,
        description="Largest error of any node's position that 'rkc2' accepts in a step, over "
        "steric.length.",
    )
    longest_step: float = quantity(
        0.2,
        symbol="Δt_max",
        unit="time unit",
        gt=0,
        description="Longest step of 'rkc2'.",
    )
    ageing_time: float = quantity(
        50.0,
        symbol="t_w",
        unit="time unit",
        paper=50.0,
        ge=0,
        description="Time at zero stress before the shear starts.",
    )
    shear_time: float = quantity(
        1000.0, symbol="t_max", unit="time unit", gt=0, description="Length of the shear stage."
    )


class Recording(Section):
    """What a run writes."""

    stride: int = quantity(
        5,
        symbol="n_s",
        unit="1",
        ge=1,
        le=10**6,
        description="Steps between two samples of the observables.",
    )
    samples_per_decade: int = quantity(
        30,
        symbol="n_dec",
        unit="1",
        ge=1,
        le=10**4,
        description="Records per decade of time; each record is the mean over its interval.",
    )
    longest_interval: float = quantity(
        1.0, symbol="Δt_max", unit="time unit", gt=0, description="Longest interval of one record."
    )
    profiles: int = quantity(
        20,
        symbol="n_p",
        unit="1",
        ge=1,
        le=10**4,
        description="Velocity profiles, each a mean over its share.",
    )
    bulk_margin: float | None = quantity(
        5.0,
        symbol="m/R",
        unit="1",
        paper=5.0,
        gt=0,
        description="Distance from the walls, in mean radii, where the bulk begins; null records "
        "no bulk observables.",
    )
    snapshots: Annotated[tuple[float, ...], Strict(False)] = quantity(
        (),
        symbol="t_snap",
        unit="time unit",
        description="Times of the shear stage at which membranes and the velocity field are kept.",
    )
    field_spacing: float = quantity(
        0.25,
        symbol="Δ_field/R",
        unit="1",
        gt=0,
        description="Distance between the points of a kept velocity field, in mean radii.",
    )
