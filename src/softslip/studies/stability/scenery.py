"""The scenes that the map and the limits are measured on, as parameters and ready to run."""

import functools
import json
import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import FloatArray
from softslip.studies import scenes
from softslip.studies.stability.map_design import MapDesign

Scheme = Literal["standard", "literal"]
"""The level of fidelity 'standard', or the paper's mesh and Euler steps."""

SCHEMES: tuple[Scheme, ...] = ("standard", "literal")

Tree = Mapping[str, Any]
"""Parameters as a nested mapping, not yet checked: what cannot be run is a result."""

NARROW = 1 / 16
"""Period of channels that are high, or that hold few particles [length unit]."""

FILL = 0.84
"""Area fraction where it is not the axis, that of the paper."""

CLEAREST = 2.4
"""Height that a rough wall adds to a channel, in radii of its bumps: what both walls' bumps take,
and some room between them."""

FEWEST = 6
"""Particles that fill a small channel; fewer swim in the same one."""


def merged(tree: Tree, changes: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return a tree with some values of some groups replaced."""
    result = dict(tree)
    for group, values in changes.items():
        result[group] = {**result.get(group, {}), **values}
    return result


def particle_area() -> float:
    """Return the mean area of a particle [length unit squared]."""
    small = 2 * scenes.MEAN_RADIUS / (1 + scenes.SIZE_RATIO)
    return 0.5 * math.pi * small**2 * (1 + scenes.SIZE_RATIO**2)


def start_tree(
    design: MapDesign, count: int, length: float, *, roughness: float = 0.0, fraction: float = FILL
) -> dict[str, Any]:
    """Return the parameters of a box of N particles of period L_x between walls.

    The height follows from the area fraction of the area that bumps leave free; with no particles
    it is that of a channel for one.
    """
    each = particle_area()
    height = max(count, FEWEST) * each / (FILL * length)
    if roughness:
        height += CLEAREST * roughness * scenes.MEAN_RADIUS
    if 0 < count < FEWEST:
        fraction = count * each / (length * height)
    return {
        "fidelity": "standard",
        "seed": design.seed,
        "channel": {"length": length, "height": height, "outer_gap": scenes.outer_gap(height)},
        "suspension": {
            "area_fraction": fraction if count else 0.0,
            "mean_radius": scenes.MEAN_RADIUS,
            "area_reference": "free",
        },
        "wall": {"roughness": roughness},
        "rheometer": {"stress": scenes.STRESS},
        "time_stepping": {"ageing_time": design.ageing},
        "recording": {"bulk_margin": None},
    }


def dense(design: MapDesign) -> dict[str, Any]:
    """Return the start of the scene in which neither walls nor packing vary."""
    return start_tree(design, design.particles, scenes.channel_sides(design.particles)[0])


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
        membranes = scenes.renoded(membranes, parameters)
    return scenes.scene_of(membranes, parameters, rested["wall_displacement"].values)


def periodic_difference(first: FloatArray, second: FloatArray, length: float) -> FloatArray:
    """Return the nearest image of first - second, of nodes at material points, (nodes, 2)."""
    apart: FloatArray = first - second
    apart[:, 0] -= length * np.round(apart[:, 0] / length)
    return apart
