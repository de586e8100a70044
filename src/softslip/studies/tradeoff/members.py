"""The members of the trade-off: settings with a name, all measured on the same scenes."""

import math
from dataclasses import dataclass, field
from typing import Literal

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError
from softslip.studies.bench import trajectories
from softslip.studies.boxes import Tree, merged, nearest_gap
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign, Variant

Kind = Literal["factorial", "finest", "closer", "twin", "level", "variant"]
"""Of the grid of settings; the finest of each regularisation length; one on closer nodes still;
the finest from displaced nodes; a level of fidelity; one that varies a level in one thing."""

LEVEL = "standard"
"""Level that gives members what the design does not vary, and that costs are compared with."""

LITERAL = "literal"
"""What the paper's own scheme is called, which has no level."""

CONTACT_SPACING = 1.7
"""Largest distance of contact points over the mesh size in the grid: wherever it is larger, it and
not the node spacing decides the error (0.4 % at 1.7, 0.8 % at 2.0, 2.5 % at 2.5), while more points
hardly cost anything."""

FEWEST_POINTS = 2
"""Contact points per node at least, as in every level."""


@dataclass(frozen=True)
class Member:
    """Settings under a name.

    Attributes
    ----------
    name
        Unique, and safe in file names.
    kind
        What it is there for.
    level
        Level of fidelity that gives the settings that are not named; None is the paper's scheme.
    settings
        Values by group and key.
    effect
        What a variant varies, in words.
    precision
        'single' rounds what goes into and out of the Stokes solver.
    outer_gap
        Wanted solvent outside the walls; None keeps the scene's [length unit].
    short
        Whether it runs over the short window only.
    """

    name: str
    kind: Kind
    level: str | None = LEVEL
    settings: Tree = field(default_factory=dict)
    effect: str = ""
    precision: Literal["double", "single"] = "double"
    outer_gap: float | None = None
    short: bool = False


def parameters_of(
    member: Member,
    design: TradeoffDesign,
    stress: float,
    roughness: float,
    *,
    seed: int | None = None,
) -> Parameters:
    """Return the parameters of a member's run on one scene.

    Raises
    ------
    ConfigError
        When its settings contradict each other or the scene.
    """
    # A rough channel is as dense as a smooth one between its bumps.
    scene = {"suspension": {"area_reference": "free"}, "wall": {"roughness": roughness}}
    groups = merged(scene, member.settings)
    channel = dict(groups.pop("channel", {}))
    given = trajectories.parameters_of(
        design.particles,
        member.level,
        stress,
        seed=design.seed if seed is None else seed,
        **groups,
    )
    if member.outer_gap is not None:
        channel["outer_gap"] = nearest_gap(given.channel.height, member.outer_gap)
    if not channel:
        return given
    return Parameters.from_mapping(merged(given.model_dump(), {"channel": channel}))


def members_of(design: TradeoffDesign) -> dict[str, Member]:
    """Return all members of a design by name: first the finest, then the grid, levels and variants.

    Raises
    ------
    ConfigError
        When a variant has the name of another member.
    """
    found = {
        member.name: member for member in (*_finest(design), *_factorial(design), *_levels(design))
    }
    for name, variant in design.variants.items():
        if name in found:
            raise ConfigError(
                f"variants.{name}", name, "is the name of another member", "use another name"
            )
        found[name] = _variant(name, variant)
    return found


def reference_of(design: TradeoffDesign) -> Member:
    """Return the member whose cost is measured in every job beside the member's own."""
    return Member("reference", "level", LEVEL)


def finest_name(regularisation: float | None) -> str:
    """Return the name of the finest member of a regularisation length."""
    return f"finest-e{_length_text(regularisation)}"


def smallest(regularisations: tuple[float | None, ...]) -> float | None:
    """Return the smallest of some regularisation lengths, of which None is the mesh's own."""
    return min(regularisations, key=lambda value: 1.0 if value is None else value)


def finest_member(design: TradeoffDesign, regularisation: float | None) -> Member:
    """Return the member of the closest nodes and the least tolerance."""
    tree = _settings(regularisation, min(design.node_spacings), design.finest_tolerance)
    return Member(finest_name(regularisation), "finest", settings=tree)


def _finest(design: TradeoffDesign) -> list[Member]:
    found = [finest_member(design, each) for each in design.regularisations]
    least = smallest(design.regularisations)
    settings = finest_member(design, least).settings
    found.append(Member("twin", "twin", settings=settings))
    if design.closer_spacing is not None:
        closer = _settings(least, design.closer_spacing, design.finest_tolerance)
        found.append(Member("closer", "closer", settings=closer))
    return found


def _factorial(design: TradeoffDesign) -> list[Member]:
    return [
        Member(
            f"e{_length_text(length)}-n{spacing:g}-t{tolerance:g}",
            "factorial",
            settings=_settings(length, spacing, tolerance),
        )
        for length in design.regularisations
        for spacing in design.node_spacings
        for tolerance in design.tolerances
    ]


def _levels(design: TradeoffDesign) -> list[Member]:
    return [Member(f"level-{name}", "level", name) for name in design.levels]


def _variant(name: str, variant: Variant) -> Member:
    return Member(
        name,
        "variant",
        None if variant.level == LITERAL else variant.level,
        variant.settings,
        variant.effect,
        variant.precision,
        variant.outer_gap,
        variant.short,
    )


def _settings(length: float | None, spacing: float, tolerance: float) -> Tree:
    """Return what the grid varies, with as many contact points as the node spacing asks for."""
    points = max(FEWEST_POINTS, math.ceil(spacing / CONTACT_SPACING))
    return {
        "steric": {"refinement": points},
        "hydrodynamics": {"regularisation": length, "node_spacing": spacing},
        "time_stepping": {"tolerance": tolerance},
    }


def _length_text(value: float | None) -> str:
    return "mesh" if value is None else f"{value:g}"
