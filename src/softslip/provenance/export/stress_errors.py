"""Errors of shear rates, and as errors of the stresses at them by the slope of the flow curve."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from softslip.analysis.fits import FITTED, herschel_bulkley
from softslip.analysis.fits.measured_points import moderated
from softslip.analysis.fits.points import LEAST_RELATIVE_ERROR, usable_points

FloatArray = np.ndarray[Any, np.dtype[np.float64]]

BULK = "shear_rate_bulk"
"""The shear rate that the flow law is fitted to."""


def with_moderated_errors(points: pd.DataFrame, name: str, apart: Sequence[str]) -> pd.DataFrame:
    """Return points whose errors lean on those of the others, as in our own fits (`moderated`).

    Parameters
    ----------
    points
        Of a flow curve, with an index that names each once.
    name
        The shear rate.
    apart
        Dimensions along which errors are not looked at together.
    """
    parts = [part for _, part in points.groupby(list(apart), dropna=False)] if apart else [points]
    return pd.concat([_moderated(part, name) for part in parts]).loc[points.index]


def _moderated(points: pd.DataFrame, name: str) -> pd.DataFrame:
    ordered = points.sort_values("stress", kind="stable")
    columns = {
        "abscissa": ordered["stress"],
        "abscissa_error": ordered["stress_error"],
        "value": ordered[name],
        "error": ordered[f"{name}_error"],
        "freedom": ordered[f"{name}_freedom"],
        "steady": np.ones(len(ordered)),
    }
    usable = usable_points({key: np.asarray(column) for key, column in columns.items()})
    return ordered.assign(**{f"{name}_error": moderated(usable).error})


def carried_errors(
    curve: xr.Dataset, curves: Sequence[pd.DataFrame], name: str
) -> tuple[FloatArray, str]:
    """Return the errors of rates as errors of the stresses at them, (dσ/dγ̇) δγ̇.

    The slope is that of the law fitted to the bulk (`law_slope`), or where there is none, as for
    the rate of the walls, that of a smooth curve (`smooth_slope`).

    Parameters
    ----------
    curve
        A flow curve, averaged over seeds.
    curves
        Its points, those of each combination of the other dimensions together.
    name
        The shear rate.

    Returns
    -------
    tuple of numpy.ndarray and str
        Errors of all points in turn [stress unit], and a sentence on where the slope comes from.
    """
    slopes, source = _slopes(curve, curves, name)
    errors = [
        slope * each[f"{name}_error"].to_numpy() for slope, each in zip(slopes, curves, strict=True)
    ]
    words = "errors of shear rates are carried over to stresses by the slope of"
    return np.concatenate(errors), f"shear_stress_std: {words} {source}"


def _slopes(
    curve: xr.Dataset, curves: Sequence[pd.DataFrame], name: str
) -> tuple[list[FloatArray], str]:
    """Return the slopes of each curve at its points, and what they are of."""
    if name == BULK:
        fit = herschel_bulkley(curve)
        laws = [slope for each in curves if (slope := law_slope(fit, each)) is not None]
        if len(laws) == len(curves):
            return laws, "the fitted Herschel-Bulkley law"
    names = ("stress", name, f"{name}_error")
    found = [smooth_slope(*(each[column].to_numpy() for column in names)) for each in curves]
    return found, "a smooth curve through the points, as no law is fitted to them"


def law_slope(fit: xr.Dataset, points: pd.DataFrame) -> FloatArray | None:
    """Return dσ/dγ̇ = n k γ̇^(n−1) of the law fitted to the bulk at the rates of some points.

    Parameters
    ----------
    fit
        From `analysis.fits.herschel_bulkley`; the law is that of all roughnesses together.
    points
        Of one of its curves.

    Returns
    -------
    numpy.ndarray or None
        None where the points determine no law.
    """
    at = {str(dim): points[dim].iloc[0] for dim in fit["pooled_fit_message"].dims}
    here = fit.sel(at)
    if here["pooled_fit_message"].item() != FITTED:
        return None
    consistency, index = float(here["pooled_consistency"]), float(here["pooled_flow_index"])
    rate = points[BULK].to_numpy()
    return np.asarray(index * consistency * rate ** (index - 1))


def smooth_slope(stress: FloatArray, rate: FloatArray, rate_error: FloatArray) -> FloatArray:
    """Return dσ/dγ̇ of a smooth curve through the points of a flow curve.

    The curve is a parabola of ln σ in ln γ̇ where there are four points or more and it rises at all
    of them, else a straight line. Points count by γ̇/δγ̇, at most 100.

    Parameters
    ----------
    stress, rate, rate_error
        Stresses and rates above 0, shape (points,).

    Returns
    -------
    numpy.ndarray
        NaN where there is no such curve: for a single point, or where stresses fall.
    """
    x, y = np.log(rate), np.log(stress)
    weight = 1.0 / np.maximum(rate_error / rate, LEAST_RELATIVE_ERROR)
    for degree in (2, 1):
        if len(np.unique(x)) >= 2 * degree:
            law = np.polyfit(x, y, degree, w=weight)
            slope = np.polyval(np.polyder(law), x)
            if (slope > 0).all():
                return np.asarray(slope * stress / rate)
    return np.full_like(stress, np.nan)
