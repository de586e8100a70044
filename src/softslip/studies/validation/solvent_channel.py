"""Channels without particles, on which several cases stand."""

from collections.abc import Mapping
from typing import Any

from softslip.config.parameters import Parameters
from softslip.simulation.assembly import regularisation_of
from softslip.studies.boxes import merged
from softslip.studies.validation.case import Fidelity
from softslip.studies.validation.solutions import MeshSheets, RegularisedSheets

LENGTH = 1 / 16
"""Period along the flow, on which nothing depends [length unit]."""


def level_of(fidelity: Fidelity) -> str | None:
    """Return the level as the product's parameters know it."""
    return None if fidelity == "literal" else fidelity


def empty_channel(fidelity: Fidelity, **groups: Mapping[str, Any]) -> Parameters:
    """Return the parameters of a channel without particles.

    Parameters
    ----------
    fidelity
        Level of the numerical settings.
    **groups
        Groups of parameters, as in a scenario.

    Raises
    ------
    ConfigError
        When they contradict each other.
    """
    tree = {
        "fidelity": level_of(fidelity),
        "channel": {"length": LENGTH},
        "suspension": {"area_fraction": 0.0},
        "recording": {"bulk_margin": None},
    }
    return Parameters.from_mapping(merged(tree, groups))


def exact_sheets(given: Parameters) -> RegularisedSheets | MeshSheets:
    """Return the exact solution for the regularised walls of a channel under traction."""
    height = given.channel.height
    if given.hydrodynamics.mobility == "grid":
        return MeshSheets(height, 1.0 / given.hydrodynamics.resolution)
    return RegularisedSheets(height, regularisation_of(given))
