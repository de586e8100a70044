"""Time series of a run: what a record means, and how it is averaged over other intervals."""

import json

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError, DatasetError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

SMOOTHING_WIDTH = 0.1
"""Standard deviation of the Gaussian smoothing window in log10 of time [decades]."""

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


def smooth_in_log_time(
    run: xr.Dataset, name: str, width: float = SMOOTHING_WIDTH
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Smooth a series with a Gaussian window in the logarithm of time.

    Each record weighs as much as its share of the logarithmic time axis. The standard error of
    the smoothed value comes from the scatter of the records about it within the window, enlarged
    for the correlation between neighbouring records (at lag one) and for the one degree of freedom
    that the smoothed value itself takes up.

    Parameters
    ----------
    run, name
        Whose series.
    width
        Standard deviation of the window [decades].

    Returns
    -------
    time
        Middle of each record [time unit], shape (time,).
    smooth
        Smoothed series, shape (time,).
    error
        Its standard error, shape (time,).
    """
    edges = record_edges(run)
    time = 0.5 * (edges[1:] + edges[:-1])
    values = np.asarray(run[name].values, dtype=np.float64)
    distance = np.log10(time)[:, None] - np.log10(time)[None, :]
    weight = np.exp(-0.5 * (distance / width) ** 2) * (np.diff(edges) / time)[None, :]
    weight /= weight.sum(axis=1, keepdims=True)
    smooth = weight @ values
    residual = values - smooth
    power = float(np.mean(residual**2))
    lag_one = float(np.mean(residual[1:] * residual[:-1])) / power if power > 0 else 0.0
    memory = min(max(lag_one, 0.0), 0.95)
    independent = 1.0 / ((weight**2).sum(axis=1) * (1 + memory) / (1 - memory))
    variance = weight @ residual**2
    error = np.sqrt(variance / np.maximum(independent - 1.0, 0.5))
    return time, smooth, error
