"""The scenes that the map and the limits are measured on, as parameters and ready to run."""

import functools
import json
from typing import Any, Literal

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import FloatArray
from softslip.studies import boxes, scenes
from softslip.studies.boxes import Tree, merged, particle_area
from softslip.studies.membrane_nodes import renoded
from softslip.studies.stability.map_design import MapDesign

Scheme = Literal["standard", "literal"]
"""The level of fidelity 'standard', or the paper's mesh and Euler steps."""

SCHEMES: tuple[Scheme, ...] = ("standard", "literal")

NARROW = 1 / 16
"""Period of channels that are high, or that hold few particles [length unit]."""

CLEAREST = 2.4
"""Height that a rough wall adds to a channel, in radii of its bumps: what both walls' bumps take,
and some room between them."""

FEWEST = 6
"""Particles that fill a small channel; fewer swim in the same one."""


def start_tree(
    design: MapDesign,
    count: int,
    length: float,
    *,
    roughness: float = 0.0,
    fraction: float = boxes.AREA_FRACTION,
) -> dict[str, Any]:
    """Return the parameters of a box of N particles of period L_x between walls.

    The height follows from the area fraction of the area that bumps leave free; with no particles
    it is that of a channel for one.
    """
    each = particle_area()
    height = max(count, FEWEST) * each / (boxes.AREA_FRACTION * length)
    if roughness:
        height += CLEAREST * roughness * boxes.MEAN_RADIUS
    if 0 < count < FEWEST:
        fraction = count * each / (length * height)
    return {
        "fidelity": "standard",
        "seed": design.seed,
        "channel": {"length": length, "height": height, "outer_gap": boxes.outer_gap(height)},
        "suspension": {
            "area_fraction": fraction if count else 0.0,
            "mean_radius": boxes.MEAN_RADIUS,
            "area_reference": "free",
        },
        "wall": {"roughness": roughness},
        "rheometer": {"stress": boxes.STRESS},
        "time_stepping": {"ageing_time": design.ageing},
        "recording": {"bulk_margin": None},
    }


def dense(design: MapDesign) -> dict[str, Any]:
    """Return the start of the scene in which neither walls nor packing vary."""
    return start_tree(design, design.particles, boxes.channel_sides(design.particles)[0])


def in_scheme(design: MapDesign, start: Tree, scheme: Scheme) -> dict[str, Any]:
    """Return the parameters of a run in a scheme that begins from a start.

    On a mesh coarser than the paper's, contacts keep points as close as its nodes: farther apart
    they interlock.
    """
    if scheme == "standard":
        return dict(start)
    coarser = round(1.0 / (design.resolution * REFERENCE_MESH_SIZE))
    return merged(
        {**start, "fidelity": None, "hydrodynamics": {}, "time_stepping": {}},
        {"hydrodynamics": {"resolution": design.resolution}, "steric": {"refinement": coarser}},
    )


@functools.cache
def _aged(start: str) -> xr.Dataset:
    return scenes.aged_packing(Parameters.from_mapping(json.loads(start)))


def aged(start: Tree) -> xr.Dataset:
    """Return the aged membranes of a start, made once in a process.

    Raises
    ------
    SoftslipError
        When there is no such packing.
    """
    return _aged(json.dumps(start, sort_keys=True))


def scene_of(start: Tree, tree: Tree) -> scenes.Scene:
    """Return the aged membranes and walls of a start under other parameters, on their nodes.

    Raises
    ------
    SoftslipError
        When the parameters contradict each other, or there is no such packing.
    """
    parameters = Parameters.from_mapping(tree)
    rested = membranes = aged(start)
    if membranes.sizes["particle"]:
        membranes = renoded(membranes, parameters)
    return scenes.scene_of(membranes, parameters, rested["wall_displacement"].values)


def periodic_difference(first: FloatArray, second: FloatArray, length: float) -> FloatArray:
    """Return the nearest image of first - second, of nodes at material points, (nodes, 2)."""
    apart: FloatArray = first - second
    apart[:, 0] -= length * np.round(apart[:, 0] / length)
    return apart
