"""Results of the benchmarks as datasets, with a unit for each figure."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from softslip.files.quantities import QUANTITIES
from softslip.studies.meanings import attributes

ELEMENT_COSTS = {
    f"{key}_{word}": (units, f"{meaning}, {word} the element")
    for key, (units, meaning) in {
        "seconds": ("s / time unit", "processor time per simulated time"),
        "evaluations": ("1 / time unit", "evaluations of the equations of motion"),
        "nodes": ("1", "number of nodes"),
        "pairs": ("1", "number of near pairs"),
        "contacts": ("1", "number of pairs of contact points that may touch"),
    }.items()
    for word in ("with", "without")
}
"""Figures that say what a scene takes with an element and without it, with unit and meaning."""

UNITS = {
    **ELEMENT_COSTS,
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
    "shear_rate_wall": QUANTITIES["shear_rate_wall"],
    "rate_difference": ("1", "relative difference of the apparent shear rates"),
    "exponent": ("1", "exponent of the time of an evaluation in the number of particles"),
    "nanoseconds": ("ns", "time per node and evaluation"),
    "peak_memory": ("MiB", "peak resident memory of a process that evaluates the equations"),
    "memory_ratio": ("1", "peak memory of the paper's scheme over that of the level"),
    "stress": ("stress unit", "imposed stress"),
    "time": ("time unit", "time since the stress began, at the end of the record's interval"),
    **{name: QUANTITIES[name] for name in ("shear_rate_bulk", "slip_velocity", "film_thickness")},
    "grid_difference": ("1", "rms difference of the mesh scheme from the level, relative"),
    "seed_difference": ("1", "rms difference of a second packing from the first, relative"),
    "difference_ratio": ("1", "rms difference of the schemes over that of two packings"),
    "cost": ("s / time unit", "processor time per simulated time"),
    "saved_share": ("1", "share of the processor time that is saved where the element is absent"),
    "saved_per_evaluation": ("1", "the same of the processor time per evaluation"),
}
"""Unit and meaning of each figure of a result, by its key."""

TABLES = {
    "nanoseconds": "part",
    "cost": "run",
    **dict.fromkeys(("grid_difference", "seed_difference", "difference_ratio"), "quantity"),
    **dict.fromkeys((*ELEMENT_COSTS, "saved_share", "saved_per_evaluation"), "element"),
}
"""Figures that have a value for each of some named things, and what these are."""

WORDS = {
    "scene_with": ("element", "scene that has the element"),
    "scene_without": ("element", "scene without it"),
    "switched_off": ("element", "what is switched off where the element is absent"),
}
"""Tables of words, what they say each about, and what they mean."""

LABELS = {
    "part": "part of an evaluation",
    "run": "scheme and packing of a run",
    "quantity": "observable",
    "element": "element of a scene",
}
"""What the named things are."""

SERIES = "series"
"""Key of the mapping of observables to their values for each run and ``time``."""


def as_dataset(result: Mapping[str, Any]) -> xr.Dataset:
    """Return a benchmark's result as a dataset.

    Lists become variables over ``particles``, the tables of `TABLES` variables over what they
    name, those of `WORDS` coordinates over the same, those of `SERIES` variables over ``run`` and
    ``time``, and the entries of other nested mappings variables named after both keys, such as
    ``own_ratio``. Single words become attributes. A table has NaN for what only the first one
    names.

    Raises
    ------
    KeyError
        When a figure has no unit in `UNITS`.
    """
    variables: dict[str, xr.DataArray] = {}
    coordinates: dict[str, xr.DataArray] = {}
    words: dict[str, str] = {}
    orders: dict[str, list[str]] = {}
    for key, value in result.items():
        if isinstance(value, str):
            words[key] = value
        elif key in WORDS:
            dim, meaning = WORDS[key]
            coordinates[key] = xr.DataArray(
                list(value.values()), {dim: list(value)}, dim, attrs={"long_name": meaning}
            )
        elif key in TABLES:
            # Later tables may lack an entry; left to itself, joining them would sort the names.
            order = orders.setdefault(TABLES[key], list(value))
            variables[key] = _table(key, value).reindex({TABLES[key]: order})
        elif key == SERIES:
            variables |= {name: _series(name, runs) for name, runs in value.items()}
        elif key == "time":
            variables[key] = xr.DataArray(value, dims=key, attrs=attributes(*UNITS[key]))
        elif isinstance(value, Mapping):
            for inner, figure in value.items():
                variables[f"{key}_{inner}"] = _variable(inner, figure)
        else:
            variables[key] = _variable(key, value)
    dataset = xr.Dataset(variables, coordinates, words)
    for dim in LABELS.keys() & dataset.coords.keys():
        dataset[dim].attrs["long_name"] = LABELS[dim]
    return dataset


def _variable(key: str, value: Any) -> xr.DataArray:
    dims = ("particles",) if isinstance(value, list) else ()
    return xr.DataArray(value, dims=dims, attrs=attributes(*UNITS[key]))


def _series(key: str, runs: Mapping[str, Any]) -> xr.DataArray:
    """Return a variable over runs and ``time``."""
    values = np.array(list(runs.values()))
    return xr.DataArray(values, {"run": list(runs)}, ("run", "time"), attrs=attributes(*UNITS[key]))


def _table(key: str, table: Mapping[str, Any]) -> xr.DataArray:
    """Return a variable over the names of a table, and over ``particles`` if it holds lists."""
    values = np.array(list(table.values()))
    dims = (TABLES[key], "particles")[: values.ndim]
    coordinates = {TABLES[key]: list(table)}
    return xr.DataArray(values, dims=dims, coords=coordinates, attrs=attributes(*UNITS[key]))
