"""The points that fits use, and how their outcomes are laid out."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from softslip.files.quantities import QUANTITIES

FloatArray = NDArray[np.float64]

FITTED = "fitted"
"""Message of a fit that was made and touches no bound."""

DRIVES = ("stress", "imposed_shear_rate")
"""Dimensions along which a flow curve is driven, and so fitted."""

LEAST_RELATIVE_ERROR = 0.01
"""Relative error of a point below which it is not trusted."""


@dataclass(frozen=True)
class Points:
    """Measured values at exactly known stresses [stress unit], all of shape (points,)."""

    stress: FloatArray
    value: FloatArray
    error: FloatArray

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.stress)


@dataclass(frozen=True)
class Fit:
    """Outcome of one fit; numbers are NaN where there was none."""

    values: FloatArray
    covariance: FloatArray
    reduced_chi_square: float
    points: int
    message: str


def nothing(size: int, points: int, message: str) -> Fit:
    """Return the outcome of a fit that was not made, and why."""
    nan = np.full(size, np.nan)
    return Fit(nan, np.full((size, size), np.nan), float("nan"), points, message)


def enlarged(covariance: FloatArray, chi_square: float, freedom: int) -> tuple[FloatArray, float]:
    """Enlarge a covariance where points scatter by more than their errors; return χ²_red too."""
    reduced = chi_square / freedom
    return covariance * max(reduced, 1.0), reduced


def usable_points(cell: xr.Dataset, name: str, flag: str) -> Points:
    """Return the steady, positive points of a dataset with finite errors, sorted by stress."""
    stress = cell["stress"].broadcast_like(cell[name]).values.ravel().astype(np.float64)
    value = cell[name].values.ravel()
    error = cell[f"{name}_error"].values.ravel()
    with np.errstate(invalid="ignore"):
        usable = cell[flag].values.ravel() & (value > 0) & np.isfinite(error) & (stress > 0)
    order = np.argsort(stress[usable], kind="stable")
    return Points(stress[usable][order], value[usable][order], error[usable][order])


def each_cell(
    flow_curve: xr.Dataset,
    name: str,
    flag: str,
    pooled: tuple[str, ...],
    fit: Callable[[dict[str, int], Points], Fit],
) -> tuple[tuple[str, ...], dict[tuple[int, ...], Fit]]:
    """Fit the points of every combination of the dimensions that are not pooled."""
    chosen = flow_curve[[name, f"{name}_error", flag]]
    dims = tuple(str(dim) for dim in chosen.dims if dim not in pooled)
    fits: dict[tuple[int, ...], Fit] = {}
    for place in np.ndindex(*(chosen.sizes[dim] for dim in dims)):
        at = dict(zip(dims, place, strict=True))
        fits[place] = fit(at, usable_points(chosen.isel(at), name, flag))
    return dims, fits


def laid_out(
    flow_curve: xr.Dataset, dims: tuple[str, ...], fits: dict[tuple[int, ...], Fit]
) -> tuple[xr.Dataset, FloatArray, FloatArray]:
    """Return what all fits have in common, their values and their covariances, cell by cell."""
    shape = tuple(flow_curve.sizes[dim] for dim in dims)
    every = [fits[place] for place in np.ndindex(*shape)]
    common = xr.Dataset(
        {
            "reduced_chi_square": (
                dims,
                np.reshape([one.reduced_chi_square for one in every], shape),
                QUANTITIES["reduced_chi_square"].attributes,
            ),
            "points": (
                dims,
                np.reshape([one.points for one in every], shape),
                QUANTITIES["points"].attributes,
            ),
            "fit_message": (
                dims,
                np.reshape(np.array([one.message for one in every], dtype=object), shape),
                QUANTITIES["fit_message"].attributes,
            ),
        },
        coords={dim: flow_curve[dim] for dim in dims if dim in flow_curve.coords},
    )
    values = np.reshape([one.values for one in every], (*shape, -1))
    size = values.shape[-1]
    return common, values, np.reshape([one.covariance for one in every], (*shape, size, size))


def with_stress(flow_curve: xr.Dataset) -> xr.Dataset:
    """Give a flow curve its stress as a coordinate: exact where it was swept, else as measured."""
    if "stress" in flow_curve.coords:
        return flow_curve
    return flow_curve.assign_coords(stress=flow_curve["shear_stress"])
