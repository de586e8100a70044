"""The tree of all groups of parameters."""

from typing import Literal

from softslip.config.fields import quantity
from softslip.config.sections.base import Section
from softslip.config.sections.channel import Channel, Rheometer, Wall
from softslip.config.sections.discretisation import Hydrodynamics, TimeStepping
from softslip.config.sections.material import Membrane, Particles, Solvent, Steric
from softslip.config.sections.preparation import Expansion, Packing
from softslip.config.sections.recording import Recording
from softslip.config.sections.until import Until


class Tree(Section):
    """The tree of all parameters, each checked by itself but not against the others."""

    fidelity: Literal["preview", "standard", "paper", "converged"] | None = quantity(
        None,
        symbol="fidelity",
        unit="1",
        description="Level whose numerical settings apply where a scenario gives none of its own; "
        "null takes the paper's scheme throughout.",
    )
    accuracy: float | None = quantity(
        None,
        symbol="δ",
        unit="1",
        gt=0,
        lt=1,
        description="Target relative error of slip velocity and shear rates: applies the cheapest "
        "settings whose measured error is no larger, in place of a level.",
    )
    solvent: Solvent = Solvent()
    channel: Channel = Channel()
    wall: Wall = Wall()
    suspension: Particles = Particles()
    packing: Packing = Packing()
    expansion: Expansion = Expansion()
    membrane: Membrane = Membrane()
    steric: Steric = Steric()
    rheometer: Rheometer = Rheometer()
    hydrodynamics: Hydrodynamics = Hydrodynamics()
    time_stepping: TimeStepping = TimeStepping()
    until: Until = Until()
    recording: Recording = Recording()
    seed: int = quantity(
        1, symbol="seed", unit="1", ge=0, le=2**31 - 1, description="Seed of all randomness."
    )
