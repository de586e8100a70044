"""What the datasets of a run's stages must look like."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from softslip.files.faults import shown
from softslip.files.schema import Schema, Variable, of_quantity

ROUNDING = 1e-9
"""Relative difference below which two times are the same."""

FEWEST_NODES = 3
"""Nodes of a membrane at least: fewer enclose nothing."""


def _nodes_add_up(dataset: xr.Dataset) -> str | None:
    """Check that the membranes have as many nodes together as there are positions."""
    counted, found = sum(dataset["nodes_per_particle"].values.tolist()), dataset.sizes["node"]
    if counted == found:
        return None
    return f"nodes_per_particle adds up to {counted} nodes, not to the {found} of node_position"


def _snapshots_add_up(dataset: xr.Dataset) -> str | None:
    """Check that the nodes of a snapshot are those of all membranes and both walls."""
    if "node_position" not in dataset:
        return None
    walls = dataset.attrs.get("wall_nodes")
    if isinstance(walls, bool) or not isinstance(walls, int | np.integer) or walls < 1:
        return f"attribute wall_nodes is {shown(walls)}, not a whole number above 0"
    counted = sum(dataset["nodes_per_particle"].values.tolist()) + 2 * int(walls)
    found = dataset.sizes["node"]
    if counted == found:
        return None
    return (
        f"nodes_per_particle and wall_nodes add up to {counted} nodes, not to the {found} of "
        "node_position"
    )


def _records_touch(dataset: xr.Dataset) -> str | None:
    """Check that each record's interval begins where the one before it ends, the first at 0."""
    ends, lengths = dataset["time"].values, dataset["interval"].values
    apart = np.abs(ends - lengths - np.concatenate(([0.0], ends[:-1])))
    place = int(np.argmax(apart))
    if apart[place] <= ROUNDING * ends[-1]:
        return None
    return f"interval[{place}] is {lengths[place]:g}, not the time since the record before"


_AXIS = Variable(("axis",), None, "word", words=("x", "y"))
_NODES_PER_PARTICLE = of_quantity(
    "nodes_per_particle", "particle", kind="count", least=FEWEST_NODES
)

PACKING = Schema(
    {
        **of_quantity("centre", "particle", "axis"),
        **of_quantity("radius", "particle", above=0.0),
        **of_quantity("final_radius", "particle", above=0.0),
        "axis": _AXIS,
    },
)
"""Discs, from `simulation.packing`."""

EXPANSION = Schema(
    {
        **of_quantity("node_position", "node", "axis"),
        **_NODES_PER_PARTICLE,
        **of_quantity("area", "particle", above=0.0),
        **of_quantity("target_area", "particle", above=0.0),
        "axis": _AXIS,
    },
    rules=(_nodes_add_up,),
)
"""Membranes, from `simulation.expansion`."""

AGEING = Schema(
    {
        **of_quantity("node_position", "node", "axis"),
        **of_quantity("tether", "wall", "wall_node", "axis"),
        **of_quantity("wall_displacement", "wall"),
        **_NODES_PER_PARTICLE,
        **of_quantity("reference_area", "particle", above=0.0),
        **of_quantity("shear_rate_wall"),
        **of_quantity("area_deviation", least=0.0),
        **of_quantity("film_thickness", unknown=True, least=0.0),
    },
    rules=(_nodes_add_up,),
)
"""The state that a shear starts from, from `simulation.hydrodynamics`."""

SHEAR = Schema(
    {
        **of_quantity("time", "time", above=0.0, increasing=True),
        **of_quantity("interval", "time", above=0.0),
        "wall": Variable(("wall",), None, "word", words=("lower", "upper")),
        **of_quantity("wall_velocity", "time", "wall"),
        **of_quantity("shear_rate_wall", "time"),
        **of_quantity("traction", "time"),
        **of_quantity("stress", "time"),
        **of_quantity("stress_deviation", "time", least=0.0),
        **of_quantity("area_deviation", "time", least=0.0),
        **of_quantity("film_thickness", "time", unknown=True, least=0.0),
        **of_quantity("strain", "time"),
        **of_quantity("wall_distance", "wall_distance", least=0.0, increasing=True),
        **of_quantity("velocity_profile", "profile", "wall_distance"),
        **of_quantity("profile_time", "profile", above=0.0, increasing=True),
        **_NODES_PER_PARTICLE,
        **of_quantity("shear_rate_bulk", "time", group="bulk"),
        **of_quantity("slip_velocity_wall", "time", "wall", group="bulk"),
        **of_quantity("slip_velocity", "time", group="bulk"),
        **of_quantity("snapshot_time", "snapshot", least=0.0, increasing=True, group="snapshots"),
        **of_quantity("node_position", "snapshot", "node", "axis", group="snapshots"),
        **of_quantity("velocity", "snapshot", "field_y", "field_x", "axis", group="snapshots"),
        **of_quantity("field_x", "field_x", least=0.0, increasing=True, group="snapshots"),
        **of_quantity("field_y", "field_y", least=0.0, increasing=True, group="snapshots"),
        "axis": Variable(("axis",), None, "word", words=("x", "y"), group="snapshots"),
    },
    groups={"bulk": "recording.bulk_margin", "snapshots": "recording.snapshots"},
    rules=(_records_touch, _snapshots_add_up),
)
"""Records, profiles and snapshots, from `simulation.record`."""

STAGE_SCHEMAS: Mapping[str, Schema] = {
    "packing": PACKING,
    "expansion": EXPANSION,
    "ageing": AGEING,
    "shear": SHEAR,
}
"""Of each stage."""
