"""What the datasets of each stage must look like before anything is made from them.

A table for each stage declares its variables; what must hold between several of them is a rule.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import DatasetError
from softslip.files.faults import Schema, Variable, faults, shown
from softslip.files.quantities import unit_of

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


def _of(name: str, *dims: str, **others: Any) -> dict[str, Variable]:
    """Return the variable of a quantity, with the unit that it has in `QUANTITIES`."""
    return {name: Variable(dims, unit_of(name), **others)}


_AXIS = Variable(("axis",), None, "word", words=("x", "y"))
_NODES_PER_PARTICLE = _of("nodes_per_particle", "particle", kind="count", least=FEWEST_NODES)

PACKING = Schema(
    "rerun the packing stage",
    {
        **_of("centre", "particle", "axis"),
        **_of("radius", "particle", above=0.0),
        **_of("final_radius", "particle", above=0.0),
        "axis": _AXIS,
    },
)
"""Discs, from `simulation.packing`."""

EXPANSION = Schema(
    "rerun the expansion stage",
    {
        **_of("node_position", "node", "axis"),
        **_NODES_PER_PARTICLE,
        **_of("area", "particle", above=0.0),
        **_of("target_area", "particle", above=0.0),
        "axis": _AXIS,
    },
    rules=(_nodes_add_up,),
)
"""Membranes, from `simulation.expansion`."""

AGEING = Schema(
    "rerun the ageing stage",
    {
        **_of("node_position", "node", "axis"),
        **_of("tether", "wall", "wall_node", "axis"),
        **_of("wall_displacement", "wall"),
        **_NODES_PER_PARTICLE,
        **_of("reference_area", "particle", above=0.0),
        **_of("shear_rate_wall"),
        **_of("area_deviation", least=0.0),
        **_of("film_thickness", unknown=True, least=0.0),
    },
    rules=(_nodes_add_up,),
)
"""The state that a shear starts from, from `simulation.hydrodynamics`."""

SHEAR = Schema(
    "rerun the shear stage",
    {
        **_of("time", "time", above=0.0, increasing=True),
        **_of("interval", "time", above=0.0),
        "wall": Variable(("wall",), None, "word", words=("lower", "upper")),
        **_of("wall_velocity", "time", "wall"),
        **_of("shear_rate_wall", "time"),
        **_of("traction", "time"),
        **_of("stress", "time"),
        **_of("stress_deviation", "time", least=0.0),
        **_of("area_deviation", "time", least=0.0),
        **_of("film_thickness", "time", unknown=True, least=0.0),
        **_of("strain", "time"),
        **_of("wall_distance", "wall_distance", least=0.0, increasing=True),
        **_of("velocity_profile", "profile", "wall_distance"),
        **_of("profile_time", "profile", above=0.0, increasing=True),
        **_NODES_PER_PARTICLE,
        **_of("shear_rate_bulk", "time", group="bulk"),
        **_of("slip_velocity_wall", "time", "wall", group="bulk"),
        **_of("slip_velocity", "time", group="bulk"),
        **_of("snapshot_time", "snapshot", least=0.0, increasing=True, group="snapshots"),
        **_of("node_position", "snapshot", "node", "axis", group="snapshots"),
        **_of("velocity", "snapshot", "field_y", "field_x", "axis", group="snapshots"),
        **_of("field_x", "field_x", least=0.0, increasing=True, group="snapshots"),
        **_of("field_y", "field_y", least=0.0, increasing=True, group="snapshots"),
        "axis": Variable(("axis",), None, "word", words=("x", "y"), group="snapshots"),
    },
    groups={"bulk": "recording.bulk_margin", "snapshots": "recording.snapshots"},
    rules=(_records_touch, _snapshots_add_up),
)
"""Records, profiles and snapshots, from `simulation.record`."""

DONE = ("status", "done")
"""Where a table holds a run."""

_SHARED = {"stress": "stress unit", "roughness": "1", "wall_separation": "length unit"}
_STATUS = Variable((), "1", "word", words=("done", "missing"), swept=True)
_RUN = Variable((), "1", "word", swept=True)
_FLAG = Variable((), "1", "flag", swept=True)


def _mean(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run, unknown unless it is told where it is known."""
    return _of(name, unknown=True, swept=True, **others)


def _with_error(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run, and its error."""
    return {**_mean(name, **others), **_mean(f"{name}_error", least=0.0)}


def _series(name: str, **others: Any) -> dict[str, Variable]:
    """Return a steady mean with its error and its drift, which is infinite about a mean of 0."""
    return {**_with_error(name, **others), **_mean(f"{name}_drift", infinite=True)}


FLOW_CURVE = Schema(
    "gather flow_curve again",
    {
        "status": _STATUS,
        "run_id": _RUN,
        **_series("shear_rate_wall", known_where=DONE),
        **_series("shear_rate_bulk"),
        **_series("slip_velocity"),
        **dict.fromkeys(("steady_wall", "steady_bulk", "steady_slip", "steady"), _FLAG),
        **_mean("steady_from", least=0.0, known_where=DONE),
        **_mean("drift", infinite=True),
        **_with_error("shear_stress", known_where=DONE),
        **_with_error("yielding_time", above=0.0),
        "yielded": _FLAG,
        **_with_error("slip_time", above=0.0),
        **_with_error("heterogeneity", least=0.0),
        **_mean("snapshots_used", least=0.0, known_where=DONE),
    },
    sweep="status",
    shared=_SHARED,
)
"""One point a run, from `analysis.observables.flow_curve`."""

CREEP = Schema(
    "gather creep again",
    {
        "status": _STATUS,
        "run_id": _RUN,
        **_of("time", "time", above=0.0, increasing=True),
        # Unknown beyond the end of a run that is shorter than others.
        **_of("shear_rate_wall", "time", unknown=True, swept=True),
        **_of("shear_rate_bulk", "time", unknown=True, swept=True),
        **_of("slip_velocity", "time", unknown=True, swept=True),
    },
    sweep="status",
    shared=_SHARED,
)
"""Series in time, from `analysis.observables.creep`."""

PROFILES = Schema(
    "gather profiles again",
    {
        "status": _STATUS,
        "run_id": _RUN,
        "steady_wall": _FLAG,
        **_of("normalised_position", "normalised_position", least=0.0, increasing=True),
        # Unknown where walls stand still, or no mesh line is at a wall.
        **_of("normalised_velocity", "normalised_position", unknown=True, swept=True),
        **_of(
            "normalised_velocity_error", "normalised_position", unknown=True, least=0.0, swept=True
        ),
    },
    sweep="status",
    shared=_SHARED,
)
"""Mean velocity profiles, from `analysis.observables.profiles`."""

FLOW_PARAMETERS = ("yield_stress", "consistency", "flow_index")
"""Parameters of the flow law, in the order of its covariance; none is below 0."""


def _fitted(name: str, message: str, prefix: str = "", **others: Any) -> dict[str, Variable]:
    """Return a fit's parameter and its error; known where the fit was made."""
    unit = unit_of(name)
    common: dict[str, Any] = {"unknown": True, "swept": True}
    return {
        f"{prefix}{name}": Variable((), unit, known_where=(message, "fitted"), **common, **others),
        # The covariance of points that do not fix a parameter is infinite.
        f"{prefix}{name}_error": Variable(
            (), unit, **common, **(others | {"least": 0.0, "infinite": True})
        ),
    }


def _quality(prefix: str, message: str, **others: Any) -> dict[str, Variable]:
    """Return what every fit says of itself."""
    made = (message, "fitted")
    return {
        f"{prefix}reduced_chi_square": Variable(
            (), "1", unknown=True, least=0.0, swept=True, known_where=made, **others
        ),
        f"{prefix}points": Variable((), "1", "count", least=0.0, swept=True, **others),
        message: Variable((), "1", "word", swept=True, **others),
    }


def _flow_law(prefix: str, **others: Any) -> dict[str, Variable]:
    """Return the variables of a fit of the flow law."""
    message = f"{prefix}fit_message"
    fitted = {"least": 0.0, **others}
    return {
        **_quality(prefix, message, **others),
        **_fitted("yield_stress", message, prefix, **fitted),
        **_fitted("consistency", message, prefix, **fitted),
        **_fitted("flow_index", message, prefix, **fitted),
        f"{prefix}covariance": Variable(
            ("parameter", "other_parameter"),
            "products of the parameters' units",
            unknown=True,
            infinite=True,
            swept=True,
            **others,
        ),
    }


def _slip_law(name: str) -> dict[str, Variable]:
    """Return the variables of a fit of slip velocity over stress."""
    message = f"{name}_message"
    return {**_quality(f"{name}_", message), **_fitted(name, message)}


FITS = Schema(
    "fit the flow curve again",
    {
        **_flow_law(""),
        **_flow_law("pooled_", pooled=("roughness",)),
        **_slip_law("slip_coefficient"),
        **_slip_law("newtonian_slip_coefficient"),
        "parameter": Variable(("parameter",), None, "word", words=FLOW_PARAMETERS),
        "other_parameter": Variable(("other_parameter",), None, "word", words=FLOW_PARAMETERS),
    },
    sweep="fit_message",
    shared=_SHARED,
)
"""Laws and their errors, from `analysis.fits`."""

SCHEMAS: Mapping[str, Schema] = {
    "packing": PACKING,
    "expansion": EXPANSION,
    "ageing": AGEING,
    "shear": SHEAR,
    "flow_curve": FLOW_CURVE,
    "creep": CREEP,
    "profiles": PROFILES,
    "fits": FITS,
}
"""What the datasets of each stage must look like."""


def check_dataset(dataset: xr.Dataset, stage: str) -> None:
    """Make sure that a dataset is what a stage writes, so that nothing wrong is computed from it.

    Variables that a stage does not know are left alone: nobody reads them.

    Parameters
    ----------
    dataset
        As read from a file.
    stage
        What it is to be the result of, one of `SCHEMAS`.

    Raises
    ------
    DatasetError
        In one sentence with the first variable that is wrong, what is wrong with it, what it
        should be and what to do.
    KeyError
        When there is no such stage.
    """
    schema = SCHEMAS[stage]
    for fault in faults(dataset, schema):
        raise DatasetError(f"{fault}; delete the file and {schema.remedy}")
