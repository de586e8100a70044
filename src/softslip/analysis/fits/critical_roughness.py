"""The roughness above which slip is suppressed."""

import numpy as np
import xarray as xr

from softslip.analysis.fits.likelihood import CONFIDENCE
from softslip.analysis.fits.measured_points import FloatArray
from softslip.analysis.fits.points import FITTED, Fit, laid_out, nothing
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


def _fit(roughness: FloatArray, coefficients: FloatArray, errors: FloatArray) -> Fit:
    """Find β* with its intervals, by coefficients drawn from their errors."""
    known = np.isfinite(coefficients) & np.isfinite(errors)
    count = int(known.sum())
    if count < 2:
        return nothing(1, count, f"too few slip coefficients: {count} of at least 2")
    at, mean, error = roughness[known], coefficients[known], errors[known]
    random = np.random.default_rng(np.random.SeedSequence((count, DRAWS)))
    draws = mean + error * random.standard_normal((DRAWS, count))
    crossings = np.array([_crossing(at, each) for each in draws])
    missing = float(np.mean(np.isnan(crossings)))
    value = _crossing(at, mean)
    if not np.isfinite(value) or missing > 1 - CONFIDENCE[-1]:
        return nothing(1, count, "the slip coefficient is not halved within the roughnesses")
    ends = [np.nanquantile(crossings, [0.5 * (1 - c), 0.5 * (1 + c)]) for c in CONFIDENCE]
    variance = np.array([[float(np.nanvar(crossings))]])
    return Fit(np.array([value]), variance, np.array([ends]), float("nan"), count, FITTED)


def critical_roughness(slip: xr.Dataset) -> xr.Dataset:
    """Find β*, where ν(β) has fallen to half its value at the smoothest wall (Fig. 6c).

    Between roughnesses ν is taken as linear, so that β* is known no better than these lie apart:
    ``critical_roughness_bracket`` are the two that enclose it. Intervals are those of β* with
    coefficients drawn from their errors.

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
    error = slip["slip_coefficient_error"].where(known)
    if "roughness" not in coefficient.dims:
        coefficient, error = (each.expand_dims("roughness") for each in (coefficient, error))
        coefficient = coefficient.assign_coords(roughness=[np.nan])
    ordered = coefficient.sortby("roughness")
    errors = error.sortby("roughness") if "roughness" in error.coords else error
    dims = tuple(str(dim) for dim in ordered.dims if dim != "roughness")
    roughness = ordered["roughness"].values.astype(np.float64)
    fits, brackets = {}, []
    for place in np.ndindex(*(ordered.sizes[dim] for dim in dims)):
        at = dict(zip(dims, place, strict=True))
        values, doubts = ordered.isel(at).values, errors.isel(at).values
        fits[place] = _fit(roughness, values, doubts)
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
