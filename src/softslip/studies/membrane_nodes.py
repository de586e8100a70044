"""Membranes and walls on other nodes: the same material curves, sampled elsewhere."""

import functools
from collections.abc import Sequence

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.simulation.expansion import membrane_node_counts
from softslip.solver.geometry import FloatArray, IntArray, Layout


@functools.cache
def interpolation(before: int, after: int, offset: float = 0.0) -> FloatArray:
    """Return the matrix from values at equally spaced nodes of a period to those at others.

    It evaluates the trigonometric polynomial through the nodes, of which all modes are kept.

    Parameters
    ----------
    before, after
        Numbers of nodes.
    offset
        Place of the first node of either, in spacings: 0 on membranes, 1/2 on walls.

    Returns
    -------
    FloatArray
        Shape (after, before); every row sums to 1.
    """
    places = (np.arange(after) + offset) / after
    nodes = (np.arange(before) + offset) / before
    apart = places[:, None] - nodes[None, :]
    matrix = np.ones_like(apart)
    for mode in range(1, (before + 1) // 2):
        matrix += 2 * np.cos(2 * np.pi * mode * apart)
    if before % 2 == 0:
        # Of the highest mode the nodes know the cosine only.
        highest = np.pi * before
        matrix += np.cos(highest * (places - nodes[0]))[:, None] * np.cos(
            highest * (nodes - nodes[0])
        )
    return matrix / before


def on_chains(
    values: FloatArray, before: IntArray, after: IntArray, offsets: Sequence[float] = ()
) -> FloatArray:
    """Return what nodes have at the same material points of other numbers of nodes.

    Parameters
    ----------
    values
        Shape (nodes, components), periodic along each chain of nodes.
    before, after
        Numbers of nodes of each chain.
    offsets
        See `interpolation`; 0 by default.
    """
    parts = np.split(values, np.cumsum(before)[:-1])
    places = zip(parts, after, offsets or [0.0] * len(parts), strict=True)
    return np.concatenate(
        [interpolation(len(part), int(count), offset) @ part for part, count, offset in places]
    )


def on_nodes(values: FloatArray, before: Layout, after: Layout) -> FloatArray:
    """Return a quantity of all nodes at the material points of another layout's nodes.

    Parameters
    ----------
    values
        Such as velocities, shape (nodes, components), periodic along each membrane and wall.
    before, after
        Layouts of the same membranes and walls.
    """
    return on_chains(values, np.diff(before.chains), np.diff(after.chains), chain_offsets(after))


def chain_offsets(layout: Layout) -> list[float]:
    """Return the place of the first node of each membrane and wall, in spacings."""
    return [0.0] * layout.particles + [0.5, 0.5]


def membrane_dataset(nodes: FloatArray, counts: IntArray, areas: FloatArray) -> xr.Dataset:
    """Return membranes in the schema that `simulation.assembly.layout_of` takes.

    Parameters
    ----------
    nodes
        Of all membranes, shape (nodes, 2) [length unit].
    counts, areas
        Number of nodes and reference area of each membrane.
    """
    return xr.Dataset(
        {
            "node_position": (("node", "axis"), nodes),
            "nodes_per_particle": ("particle", counts),
            "reference_area": ("particle", areas),
        }
    )


def renoded(membranes: xr.Dataset, parameters: Parameters) -> xr.Dataset:
    """Return the same membranes on as many nodes as other parameters give them.

    Each is the trigonometric interpolant of its nodes in the material coordinate.
    """
    before, after = membranes["nodes_per_particle"].values, membrane_node_counts(parameters)
    nodes = on_chains(membranes["node_position"].values, before, after)
    return membrane_dataset(nodes, after, membranes["reference_area"].values)
