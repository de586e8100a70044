"""Results of the benchmarks as datasets, with a unit for each figure."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

UNITS = {
    "particles": ("1", "number of particles"),
    "nodes": ("1", "number of nodes"),
    "grid_nodes": ("1", "number of nodes of the mesh scheme"),
    "pairs": ("1", "number of near pairs"),
    "points": ("1", "number of points of the far mesh"),
    "ratio": ("1", "cost of the paper's scheme over that of the other"),
    "rms_error": ("1", "rms difference of the velocities over the rms velocity"),
    "max_error": ("1", "largest difference of the velocities over the rms velocity"),
    "grid_seconds": ("s", "time of an evaluation of the mesh scheme"),
    "ewald_seconds": ("s", "time of an evaluation of the Ewald sum"),
    "core_seconds": ("s / time unit", "processor time per simulated time"),
    "seconds": ("s", "time of an evaluation of the equations of motion"),
    "clock_seconds": ("s / time unit", "wall time per simulated time"),
    "running": ("s", "processor time of an evaluation within a run"),
    "steps": ("1 / time unit", "time steps per simulated time"),
    "evaluations": ("1 / time unit", "evaluations of the equations of motion per simulated time"),
    "duration": ("time unit", "simulated time that the cost is taken over"),
    "stretch": ("time unit", "simulated time that the rates are means over"),
    "shear_rate_wall": ("1 / time unit", "apparent shear rate"),
    "rate_difference": ("1", "relative difference of the apparent shear rates"),
    "exponent": ("1", "exponent of the time of an evaluation in the number of particles"),
    "nanoseconds": ("ns", "time per node and evaluation"),
    "bytes": ("byte", "bytes moved in an evaluation"),
    "operations": ("1", "additions and multiplications in an evaluation"),
    "fraction": ("1", "time that the roofline allows over the measured time"),
    "bandwidth": ("byte / s", "bandwidth of a copy by one core"),
    "rate": ("1 / s", "additions and multiplications by one core"),
    "peak": ("MiB", "peak resident memory"),
}
"""Unit and meaning of each figure of a result, by its key."""

TABLES = {"nanoseconds": "part", "bytes": "part", "operations": "part", "fraction": "part"} | {
    "peak": "stage"
}
"""Figures that have a value for each of some named things, and what these are."""


def as_dataset(result: Mapping[str, Any]) -> xr.Dataset:
    """Return a benchmark's result as a dataset.

    Lists become variables over ``particles``, the tables of `TABLES` variables over ``part`` or
    ``stage``, and the entries of other nested mappings variables named after both keys, such as
    ``own_ratio``. Words become attributes. A table has NaN for what only the first one names.

    Parameters
    ----------
    result
        What a benchmark returned.

    Raises
    ------
    KeyError
        When a figure has no unit in `UNITS`.
    """
    variables: dict[str, xr.DataArray] = {}
    words: dict[str, str] = {}
    orders: dict[str, list[str]] = {}
    for key, value in result.items():
        if isinstance(value, str):
            words[key] = value
        elif key in TABLES:
            # Later tables may lack an entry; left to itself, joining them would sort the names.
            order = orders.setdefault(TABLES[key], list(value))
            variables[key] = _table(key, value).reindex({TABLES[key]: order})
        elif isinstance(value, Mapping):
            for inner, figure in value.items():
                variables[f"{key}_{inner}"] = _variable(inner, figure)
        else:
            variables[key] = _variable(key, value)
    return xr.Dataset(variables, attrs=words)


def _attributes(key: str) -> dict[str, str]:
    units, meaning = UNITS[key]
    return {"units": units, "long_name": meaning}


def _variable(key: str, value: Any) -> xr.DataArray:
    dims = ("particles",) if isinstance(value, list) else ()
    return xr.DataArray(value, dims=dims, attrs=_attributes(key))


def _table(key: str, table: Mapping[str, Any]) -> xr.DataArray:
    """Return a variable over the names of a table, and over ``particles`` if it holds lists."""
    values = np.array(list(table.values()))
    dims = (TABLES[key], "particles")[: values.ndim]
    coordinates = {TABLES[key]: list(table)}
    return xr.DataArray(values, dims=dims, coords=coordinates, attrs=_attributes(key))
