"""Runs that were made again beside the published ones: the same bits, or how far off."""

import json
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import DatasetError
from softslip.files.storage import CONTENT_DIGEST
from softslip.provenance.attribution import read_provenance
from softslip.solver.geometry import BoolArray, FloatArray

OBSERVABLES = ("slip_velocity", "shear_rate_bulk", "shear_rate_wall")
"""Steady means that are compared."""

_WHICH = ("published", "again")

_OFF = "difference over the standard error of the difference, had the two runs nothing in common"


def measure_reproduction(published: xr.Dataset, again: xr.Dataset) -> xr.Dataset:
    """Compare the runs that two flow curves of one scenario both have.

    A run on the same machine has the same bits. On another one rounding differs, and as flow is
    chaotic the two runs part: then their steady means are two measurements of one thing.

    Parameters
    ----------
    published, again
        Flow curves with their labels, which name the digest of each run.

    Returns
    -------
    xr.Dataset
        Along ``run``, the runs that both have: the swept parameters, ``content_published`` and
        ``content_again``, the digests, which are equal where the bits are, and for each of
        `OBSERVABLES` the ``NAME_published``, the ``NAME_again`` and the ``NAME_difference``
        [standard errors], NaN where that cannot be known. Its attributes ``published_on`` and
        ``again_on`` are the processors.

    Raises
    ------
    DatasetError
        When they have no run in common.
    """
    pair = published, again
    first, second = map(_by_run, pair)
    common = first["run"].values[np.isin(first["run"].values, second["run"].values)]
    if not len(common):
        raise DatasetError(
            f"none of {second.sizes['run']} runs made here is among the {first.sizes['run']} "
            "published ones; run the same scenario"
        )
    first, second = first.sel(run=common), second.sel(run=common)
    variables: dict[str, Any] = {}
    for which, curve in zip(_WHICH, pair, strict=True):
        digests = _digests(curve)
        meaning = {"units": "1", "long_name": f"digest of what the run holds, {which}"}
        variables[f"content_{which}"] = ("run", [digests[run] for run in common], meaning)
    for name in OBSERVABLES:
        meaning = {"units": "1", "long_name": first[name].attrs["long_name"]}
        for which, each in zip(_WHICH, (first, second), strict=True):
            variables[f"{name}_{which}"] = ("run", each[name].values, meaning)
        off = _standard_errors(first, second, name)
        told = {"units": "1", "long_name": f"{meaning['long_name']}: {_OFF}"}
        variables[f"{name}_difference"] = ("run", off, told)
    coordinates = {name: each.variable for name, each in first.coords.items()}
    processors = [read_provenance(curve.attrs)["processor"] for curve in pair]
    machines = {f"{which}_on": name for which, name in zip(_WHICH, processors, strict=True)}
    found = xr.Dataset(variables, coordinates, machines)
    found["run"].attrs = {"units": "1", "long_name": "run"}
    return found


def is_identical(reproduction: xr.Dataset) -> BoolArray:
    """Return of which runs all bits are the same, shape (runs,)."""
    same: BoolArray = (reproduction["content_published"] == reproduction["content_again"]).values
    return same


def _by_run(flow_curve: xr.Dataset) -> xr.Dataset:
    """Return what a flow curve has of the runs that are done, along the one dimension ``run``."""
    swept = flow_curve["run_id"].dims
    per_run = flow_curve[[name for name in flow_curve if flow_curve[name].dims == swept]]
    # A scenario without axes has one run.
    flat = per_run.stack(run=swept).reset_index("run") if swept else per_run.expand_dims("run")
    done: BoolArray = flat["status"].values == "done"
    return flat.isel(run=done).assign_coords(run=flat["run_id"].values[done].astype(str))


def _digests(flow_curve: xr.Dataset) -> dict[str, str]:
    """Return the digest of each run that a flow curve was gathered from."""
    parents = json.loads(str(flow_curve.attrs["parents"]))
    return {parent["run"]: parent[CONTENT_DIGEST] for parent in parents}


def _standard_errors(first: xr.Dataset, second: xr.Dataset, name: str) -> FloatArray:
    """Return the difference of two means over its error; 0 where both are the same, or unknown."""
    ours, theirs = first[name].values, second[name].values
    error = np.hypot(first[f"{name}_error"].values, second[f"{name}_error"].values)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = (theirs - ours) / error
    off[~np.isfinite(off)] = np.nan
    return np.where((ours == theirs) | (np.isnan(ours) & np.isnan(theirs)), 0.0, off)
