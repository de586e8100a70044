"""The roughness above which slip is suppressed."""

import numpy as np
import xarray as xr
from scipy import stats

from softslip.analysis.fits.likelihood import CONFIDENCE
from softslip.analysis.fits.measured_points import FloatArray
from softslip.analysis.fits.points import FITTED, INTERVAL, Fit, laid_out, nothing
from softslip.files.quantities import described

HALF = 0.5
"""Slip coefficient at the critical roughness, over that of the smoothest wall."""

DRAWS = 2000
"""Random slip coefficients by which the error is found."""

NAME = "critical_roughness"


def _crossing(roughness: FloatArray, coefficients: FloatArray) -> float:
    """Return where coefficients first fall to half the first, by straight lines; NaN if nowhere."""
    level = HALF * coefficients[0]
    below = np.flatnonzero(coefficients <= level)
    if coefficients[0] <= 0 or not len(below):
        return float("nan")
    last = int(below[0])
    first = last - 1
    share = (coefficients[first] - level) / (coefficients[first] - coefficients[last])
    return float(roughness[first] + share * (roughness[last] - roughness[first]))


def _drawn_crossings(
    roughness: FloatArray, coefficients: FloatArray, ends: FloatArray, confidence: float
) -> FloatArray:
    """Return β* of random coefficients, which are normal but as wide as their own intervals.

    Each half is as wide as that half of the interval of this confidence, so that errors which are
    known from few samples count by Student's quantile.
    """
    random = np.random.default_rng(np.random.SeedSequence((len(coefficients), DRAWS)))
    normal = random.standard_normal((DRAWS, len(coefficients)))
    below, above = np.abs(ends.T - coefficients) / stats.norm.ppf(0.5 * (1 + confidence))
    draws = coefficients + normal * np.where(normal > 0, above, below)
    return np.array([_crossing(roughness, each) for each in draws])


def _fit(roughness: FloatArray, coefficients: FloatArray, ends: FloatArray) -> Fit:
    """Find β* with its intervals, by coefficients drawn from theirs: shape (β, confidence, 2)."""
    known = np.isfinite(coefficients) & np.isfinite(ends).all(axis=(1, 2))
    count = int(known.sum())
    if count < 2:
        return nothing(1, count, f"too few slip coefficients: {count} of at least 2")
    at, mean = roughness[known], coefficients[known]
    crossings = [
        _drawn_crossings(at, mean, ends[known, number], each)
        for number, each in enumerate(CONFIDENCE)
    ]
    value = _crossing(at, mean)
    if not np.isfinite(value) or np.mean(np.isnan(crossings[-1])) > 1 - CONFIDENCE[-1]:
        return nothing(1, count, "the slip coefficient is not halved within the roughnesses")
    found = [
        np.nanquantile(drawn, [0.5 * (1 - c), 0.5 * (1 + c)])
        for drawn, c in zip(crossings, CONFIDENCE, strict=True)
    ]
    variance = np.array([[float(np.nanvar(crossings[0]))]])
    return Fit(np.array([value]), variance, np.array([found]), float("nan"), count, FITTED)


def critical_roughness(slip: xr.Dataset) -> xr.Dataset:
    """Find β*, where ν(β) has fallen to half its value at the smoothest wall (Fig. 6c).

    Between roughnesses ν is taken as linear, so that β* is known no better than these lie apart:
    ``critical_roughness_bracket`` are the two that enclose it. Intervals are those of β* with
    coefficients drawn from their intervals.

    Parameters
    ----------
    slip
        From `slip_law`; without a dimension ``roughness`` there is none.

    Returns
    -------
    xr.Dataset
        ``critical_roughness`` with ``_error``, ``_interval``, ``_bracket``, ``_points`` and
        ``_message``.
    """
    known = slip["slip_coefficient_message"] == FITTED
    coefficient = slip["slip_coefficient"].where(known)
    interval = slip["slip_coefficient_interval"]
    if "roughness" not in coefficient.dims:
        coefficient, interval = (each.expand_dims("roughness") for each in (coefficient, interval))
        coefficient = coefficient.assign_coords(roughness=[np.nan])
    ordered = coefficient.sortby("roughness")
    intervals = interval.assign_coords(roughness=coefficient["roughness"]).sortby("roughness")
    dims = tuple(str(dim) for dim in ordered.dims if dim != "roughness")
    roughness = ordered["roughness"].values.astype(np.float64)
    fits, brackets = {}, []
    for place in np.ndindex(*(ordered.sizes[dim] for dim in dims)):
        at = dict(zip(dims, place, strict=True))
        values = ordered.isel(at).values
        ends = intervals.isel(at).transpose("roughness", *INTERVAL).values
        fits[place] = _fit(roughness, values, ends)
        brackets.append(_bracket(roughness, values, fits[place]))
    result = laid_out(ordered.to_dataset(name="nu"), dims, fits, (NAME,), f"{NAME}_")
    shape = tuple(ordered.sizes[dim] for dim in dims)
    result[f"{NAME}_bracket"] = (*dims, "end"), np.reshape(brackets, (*shape, 2))
    return described(result.drop_vars(f"{NAME}_reduced_chi_square"))


def _bracket(roughness: FloatArray, coefficients: FloatArray, fit: Fit) -> tuple[float, float]:
    """Return the measured roughnesses on both sides of β*."""
    if not np.isfinite(fit.values[0]):
        return float("nan"), float("nan")
    measured = roughness[np.isfinite(coefficients)]
    last = int(np.searchsorted(measured, fit.values[0]).clip(1, len(measured) - 1))
    return float(measured[last - 1]), float(measured[last])
