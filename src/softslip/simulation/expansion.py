"""Growth of discs into elastic membranes at the suspension's area fraction (Sec. II A 2, Table II).

The final state is the paper's: membranes in tension, grown from discs, that avoid one another and
the walls through a short-ranged repulsion. The way there is shorter. The paper integrates
overdamped dynamics of all hydrodynamic nodes under an internal pressure; here fewer nodes move
with momentum (`simulation.growth`), areas follow a ramp exactly, and the hydrodynamic nodes are
laid on the result.
"""

import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.errors import ExpansionError
from softslip.files.quantities import described
from softslip.simulation.contour import (
    ContourReport,
    centroid,
    check_contours,
    resample,
    signed_areas,
    split,
    with_area,
)
from softslip.simulation.growth import CLOSEST_GAP, Chains, Surroundings, grow
from softslip.simulation.sample import particle_radii, wall_contour
from softslip.simulation.segments import find_candidates
from softslip.solver.geometry import FloatArray, IntArray, chain_neighbours

FEWEST_NODES = 16
"""Nodes of a membrane whatever its size: fewer do not resolve its shape."""

CUTOFF_FACTOR = 2 ** (1 / 6)
"""Range of the contact repulsion over σ_ss' (Table II)."""

SKIN_FACTOR = 0.6
"""Extra reach of the candidate list over the contact range: balances listing and searching."""


def membrane_node_counts(parameters: Parameters) -> IntArray:
    """Return the number of hydrodynamic nodes of each particle, shape (particles,).

    A disc of the particle's area gets nodes at ``hydrodynamics.node_spacing`` mesh sizes
    (Sec. II B: L/N_s), but no fewer than `FEWEST_NODES`.
    """
    spacing = parameters.hydrodynamics.node_spacing / parameters.hydrodynamics.resolution
    counts = np.round(2 * np.pi * particle_radii(parameters) / spacing).astype(np.int64)
    return np.maximum(counts, FEWEST_NODES)


def expand(
    packing: xr.Dataset,
    parameters: Parameters,
    progress: Callable[[float], None] = lambda fraction: None,
) -> xr.Dataset:
    """Grow the discs of a packing into membranes of their final areas.

    Parameters
    ----------
    packing
        What `simulation.packing.pack` returned: ``centre``, ``radius`` and ``final_radius``.
    parameters
        Channel, walls, membrane and contact parameters of the growth, node spacing.
    progress
        Called with the fraction done, from 0 to 1.

    Returns
    -------
    xarray.Dataset
        ``node_position`` (node, axis) in the channel frame, membrane by membrane, anticlockwise
        and unwrapped in x, with centroids in [0, L_x); ``nodes_per_particle``, ``area`` and
        ``target_area`` (particle). Attributes give the area fraction, the largest relative area
        error and the smallest distance between two bodies, the last also over the contact length
        of the shear stage; it is infinite where there are no particles.

    Raises
    ------
    ExpansionError
        When an area falls short, membranes cross each other or a wall, or end closer than
        ``expansion.closest_approach`` times the contact length of the shear stage.
    """
    final_radius = packing["final_radius"].values
    target = math.pi * final_radius**2
    counts = membrane_node_counts(parameters)
    if len(counts) != len(target):
        raise ExpansionError(
            f"the packing holds {len(target)} discs, but the parameters make {len(counts)}; "
            "run the packing stage with the same parameters"
        )
    offsets = np.append(0, np.cumsum(counts))
    membranes = _grown(packing, target, parameters, progress) if len(target) else []
    nodes = [
        _in_channel(with_area(resample(nodes, count), area), parameters.channel.length)
        for nodes, count, area in zip(membranes, counts, target, strict=True)
    ]
    position = np.concatenate([np.empty((0, 2)), *nodes])
    report = check_contours(position, offsets, target, parameters)
    _check_approach(report.smallest_distance, parameters)
    progress(1.0)
    return _dataset(position, offsets, target, report, parameters.steric.length)


def _check_approach(distance: float, parameters: Parameters) -> None:
    limit = parameters.expansion.closest_approach * parameters.steric.length
    if distance < limit:
        raise ExpansionError(
            f"two bodies are only {distance:.3g} apart, closer than expansion.closest_approach "
            f"times steric.length, {limit:.3g}; lower suspension.area_fraction or steric.length, "
            "or raise expansion.contact_pressure"
        )


def _grown(
    packing: xr.Dataset,
    target: FloatArray,
    parameters: Parameters,
    progress: Callable[[float], None],
) -> list[FloatArray]:
    """Grow all discs to their target areas; return the growth nodes of each."""
    expansion = parameters.expansion
    position, chains = _discs(packing, target, parameters)
    velocity = np.zeros_like(position)
    around = _surroundings(parameters)
    skin = SKIN_FACTOR * around.contact_range
    step, last = 0, expansion.ramp_steps + expansion.relaxation_steps
    while step < last:
        candidates = find_candidates(
            position, chains.body, chains.following, around.length, around.contact_range + skin
        )
        steps = (step, expansion.ramp_steps, last)
        step, gap = grow(position, velocity, chains, around, candidates, skin, steps)
        # Written so that NaN fails too.
        if not gap >= CLOSEST_GAP * around.contact_range:
            raise ExpansionError(
                f"the particles find no room to grow: a gap shrank to {gap:.3g} at step {step} of "
                f"{last}; lower suspension.area_fraction or expansion.contact_length, or raise "
                "expansion.ramp_steps"
            )
        progress(step / (last + 1))
    return list(split(position, chains.offsets))


def _discs(
    packing: xr.Dataset, target: FloatArray, parameters: Parameters
) -> tuple[FloatArray, Chains]:
    """Return circular chains at rest around the discs, with about the same spacing everywhere."""
    radius = packing["radius"].values
    counts = np.round(parameters.expansion.growth_nodes * radius / radius.min()).astype(np.int64)
    offsets = np.append(0, np.cumsum(counts))
    body = np.repeat(np.arange(len(counts)), counts)
    angle = 2 * np.pi * (np.arange(offsets[-1]) - offsets[body]) / counts[body]
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    position = packing["centre"].values[body] + radius[body, None] * circle
    preceding, following = chain_neighbours(offsets)
    chains = Chains(
        offsets=offsets,
        body=body,
        following=following,
        preceding=preceding,
        rest_length=2 * radius * np.sin(np.pi / counts),
        start_area=signed_areas(position, offsets),
        target_area=target,
        elastic_constant=parameters.expansion.elastic_constant,
    )
    return position, chains


def _surroundings(parameters: Parameters) -> Surroundings:
    channel, expansion = parameters.channel, parameters.expansion
    contour = wall_contour(parameters)
    return Surroundings(
        length=channel.length,
        height=channel.height,
        bump_radius=contour.bump_radius,
        bump_separation=contour.separation,
        contact_range=CUTOFF_FACTOR * expansion.contact_length,
        contact_pressure=expansion.contact_pressure,
    )


def _in_channel(nodes: FloatArray, length: float) -> FloatArray:
    """Shift a membrane by whole periods so that its centroid lies in [0, L_x)."""
    return nodes - (length * np.floor(centroid(nodes)[0] / length), 0.0)


def _dataset(
    position: FloatArray,
    offsets: IntArray,
    target: FloatArray,
    report: ContourReport,
    contact_length: float,
) -> xr.Dataset:
    dataset = xr.Dataset(
        {
            "node_position": (("node", "axis"), position),
            "nodes_per_particle": ("particle", np.diff(offsets)),
            "area": ("particle", signed_areas(position, offsets)),
            "target_area": ("particle", target),
        },
        coords={"axis": ("axis", ["x", "y"])},
        attrs={
            "area_fraction": report.area_fraction,
            "largest_area_error": report.largest_area_error,
            "smallest_distance": report.smallest_distance,
            "smallest_distance_over_contact_length": report.smallest_distance / contact_length,
        },
    )
    return described(dataset)
