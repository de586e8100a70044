"""Channels without particles, on which several cases stand."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.assembly import regularisation_of
from softslip.solver.geometry import Layout
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
    channel = {"length": LENGTH, **groups.get("channel", {})}
    tree: dict[str, Any] = {
        "fidelity": level_of(fidelity),
        "suspension": {"area_fraction": 0.0},
        "recording": {"bulk_margin": None},
        **groups,
        "channel": channel,
    }
    return Parameters.from_mapping(tree)


def empty_layout(given: Parameters) -> Layout:
    """Return the nodes of the walls of a channel without particles."""
    nobody = {"nodes_per_particle": np.empty(0, np.int64), "reference_area": np.empty(0)}
    packing = xr.Dataset({name: ("particle", values) for name, values in nobody.items()})
    return assembly.layout_of(packing, given)


def exact_sheets(given: Parameters) -> RegularisedSheets | MeshSheets:
    """Return the exact solution for the regularised walls of a channel under traction."""
    height = given.channel.height
    if given.hydrodynamics.mobility == "grid":
        return MeshSheets(height, 1.0 / given.hydrodynamics.resolution)
    return RegularisedSheets(height, regularisation_of(given))
