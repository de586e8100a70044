"""The channel: its box, its walls, and what drives them."""

from typing import Literal

from softslip.config.fields import quantity
from softslip.config.sections.base import Section


class Channel(Section):
    """The sheared gap and the solvent outside it (Sec. III)."""

    length: float = quantity(
        0.5,
        symbol="L_x",
        unit="length unit",
        paper=0.5,
        gt=0,
        le=100,
        label="channel_length",
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
        description="Target distance between bump centres over the bump radius; the actual one "
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
