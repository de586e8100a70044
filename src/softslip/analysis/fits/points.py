"""The points that fits use, and how their outcomes are laid out."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from softslip.analysis.fits.likelihood import CONFIDENCE, MOST_FREEDOM
from softslip.analysis.fits.measured_points import FloatArray, Points
from softslip.files.quantities import described

FITTED = "fitted"
"""Message of a fit that was made and determines its parameters."""

IMPOSED_STRESS, IMPOSED_RATE = "stress", "imposed_shear_rate"

DRIVES = (IMPOSED_STRESS, IMPOSED_RATE)
"""Dimensions along which a flow curve is driven, and so fitted."""

LEAST_RELATIVE_ERROR = 0.01
"""Relative error of a point below which it is not trusted."""

ENDS = ("low", "high")
"""Ends of an interval."""

INTERVAL = ("confidence", "end")
"""Dimensions of intervals."""


@dataclass(frozen=True)
class Fit:
    """Outcome of one fit; numbers are NaN where there was none.

    Attributes
    ----------
    values, covariance
        Of the parameters, shapes (p,) and (p, p).
    intervals
        Ends of the intervals of each, shape (p, confidence, 2).
    reduced_chi_square
        Deviance over the one expected.
    points
        Number of points.
    message
        `FITTED`, or why there is none or what it does not determine.
    more
        Further numbers.
    """

    values: FloatArray
    covariance: FloatArray
    intervals: FloatArray
    reduced_chi_square: float
    points: int
    message: str
    more: Mapping[str, float] = field(default_factory=dict)


def nothing(size: int, points: int, message: str) -> Fit:
    """Return the outcome of a fit that was not made, and why."""
    intervals = np.full((size, len(CONFIDENCE), 2), np.nan)
    covariance = np.full((size, size), np.nan)
    return Fit(np.full(size, np.nan), covariance, intervals, float("nan"), points, message)


def usable_points(rows: Mapping[str, NDArray[np.generic]]) -> Points:
    """Return the points that have a steady verdict and an error, sorted by the abscissa.

    No point is left out, or taken, for its value: that would bias what is fitted to it. Errors are
    at least 1 % of the value.

    Parameters
    ----------
    rows
        ``abscissa``, ``abscissa_error``, ``value``, ``error``, ``freedom`` and ``steady`` of
        points.
    """
    found = {key: np.asarray(row, dtype=np.float64) for key, row in rows.items() if key != "steady"}
    found["error"] = np.maximum(found["error"], LEAST_RELATIVE_ERROR * np.abs(found["value"]))
    found["freedom"] = np.where(found["freedom"] > 0, found["freedom"], MOST_FREEDOM)
    with np.errstate(invalid="ignore"):
        usable = np.asarray(rows["steady"], dtype=bool) & np.isfinite(found["value"])
        usable &= (found["abscissa"] > 0) & np.isfinite(found["error"]) & (found["error"] > 0)
    order = np.argsort(found["abscissa"][usable], kind="stable")
    kept = {key: row[usable][order] for key, row in found.items()}
    return Points(**kept, common=float(kept["freedom"].sum()))


def points_of_cells(
    flow_curve: xr.Dataset,
    name: str,
    flag: str,
    pooled: tuple[str, ...],
    along: str = IMPOSED_STRESS,
) -> tuple[tuple[str, ...], dict[tuple[int, ...], Points]]:
    """Return the usable points of every combination of the dimensions that are not pooled.

    Parameters
    ----------
    flow_curve
        Averages over seeds.
    name, flag
        Its variable that is fitted, with its ``_error``, and the flag of its steady state.
    pooled
        Dimensions whose points are fitted together.
    along
        The abscissa.

    Returns
    -------
    dims
        The other dimensions.
    points
        Those of each cell, by its place along them.
    """
    value, unknown = flow_curve[name], xr.full_like(flow_curve[name], MOST_FREEDOM)
    columns = {
        "abscissa": flow_curve[along],
        "abscissa_error": flow_curve.get(f"{along}_error", xr.zeros_like(value)),
        "value": value,
        "error": flow_curve[f"{name}_error"],
        "freedom": flow_curve.get(f"{name}_freedom", unknown),
        "steady": flow_curve[flag],
    }
    dims = tuple(str(dim) for dim in value.dims if dim not in pooled)
    order = (*dims, *(dim for dim in value.dims if dim in pooled))
    laid = {
        key: column.broadcast_like(value).transpose(*order).values
        for key, column in columns.items()
    }
    points: dict[tuple[int, ...], Points] = {}
    for place in np.ndindex(*(value.sizes[dim] for dim in dims)):
        points[place] = usable_points({key: np.ravel(each[place]) for key, each in laid.items()})
    return dims, points


def each_cell(
    flow_curve: xr.Dataset,
    name: str,
    flag: str,
    pooled: tuple[str, ...],
    fit: Callable[[dict[str, int], Points], Fit],
) -> tuple[tuple[str, ...], dict[tuple[int, ...], Fit]]:
    """Fit the points of every combination of the dimensions that are not pooled.

    Parameters
    ----------
    flow_curve, name, flag, pooled
        As for `points_of_cells`; the abscissa is the stress.
    fit
        Takes the place of a cell along each other dimension, and its points.
    """
    dims, points = points_of_cells(flow_curve, name, flag, pooled)
    return dims, {
        place: fit(dict(zip(dims, place, strict=True)), points[place]) for place in points
    }


def number_at(numbers: xr.DataArray, at: Mapping[str, int]) -> float:
    """Return a number at a place, of which it may lack dimensions."""
    return float(numbers.values[tuple(at[str(dim)] for dim in numbers.dims)])


def laid_out(
    flow_curve: xr.Dataset,
    dims: tuple[str, ...],
    fits: Mapping[tuple[int, ...], Fit],
    parameters: tuple[str, ...],
    prefix: str = "",
    message: str = "message",
    pooled: str = "",
) -> xr.Dataset:
    """Return the outcomes of all fits, cell by cell.

    Returns
    -------
    xr.Dataset
        For each parameter, its name after ``pooled``, its value, ``_error`` (standard error) and
        ``_interval`` (along ``confidence`` and ``end``); after ``prefix``, ``reduced_chi_square``,
        ``points`` and the message.
    """
    shape = tuple(flow_curve.sizes[dim] for dim in dims)
    every = [fits[place] for place in np.ndindex(*shape)]
    result = xr.Dataset(coords={dim: flow_curve[dim] for dim in dims if dim in flow_curve.coords})
    result = result.assign_coords(confidence=list(CONFIDENCE), end=list(ENDS))

    def put(name: str, values: list[Any], *more: str) -> None:
        kind = object if isinstance(values[0], str) else None
        sizes = (*shape, *(result.sizes[dim] for dim in more))
        result[name] = (*dims, *more), np.reshape(np.array(values, dtype=kind), sizes)

    put(f"{prefix}reduced_chi_square", [one.reduced_chi_square for one in every])
    put(f"{prefix}points", [one.points for one in every])
    put(f"{prefix}{message}", [one.message for one in every])
    for number, name in enumerate(parameters):
        put(f"{pooled}{name}", [one.values[number] for one in every])
        variances = [one.covariance[number, number] for one in every]
        put(f"{pooled}{name}_error", [float(np.sqrt(variance)) for variance in variances])
        put(f"{pooled}{name}_interval", [one.intervals[number] for one in every], *INTERVAL)
    return described(result)


def with_stress(flow_curve: xr.Dataset) -> xr.Dataset:
    """Give a flow curve its stress as a coordinate: exact where it was swept, else as measured."""
    if "stress" in flow_curve.coords:
        return flow_curve
    curve = flow_curve.assign_coords(stress=flow_curve["shear_stress"])
    if "shear_stress_error" in flow_curve:
        curve["stress_error"] = flow_curve["shear_stress_error"]
    return curve
