"""What the datasets of each stage must look like before anything is made from them.

A table for each stage declares its variables; what must hold between several of them is a rule.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import DatasetError
from softslip.files.faults import Schema, Variable, faults, shown

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


def _length(*dims: str, **others: Any) -> Variable:
    return Variable(dims, "length unit", **others)


def _speed(*dims: str, **others: Any) -> Variable:
    return Variable(dims, "length unit / time unit", **others)


_AXIS = Variable(("axis",), None, "word", words=("x", "y"))
_NODES_PER_PARTICLE = Variable(("particle",), "1", "count", least=FEWEST_NODES)
_FILM = _length(unknown=True, least=0.0)

PACKING = Schema(
    "run the packing stage again",
    {
        "centre": _length("particle", "axis"),
        "radius": _length("particle", above=0.0),
        "final_radius": _length("particle", above=0.0),
        "axis": _AXIS,
    },
)
"""Discs, from `simulation.packing`."""

EXPANSION = Schema(
    "run the expansion stage again",
    {
        "node_position": _length("node", "axis"),
        "nodes_per_particle": _NODES_PER_PARTICLE,
        "area": Variable(("particle",), "length unit2", above=0.0),
        "target_area": Variable(("particle",), "length unit2", above=0.0),
        "axis": _AXIS,
    },
    rules=(_nodes_add_up,),
)
"""Membranes, from `simulation.expansion`."""

AGEING = Schema(
    "run the ageing stage again",
    {
        "node_position": _length("node", "axis"),
        "tether": Variable(("wall", "wall_node", "axis"), "stress unit"),
        "wall_displacement": _length("wall"),
        "nodes_per_particle": _NODES_PER_PARTICLE,
        "reference_area": Variable(("particle",), "length unit squared", above=0.0),
        "shear_rate_wall": Variable((), "1 / time unit"),
        "area_deviation": Variable((), "1", least=0.0),
        "film_thickness": _FILM,
    },
    rules=(_nodes_add_up,),
)
"""The state that a shear starts from, from `simulation.hydrodynamics`."""

SHEAR = Schema(
    "run the shear stage again",
    {
        "time": Variable(("time",), "time unit", above=0.0, increasing=True),
        "interval": Variable(("time",), "time unit", above=0.0),
        "wall": Variable(("wall",), None, "word", words=("lower", "upper")),
        "wall_velocity": _speed("time", "wall"),
        "shear_rate_wall": Variable(("time",), "1 / time unit"),
        "traction": Variable(("time",), "stress unit"),
        "stress": Variable(("time",), "stress unit"),
        "stress_deviation": Variable(("time",), "stress unit", least=0.0),
        "area_deviation": Variable(("time",), "1", least=0.0),
        "film_thickness": _length("time", unknown=True, least=0.0),
        "strain": Variable(("time",), "1"),
        "wall_distance": _length("wall_distance", least=0.0, increasing=True),
        "velocity_profile": _speed("profile", "wall_distance"),
        "profile_time": Variable(("profile",), "time unit", above=0.0, increasing=True),
        "nodes_per_particle": _NODES_PER_PARTICLE,
        "shear_rate_bulk": Variable(("time",), "1 / time unit", group="bulk"),
        "slip_velocity_wall": _speed("time", "wall", group="bulk"),
        "slip_velocity": _speed("time", group="bulk"),
        "snapshot_time": Variable(
            ("snapshot",), "time unit", least=0.0, increasing=True, group="snapshots"
        ),
        "node_position": _length("snapshot", "node", "axis", group="snapshots"),
        "velocity": _speed("snapshot", "field_y", "field_x", "axis", group="snapshots"),
        "field_x": _length("field_x", least=0.0, increasing=True, group="snapshots"),
        "field_y": _length("field_y", least=0.0, increasing=True, group="snapshots"),
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


def _mean(units: str, **others: Any) -> Variable:
    """Return a variable with one value a run, unknown unless it is told where it is known."""
    return Variable((), units, unknown=True, swept=True, **others)


def _series(name: str, units: str, **others: Any) -> dict[str, Variable]:
    """Return a steady mean with its error and its drift, which is infinite about a mean of 0."""
    return {
        name: _mean(units, **others),
        f"{name}_error": _mean(units, least=0.0),
        f"{name}_drift": _mean("1", infinite=True),
    }


def _timed(name: str) -> dict[str, Variable]:
    """Return a time with its error."""
    return {
        name: _mean("time unit", above=0.0),
        f"{name}_error": _mean("time unit", least=0.0),
    }


FLOW_CURVE = Schema(
    "gather flow_curve again",
    {
        "status": _STATUS,
        "run_id": _RUN,
        **_series("shear_rate_wall", "1 / time unit", known_where=DONE),
        **_series("shear_rate_bulk", "1 / time unit"),
        **_series("slip_velocity", "length unit / time unit"),
        **dict.fromkeys(("steady_wall", "steady_bulk", "steady_slip", "steady"), _FLAG),
        "steady_from": _mean("time unit", least=0.0, known_where=DONE),
        "drift": _mean("1", infinite=True),
        "shear_stress": _mean("stress unit", known_where=DONE),
        "shear_stress_error": _mean("stress unit", least=0.0),
        **_timed("yielding_time"),
        "yielded": _FLAG,
        **_timed("slip_time"),
        "heterogeneity": _mean("1", least=0.0),
        "heterogeneity_error": _mean("1", least=0.0),
        "snapshots_used": _mean("1", least=0.0, known_where=DONE),
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
        "time": Variable(("time",), "time unit", above=0.0, increasing=True),
        # Unknown beyond the end of a run that is shorter than others.
        "shear_rate_wall": Variable(("time",), "1 / time unit", unknown=True, swept=True),
        "shear_rate_bulk": Variable(("time",), "1 / time unit", unknown=True, swept=True),
        "slip_velocity": _speed("time", unknown=True, swept=True),
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
        "normalised_position": Variable(("normalised_position",), "1", least=0.0, increasing=True),
        # Unknown where walls stand still, or no mesh line is at a wall.
        "normalised_velocity": Variable(("normalised_position",), "1", unknown=True, swept=True),
        "normalised_velocity_error": Variable(
            ("normalised_position",), "1", unknown=True, least=0.0, swept=True
        ),
    },
    sweep="status",
    shared=_SHARED,
)
"""Mean velocity profiles, from `analysis.observables.profiles`."""

FLOW_PARAMETERS: Mapping[str, tuple[str, float]] = {
    "yield_stress": ("stress unit", 0.0),
    "consistency": ("stress unit * (time unit)^n", 0.0),
    "flow_index": ("1", 0.0),
}
"""Units and smallest value of the parameters of the flow law, in the order of its covariance."""


def _fit(message: str, values: Mapping[str, tuple[str, float]], **others: Any) -> Iterator[Any]:
    """Yield the names and variables of a fit's parameters and errors; known where it was made."""
    made = (message, "fitted")
    for name, (units, least) in values.items():
        common = {"unknown": True, "swept": True, **others}
        yield name, Variable((), units, least=least, known_where=made, **common)
        # The covariance of points that do not fix a parameter is infinite.
        yield f"{name}_error", Variable((), units, least=0.0, infinite=True, **common)


def _quality(prefix: str, message: str, **others: Any) -> dict[str, Variable]:
    """Return what every fit says of itself."""
    made = (message, "fitted")
    return {
        f"{prefix}reduced_chi_square": _mean("1", least=0.0, known_where=made, **others),
        f"{prefix}points": Variable((), "1", "count", least=0.0, swept=True, **others),
        message: Variable((), "1", "word", swept=True, **others),
    }


def _flow_law(prefix: str, **others: Any) -> dict[str, Variable]:
    """Return the variables of a fit of the flow law."""
    message = f"{prefix}fit_message"
    values = {f"{prefix}{name}": each for name, each in FLOW_PARAMETERS.items()}
    return {
        **_quality(prefix, message, **others),
        **dict(_fit(message, values, **others)),
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
    units = "length unit / time unit / stress unit"
    message = f"{name}_message"
    return {
        **_quality(f"{name}_", message),
        **dict(_fit(message, {name: (units, -np.inf)})),
    }


_PARAMETER_NAMES = tuple(FLOW_PARAMETERS)

FITS = Schema(
    "fit the flow curve again",
    {
        **_flow_law(""),
        **_flow_law("pooled_", pooled=("roughness",)),
        **_slip_law("slip_coefficient"),
        **_slip_law("newtonian_slip_coefficient"),
        "parameter": Variable(("parameter",), None, "word", words=_PARAMETER_NAMES),
        "other_parameter": Variable(("other_parameter",), None, "word", words=_PARAMETER_NAMES),
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
