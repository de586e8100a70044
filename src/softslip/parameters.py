"""The scenario's parameters: frozen, strict models with units, symbols and the paper's values.

"Eq.", "Table" and "Sec." mean those of Jung & Fielding, *Wall slip and bulk yielding in soft
particle suspensions*. Lengths are in units of the paper's box height, stresses in units of its
membrane modulus, and the time unit follows from the viscosity. Values are checked once, here;
below this module nobody checks again.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Strict, ValidationError, model_validator

from softslip.errors import ConfigError
from softslip.fidelity import with_level
from softslip.fields import NOTHING, brief, owner, quantity, refusal, value_at

REFERENCE_MESH_SIZE = 1.0 / 8192.0
"""Mesh size dx_ref of the paper [length unit]."""

EWALD_REACH = 5.5
"""Reach of the Ewald sum's near part over its split length at most, where it ends by itself."""

SPLIT_OVER_SPACING = 1.2
"""Split length over the node spacing at which the two parts of the Ewald sum cost least."""

SPLIT_OVER_REGULARISATION = 1.5
"""Smallest split length over the regularisation length: below, the near sum has nothing to do."""

PLAIN_SPACING = 2.5
"""Largest node spacing over the regularisation length for the plain trapezoidal rule: it misses
e^{-(2π/2.5)²} = 0.2 % of a smooth force."""

LEAST_REGULARISATION = 0.01
"""Smallest regularisation length over the node spacing for the corrected rule: the velocity of a
node then takes half of its digits from the difference of two logarithms."""

MOST_CELLS_APART = 4.0
"""Largest node spacing over the mesh size on the mesh of the paper's scheme."""

REFERENCE_NODE_SPACING = 1.42 * REFERENCE_MESH_SIZE
"""Spacing Δs_ref of the paper's boundary nodes [length unit], on which K_LJ is defined."""


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class Solvent(_Section):
    """The Newtonian fluid inside and around the particles (Table III)."""

    viscosity: float = quantity(
        1.0, symbol="η", unit="viscosity unit", paper=1.0, gt=0, description="Solvent viscosity."
    )


class Channel(_Section):
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


class Wall(_Section):
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


class Suspension(_Section):
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


class Packing(_Section):
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


class Expansion(_Section):
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


class Membrane(_Section):
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


class Steric(_Section):
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


class Rheometer(_Section):
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


class Hydrodynamics(_Section):
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


class TimeStepping(_Section):
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


class Recording(_Section):
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


class _Fields(_Section):
    """The tree of all parameters, each checked by itself but not against the others."""

    fidelity: Literal["preview", "standard", "paper", "converged"] | None = quantity(
        None,
        symbol="fidelity",
        unit="1",
        description="Level whose numerical settings apply where a scenario gives none of its own; "
        "null takes the paper's scheme throughout.",
    )
    solvent: Solvent = Solvent()
    channel: Channel = Channel()
    wall: Wall = Wall()
    suspension: Suspension = Suspension()
    packing: Packing = Packing()
    expansion: Expansion = Expansion()
    membrane: Membrane = Membrane()
    steric: Steric = Steric()
    rheometer: Rheometer = Rheometer()
    hydrodynamics: Hydrodynamics = Hydrodynamics()
    time_stepping: TimeStepping = TimeStepping()
    recording: Recording = Recording()
    seed: int = quantity(
        1, symbol="seed", unit="1", ge=0, le=2**31 - 1, description="Seed of all randomness."
    )


class Parameters(_Fields):
    """Everything that determines a run.

    Raises
    ------
    ConfigError
        When two values contradict each other.
    """

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for check in CHECKS:
            check(self)
        return self

    @classmethod
    def from_mapping(cls, tree: Mapping[str, Any]) -> "Parameters":
        """Validate a nested mapping, as read from YAML or JSON.

        Parameters
        ----------
        tree
            Any subset of the tree; groups are mappings or already validated models.

        Raises
        ------
        ConfigError
            Naming the first offending key, its value, the limit and a remedy.
        """
        try:
            return cls.model_validate(with_level(tree))
        except ValidationError as error:
            raise refusal(cls, error.errors()[0]) from None


def check_fields(tree: Mapping[str, Any]) -> None:
    """Check the keys and values of a nested mapping by themselves, not against one another.

    Raises
    ------
    ConfigError
        Naming the first offending key, its value, the limit and a remedy.
    """
    try:
        _Fields.model_validate(dict(tree))
    except ValidationError as error:
        raise refusal(_Fields, error.errors()[0]) from None


def check_value(path: str, value: object) -> Any:
    """Return one value as the tree would hold it, such as 0.0 for 0 where a float belongs.

    Raises
    ------
    ConfigError
        When there is no such parameter, or when the value is not one that it can take.
    """
    _, name = field_at(path, value)
    *sections, _ = path.split(".")
    tree: dict[str, Any] = {name: value}
    for section in reversed(sections):
        tree = {section: tree}
    try:
        held: Any = _Fields.model_validate(tree)
    except ValidationError as error:
        raise refusal(_Fields, error.errors()[0]) from None
    return value_at(held, path)


def field_at(path: str, value: object = NOTHING) -> tuple[type[BaseModel], str]:
    """Return the model and the field name that a dotted parameter path names.

    ``value`` is what an error message shows as given for the path.

    Raises
    ------
    ConfigError
        When there is no such parameter, or when it is a group of parameters.
    """
    return owner(Parameters, path, value)


MESH_TOLERANCE = 1e-6
"""A box counts as divided by the mesh if its size is a whole number of cells to this many cells."""

FEWEST_CELLS = 16
"""Smallest number of mesh cells on a side of the box."""

SMALLEST_BUMP = 0.5
"""Smallest bump radius over the mesh size; a smaller one would fall between the mesh points."""

DENSEST = 0.97
"""Largest part of the free area between the bumps that particles may fill."""

MOST_PARTICLES = 100_000
"""More particles than this are taken for a slip of the pen in a length."""

MOST_STEPS = 10**9
"""More time steps than this are taken for a slip of the pen in a time."""


def _check_box(parameters: Parameters) -> None:
    channel, resolution = parameters.channel, parameters.hydrodynamics.resolution
    sides = {
        "channel.length": (channel.length, 0.0),
        "channel.outer_gap": (channel.outer_gap, channel.height),
    }
    for key, (value, other) in sides.items():
        cells = (value + other) * resolution
        if abs(cells - round(cells)) <= MESH_TOLERANCE and round(cells) >= FEWEST_CELLS:
            continue
        fewest = max(FEWEST_CELLS, math.floor(other * resolution) + 1)
        nearest = max(round(cells), fewest) / resolution - other
        raise ConfigError(
            key,
            value,
            f"makes {'the period across the flow' if other else 'a period'} of {cells:.8g} mesh "
            f"cells, not a whole number of at least {FEWEST_CELLS}, "
            f"at hydrodynamics.resolution {resolution}",
            f"the nearest value that fits is {nearest:.15g}",
        )


def best_split(regularisation: float, node_spacing: float) -> float:
    """Return the split length a of the Ewald sum that costs least, in the unit of its arguments.

    Parameters
    ----------
    regularisation, node_spacing
        ε and Δs.
    """
    return max(SPLIT_OVER_SPACING * node_spacing, SPLIT_OVER_REGULARISATION * regularisation)


def split_length(parameters: Parameters) -> float:
    """Return the split length a of the Ewald sum [length unit], chosen where none is given.

    Where the box has no room for the one that costs least, it is as long as there is room for.
    """
    hydrodynamics = parameters.hydrodynamics
    if hydrodynamics.split is not None:
        return hydrodynamics.split / hydrodynamics.resolution
    best = best_split(hydrodynamics.regularisation or 1.0, hydrodynamics.node_spacing)
    return min(best / hydrodynamics.resolution, _room(parameters) / EWALD_REACH)


def _room(parameters: Parameters) -> float:
    """Return how far the near sum may reach: not across the outer gap, nor twice around."""
    return min(parameters.channel.outer_gap, parameters.channel.length / 3)


def _check_ewald(parameters: Parameters) -> None:
    hydrodynamics, room = parameters.hydrodynamics, _room(parameters)
    if hydrodynamics.mobility != "ewald":
        return
    split = split_length(parameters)
    reach = EWALD_REACH * split
    if reach > room * (1 + 1e-12):
        raise ConfigError(
            "hydrodynamics.split",
            brief(hydrodynamics.split),
            f"makes the near sum reach {reach:.4g}, beyond {room:.4g}, the smaller of "
            "channel.outer_gap and a third of channel.length",
            f"use a split of at most {room / EWALD_REACH * hydrodynamics.resolution:.4g}, a "
            "larger channel.outer_gap, or mobility 'grid'",
        )
    smallest = SPLIT_OVER_REGULARISATION * (hydrodynamics.regularisation or 1.0)
    if split * hydrodynamics.resolution < smallest:
        raise ConfigError(
            "hydrodynamics.split",
            brief(hydrodynamics.split),
            f"makes the split {split * hydrodynamics.resolution:.4g}, below {smallest:.4g}, "
            f"{SPLIT_OVER_REGULARISATION:g} regularisation lengths, which leaves nothing to the "
            "near sum",
            "use null, which takes the split that costs least, and a channel.outer_gap with room "
            "for it",
        )


def _check_nodes(parameters: Parameters) -> None:
    """Check that nodes are close enough for the quadrature and for what they stand for."""
    hydrodynamics = parameters.hydrodynamics
    for key in ("quadrature", "regularisation"):
        value = getattr(hydrodynamics, key)
        if hydrodynamics.mobility == "grid" and value not in ("plain", None):
            raise ConfigError(
                f"hydrodynamics.{key}",
                value,
                "has no meaning on the mesh of hydrodynamics.mobility 'grid'",
                "use mobility 'ewald'",
            )
    spacing, spread = hydrodynamics.node_spacing, hydrodynamics.regularisation or 1.0
    limits: list[tuple[float, str]] = []
    if parameters.suspension.area_fraction > 0:
        apart = parameters.steric.length * hydrodynamics.resolution
        limits.append((apart, "steric.length, beyond which one membrane slips through another"))
    if hydrodynamics.mobility == "grid":
        limits.append((MOST_CELLS_APART, "mesh sizes, beyond which solvent leaks between nodes"))
    elif hydrodynamics.quadrature == "plain":
        limits.append((PLAIN_SPACING * spread, "what the plain sum resolves; 'corrected' goes on"))
    else:
        limits.append((spread / LEAST_REGULARISATION, "a hundred regularisation lengths"))
    limit, what = min(limits)
    if spacing > limit * (1 + 1e-12):
        raise ConfigError(
            "hydrodynamics.node_spacing",
            spacing,
            f"is more than {limit:.4g}, {what}",
            "use a smaller spacing",
        )


def bump_radius(parameters: Parameters) -> float:
    """Return the bump radius b [length unit]; 0 for a smooth wall."""
    return parameters.wall.roughness * parameters.suspension.mean_radius


def bump_count(parameters: Parameters) -> int:
    """Return the whole number of bumps in a period that is nearest to the wanted separation."""
    bump = bump_radius(parameters)
    separation = parameters.wall.bump_separation * bump
    return max(1, round(parameters.channel.length / separation)) if bump > 0 else 0


def _check_bumps(parameters: Parameters) -> None:
    wall, channel = parameters.wall, parameters.channel
    radius, bump = parameters.suspension.mean_radius, bump_radius(parameters)
    limit = min(channel.length, channel.height) / 2
    if bump >= limit:
        raise ConfigError(
            "wall.roughness",
            wall.roughness,
            f"makes bumps of radius {bump:.4g}, which must stay below {limit:.4g}, half the "
            "smaller of channel.length and channel.height",
            f"use less than {limit / radius:.4g} or a larger channel",
        )
    smallest = SMALLEST_BUMP / parameters.hydrodynamics.resolution
    if wall.roughness > 0 and bump < smallest:
        raise ConfigError(
            "wall.roughness",
            wall.roughness,
            f"makes bumps of radius {bump:.4g}, too small for the mesh to see: at least "
            f"{smallest:.4g} is needed at hydrodynamics.resolution "
            f"{parameters.hydrodynamics.resolution}",
            f"use 0 for a smooth wall, or at least {smallest / radius:.4g}",
        )
    if bump_count(parameters) * 2 * bump > channel.length:
        raise ConfigError(
            "wall.bump_separation",
            wall.bump_separation,
            "makes neighbouring bumps overlap",
            "use a value well above 2, for example 5.0, as the paper",
        )


def _check_free_area(parameters: Parameters) -> None:
    fraction, channel = parameters.suspension.area_fraction, parameters.channel
    bump_area = bump_count(parameters) * math.pi * bump_radius(parameters) ** 2
    taken = bump_area if parameters.suspension.area_reference == "channel" else 0.0
    free = 1.0 - taken / (channel.length * channel.height)
    if fraction > DENSEST * free:
        raise ConfigError(
            "suspension.area_fraction",
            fraction,
            f"cannot fit: the bumps leave {free:.4g} of the channel free, of which at most "
            f"{DENSEST:g} can be filled",
            f"use at most {math.floor(1e4 * DENSEST * free) / 1e4:g}, or a smaller wall.roughness",
        )


def _check_particles(parameters: Parameters) -> None:
    suspension, channel = parameters.suspension, parameters.channel
    if suspension.area_fraction == 0:
        return
    larger = 2 * suspension.size_ratio / (1 + suspension.size_ratio) * suspension.mean_radius
    room = {
        "channel.height between bumps": channel.height - 2 * bump_radius(parameters),
        "channel.length": channel.length,
    }
    for name, width in room.items():
        if 2 * larger > width:
            raise ConfigError(
                "suspension.mean_radius",
                suspension.mean_radius,
                f"makes particles of diameter {2 * larger:.4g}, wider than the {name} "
                f"of {width:.4g}",
                "use a smaller radius or a larger channel",
            )
    smaller = larger / suspension.size_ratio
    area = 0.5 * math.pi * (smaller**2 + larger**2)
    count = suspension.area_fraction * channel.length * channel.height / area
    if not 0.5 <= count <= MOST_PARTICLES:
        raise ConfigError(
            "suspension.mean_radius",
            suspension.mean_radius,
            f"makes {count:.4g} particles at area fraction {suspension.area_fraction:g}, "
            f"which must be 1 to {MOST_PARTICLES}",
            "use another radius or channel, or suspension.area_fraction 0 for no particles",
        )


def _check_bulk(parameters: Parameters) -> None:
    margin, radius = parameters.recording.bulk_margin, parameters.suspension.mean_radius
    if margin is None:
        return
    mesh_size = 1.0 / parameters.hydrodynamics.resolution
    needed = 2 * margin * radius + 3 * mesh_size
    if parameters.channel.height < needed:
        raise ConfigError(
            "channel.height",
            parameters.channel.height,
            f"leaves no bulk between the two margins of {margin:g} mean radii: at least "
            f"{needed:.4g} is needed",
            "use a larger height, or set recording.bulk_margin to null to record no bulk "
            "observables",
        )


def _check_rheometer(parameters: Parameters) -> None:
    rheometer = parameters.rheometer
    given: dict[str, float | None] = {
        "stress": rheometer.stress,
        "shear_rate": rheometer.shear_rate,
    }
    imposed = "stress" if rheometer.mode == "stress" else "shear_rate"
    if given.pop(imposed) is None:
        raise ConfigError(
            f"rheometer.{imposed}",
            brief(None),
            f"must be a number when rheometer.mode is '{rheometer.mode}'",
            f"give rheometer.{imposed}",
        )
    for other, value in given.items():
        if value is not None:
            raise ConfigError(
                f"rheometer.{other}",
                value,
                f"has no effect when rheometer.mode is '{rheometer.mode}'",
                f"set rheometer.{other} to null",
            )
    if rheometer.mode == "rate" and rheometer.control == "printed":
        raise ConfigError(
            "rheometer.control",
            "printed",
            "is defined for an imposed stress only",
            "use 'exact' when rheometer.mode is 'rate'",
        )


def _check_times(parameters: Parameters) -> None:
    stepping = parameters.time_stepping
    durations = {"shear_time": stepping.shear_time, "ageing_time": stepping.ageing_time}
    for name, duration in durations.items():
        if 0 < duration < stepping.step:
            raise ConfigError(
                f"time_stepping.{name}",
                duration,
                f"is shorter than one step of {stepping.step:g}",
                f"use a longer {name} or a smaller time_stepping.step",
            )
        if duration > MOST_STEPS * stepping.step:
            raise ConfigError(
                f"time_stepping.{name}",
                duration,
                f"takes more than {MOST_STEPS:.0e} steps of {stepping.step:g}",
                f"use a shorter {name} or a larger time_stepping.step",
            )


def _check_snapshots(parameters: Parameters) -> None:
    shear_time, earlier = parameters.time_stepping.shear_time, -math.inf
    for index, time in enumerate(parameters.recording.snapshots):
        if not 0 <= time <= shear_time:
            raise ConfigError(
                f"recording.snapshots[{index}]",
                time,
                f"lies outside the shear stage, 0 to {shear_time:g}",
                "use times within time_stepping.shear_time",
            )
        if time <= earlier:
            raise ConfigError(
                f"recording.snapshots[{index}]",
                time,
                f"does not come after the time before it, {earlier:g}",
                "list each time once, in increasing order",
            )
        earlier = time


CHECKS = (
    _check_bumps,
    _check_free_area,
    _check_particles,
    _check_bulk,
    _check_box,
    _check_ewald,
    _check_nodes,
    _check_rheometer,
    _check_times,
    _check_snapshots,
)
"""What must hold between values of different keys, in the order in which it is checked."""
