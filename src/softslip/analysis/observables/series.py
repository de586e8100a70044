"""Time series of a run: what a record means, and how it is averaged over other intervals."""

import json

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError, DatasetError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

BULK_SERIES = ("shear_rate_bulk", "slip_velocity")
"""Series that a run lacks when ``recording.bulk_margin`` is null."""


def parameters_of(run: xr.Dataset) -> Parameters:
    """Return the parameters that a run's file carries.

    Raises
    ------
    DatasetError
        When the file carries none, or none that this version understands.
    """
    try:
        return Parameters.from_mapping(json.loads(run.attrs["parameters"]))
    except (KeyError, json.JSONDecodeError, ConfigError) as error:
        raise DatasetError(
            f"run {run.attrs.get('run', '?')}: its attribute 'parameters' cannot be read "
            f"({error}); rerun the shear stage"
        ) from error


def record_edges(run: xr.Dataset) -> FloatArray:
    """Return the start of the first record and the end of each [time unit], shape (time + 1,).

    Raises
    ------
    DatasetError
        When the run has no records.
    """
    ends = np.asarray(run["time"].values, dtype=np.float64)
    if not len(ends):
        raise DatasetError(
            f"run {run.attrs.get('run', '?')}: has no records; run it for longer than one "
            "recording.stride"
        )
    return np.concatenate(([ends[0] - float(run["interval"][0])], ends))


def profiles_from(run: xr.Dataset, start: float) -> tuple[IntArray, FloatArray]:
    """Return the velocity profiles whose whole intervals lie after some time.

    Returns
    -------
    tuple of numpy.ndarray
        Their numbers, and the edges of the intervals of all profiles, shape (profiles + 1,).
    """
    known = record_edges(run)
    ends = np.asarray(run["profile_time"].values, dtype=np.float64)
    edges = np.concatenate(([known[0]], ends))
    return np.flatnonzero(edges[:-1] >= start - 1e-9 * known[-1]), edges


def equal_bins(run: xr.Dataset) -> FloatArray:
    """Cut a run into equal bins that end with it, none shorter than a record."""
    known = record_edges(run)
    width = float(np.diff(known).max())
    count = max(int((known[-1] - known[0]) / width + 1e-9), 1)
    edges = known[-1] - width * np.arange(count, -1, -1)
    return np.asarray(np.maximum(edges, known[0]))


def interval_means(run: xr.Dataset, name: str, edges: FloatArray) -> FloatArray:
    """Average a series over consecutive intervals, shape (intervals, ...).

    Records are means over their interval, so that their integral is known exactly at the end of
    each record; in between it is taken as linear.

    Parameters
    ----------
    run
        A shear run.
    name
        A variable whose first dimension is ``time``.
    edges
        Ends of the intervals [time unit], shape (intervals + 1,), growing. Intervals that
        reach outside the run are NaN.
    """
    known = record_edges(run)
    values = np.asarray(run[name].transpose("time", ...).values, dtype=np.float64)
    steps = np.diff(known).reshape((-1,) + (1,) * (values.ndim - 1))
    start = np.zeros((1, *values.shape[1:]))
    integral = np.concatenate((start, np.cumsum(values * steps, axis=0)))
    columns = integral.reshape(len(known), -1)
    tolerance = 1e-9 * known[-1]
    outside = (edges < known[0] - tolerance) | (edges > known[-1] + tolerance)
    at_edges = np.column_stack([np.interp(edges, known, column) for column in columns.T])
    at_edges[outside] = np.nan
    means = np.diff(at_edges, axis=0) / np.diff(edges)[:, None]
    return np.asarray(means.reshape((len(edges) - 1, *values.shape[1:])))
