"""Means over snapshots that are not evenly spread in time."""

import numpy as np
import xarray as xr

from softslip.analysis.observables.series import FloatArray, IntArray


def snapshots_from(run: xr.Dataset, start: float) -> tuple[IntArray, FloatArray]:
    """Return the snapshots from some time on, and how much of the time each stands for.

    Each stands for the time that is nearer to it than to any other, the first and the last for as
    much on their outer side as on their inner one: many of a short transient weigh no more than
    the transient lasts, and evenly spread ones weigh alike.

    Returns
    -------
    tuple of numpy.ndarray
        Their numbers, and weights whose sum is 1, shape (snapshots,) each.
    """
    times = np.asarray(run["snapshot_time"].values if "snapshot_time" in run else [], np.float64)
    numbers = np.flatnonzero(times >= start)
    if len(numbers) < 2:
        return numbers, np.ones(len(numbers))
    gaps = np.diff(times[numbers])
    stands_for = 0.5 * (np.append(gaps[0], gaps) + np.append(gaps, gaps[-1]))
    return numbers, stands_for / stands_for.sum()


def weighted(values: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return means along the first axis, their standard errors and the number of equal values.

    Parameters
    ----------
    values
        NaN where a value is not there, shape (n, ...).
    weights
        Shape (n,).

    Returns
    -------
    tuple of numpy.ndarray
        Means; standard errors of independent values, NaN of a single one; and (Σw)²/Σw², as many
        values of equal weight would be known as well; shape (...) each.
    """
    shape = (-1, *[1] * (values.ndim - 1))
    each = np.where(np.isfinite(values), weights.reshape(shape), 0.0)
    total, squares = each.sum(axis=0), (each**2).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        count = np.where(total > 0, total**2 / squares, 0.0)
        mean = np.nansum(each * values, axis=0) / np.where(total > 0, total, np.nan)
        variance = np.nansum(each * (values - mean) ** 2, axis=0) / total
        known = np.isfinite(values).sum(axis=0) > 1
        error = np.sqrt(variance / np.where(known, count - 1, np.nan))
    return np.asarray(mean), np.asarray(error), np.asarray(count)
