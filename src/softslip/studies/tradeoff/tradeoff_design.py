"""What the trade of speed for accuracy is measured over: scenes, settings, windows and lengths."""

from typing import Annotated, Any, Literal

from pydantic import Field, Strict
from pydantic_core import ErrorDetails

from softslip.config.fields import quantity
from softslip.config.sections import Section, Standalone
from softslip.errors import ConfigError
from softslip.messages import brief

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Values = Annotated[tuple[Positive, ...], Strict(False)]
Roughnesses = Annotated[tuple[NotNegative, ...], Strict(False)]
Spreads = Annotated[tuple[Positive | None, ...], Strict(False)]
Counts = Annotated[tuple[int, ...], Strict(False)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
"""A name that is safe in file names on every system."""


def _axis(*values: float | None, symbol: str, unit: str = "1", description: str) -> Any:
    return quantity(values, symbol=symbol, unit=unit, min_length=1, description=description)


class Variant(Section):
    """Settings that differ from a level's in one thing, to see what that thing does."""

    effect: str = quantity(
        "", symbol="effect", unit="1", description="What is varied, in a few words."
    )
    level: Literal["literal", "preview", "standard", "paper", "converged"] = quantity(
        "standard",
        symbol="level",
        unit="1",
        description="Level that it varies; 'literal' is the paper's own scheme.",
    )
    settings: dict[str, dict[str, Any]] = quantity(
        {}, symbol="settings", unit="1", description="Values by group and key that differ."
    )
    precision: Literal["double", "single"] = quantity(
        "double",
        symbol="precision",
        unit="1",
        description="'single' rounds what goes into and out of the Stokes solver to 24 bits.",
    )
    outer_gap: float | None = quantity(
        None,
        symbol="L_y - H",
        unit="length unit",
        gt=0,
        description="Solvent outside the walls, rounded so that meshes fit; null keeps that of the "
        "scene.",
    )
    short: bool = quantity(
        False,
        symbol="short",
        unit="1",
        description="Whether it costs so much that it runs over the short window only.",
    )


class SteadyDesign(Section):
    """Long runs for steady averages and their statistical errors."""

    regularisations: Spreads = _axis(
        0.1, 0.4, None, 1.56, symbol="ε/dx", description="As in the design."
    )
    stresses: Values = _axis(
        0.05, 1.0, symbol="σ", unit="stress unit", description="Imposed stresses."
    )
    roughnesses: Roughnesses = _axis(0.0, 0.59, symbol="β", description="Wall roughnesses.")
    seeds: Counts = quantity(
        (1, 2), symbol="seed", unit="1", min_length=1, description="Seeds of the packings."
    )
    wide_regularisations: Spreads = quantity(
        (None,),
        symbol="ε/dx",
        unit="1",
        description="Regularisation lengths at which smooth walls also have twice the period along "
        "the flow, and twice the particles; empty for none.",
    )
    ageing: float = quantity(
        50.0, symbol="t_w", unit="time unit", gt=0, description="Time at rest before the stress."
    )
    duration: float = quantity(
        150.0, symbol="t_max", unit="time unit", gt=0, description="Length of each run."
    )


class TradeoffDesign(Standalone):
    """Scenes, settings and windows; the defaults are those of the full size.

    ``null`` among the regularisation lengths is that of the paper's mesh at 1/8192, 0.86 dx.
    """

    particles: int = quantity(
        44, symbol="N", unit="1", ge=16, le=400, description="Particles of a smooth channel."
    )
    seed: int = quantity(1, symbol="seed", unit="1", ge=0, description="Seed of the packings.")
    stresses: Values = _axis(
        0.05,
        0.5,
        symbol="σ",
        unit="stress unit",
        description="Imposed stresses, below and above the yield stress.",
    )
    roughnesses: Roughnesses = _axis(0.0, 0.59, symbol="β", description="Wall roughnesses.")
    ageing: float = quantity(
        50.0, symbol="t_w", unit="time unit", gt=0, description="Time at rest."
    )
    shearing: float = quantity(
        40.0,
        symbol="t_0",
        unit="time unit",
        gt=0,
        description="Time under stress, at 'standard', before anything is measured.",
    )
    settling: float = quantity(
        2.0,
        symbol="t_f",
        unit="time unit",
        gt=0,
        description="Time that follows on the closest nodes, so that films fit them.",
    )
    interval: float = quantity(
        1.0,
        symbol="Δt_rec",
        unit="time unit",
        gt=0,
        description="Time that a record is the mean of.",
    )
    skipped: int = quantity(
        1,
        symbol="n_skip",
        unit="1",
        ge=0,
        description="First records, in which films settle on the member's own nodes.",
    )
    records: int = quantity(
        3, symbol="n_rec", unit="1", ge=1, description="Records that count, after those."
    )
    short_records: int = quantity(
        1,
        symbol="n_short",
        unit="1",
        ge=1,
        description="Records that count of members that are run for a short time only.",
    )
    regularisations: Spreads = _axis(
        0.06, 0.1, 0.2, 0.4, None, symbol="ε/dx", description="Regularisation lengths."
    )
    node_spacings: Values = _axis(2.0, 4.0, 5.0, 6.0, symbol="Δs/dx", description="Node spacings.")
    tolerances: Values = _axis(
        1e-3, 5e-3, 2.5e-2, symbol="δ/σ_LJ", description="Errors of a step that are accepted."
    )
    finest_tolerance: float = quantity(
        1e-4,
        symbol="δ/σ_LJ",
        unit="1",
        gt=0,
        description="Tolerance of the member that others are compared with, at each "
        "regularisation length on the closest nodes.",
    )
    closer_spacing: float | None = quantity(
        1.42,
        symbol="Δs/dx",
        unit="1",
        gt=0,
        description="Node spacing of one more member, to see the finest one's own error; null for "
        "none.",
    )
    perturbation: float = quantity(
        1e-6,
        symbol="δx/σ_LJ",
        unit="1",
        gt=0,
        description="Displacement of the nodes of the finest member's twin, which shows how fast "
        "trajectories part.",
    )
    levels: Annotated[
        tuple[Literal["preview", "standard", "paper", "converged"], ...], Strict(False)
    ] = quantity(
        ("preview", "standard", "paper", "converged"),
        symbol="levels",
        unit="1",
        description="Levels of fidelity that are members too.",
    )
    variants: dict[Name, Variant] = quantity(
        {}, symbol="variants", unit="1", description="Members that vary a level in one thing."
    )
    steady: SteadyDesign = SteadyDesign()

    @classmethod
    def refused(cls, detail: ErrorDetails) -> ConfigError:
        """Return the error as `Standalone` does; the names of variants are the user's."""
        first, *rest = detail["loc"]
        if first != "variants" or not rest:
            return super().refused(detail)
        key = ".".join(["variants", *(str(part) for part in rest if part != "[key]")])
        limit = detail["msg"].replace("Input should", "must").replace("String should", "must")
        keys = ", ".join(Variant.model_fields)
        return ConfigError(
            key,
            brief(detail["input"]),
            limit,
            f"a variant has a name for a file and the keys {keys}",
        )

    @property
    def window(self) -> tuple[int, int]:
        """Records of a member of full length, and of a short one."""
        return self.skipped + self.records, self.skipped + min(self.short_records, self.records)
