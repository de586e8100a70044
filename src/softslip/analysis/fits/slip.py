"""Slip velocity above and below yield."""

import math

import numpy as np
import xarray as xr

from softslip.analysis.fits.points import (
    DRIVES,
    FITTED,
    LEAST_RELATIVE_ERROR,
    Fit,
    FloatArray,
    Points,
    each_cell,
    enlarged,
    laid_out,
    nothing,
    with_stress,
)
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import described

LEAST_POINTS = 2
"""Fewest points of a slip law: one more than it has parameters."""


def _fit_proportional(points: Points, excess: FloatArray, excess_error: float) -> Fit:
    """Fit V = ν x by weighted least squares, where all x share one exact-or-not offset."""
    count = points.count
    if count < LEAST_POINTS:
        least = LEAST_POINTS
        return nothing(1, count, f"too few steady points: {count} of at least {least}")
    error = np.maximum(points.error, LEAST_RELATIVE_ERROR * points.value)
    weight = 1.0 / error**2
    total = float(np.sum(weight * excess**2))
    slope = float(np.sum(weight * excess * points.value)) / total
    deviation = (points.value - slope * excess) / error
    covariance, reduced = enlarged(
        np.array([[1.0 / total]]), float(deviation @ deviation), count - 1
    )
    offset = float(np.sum(weight * (2 * slope * excess - points.value))) / total
    covariance = covariance + (offset * excess_error) ** 2
    return Fit(np.array([slope]), covariance, reduced, count, FITTED)


def slip_law(
    flow_curve: xr.Dataset,
    yield_stress: float | xr.DataArray,
    yield_stress_error: float | xr.DataArray = 0.0,
) -> xr.Dataset:
    """Fit the slip velocity above and below yield (Fig. 6a-c).

    V_s = ν (σ − σ_y) for σ > σ_y and V_s = ν_N σ for σ < σ_y, by least squares weighted with the
    errors of V_s (at least 1 %), over steady points with V_s > 0. The error of σ_y adds to that
    of ν. Seeds are averaged first.

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`, with a dimension ``stress``.
    yield_stress, yield_stress_error
        σ_y and its error [stress unit], one number or one for each combination of some of the
        other dimensions, as from `herschel_bulkley`; NaN leaves nothing to fit.

    Returns
    -------
    xr.Dataset
        For every combination of the other dimensions: ``slip_coefficient`` (ν) and
        ``newtonian_slip_coefficient`` (ν_N) [length unit / time unit / stress unit], each with
        ``_error``, ``_reduced_chi_square``, ``_points`` and ``_message``.
    """
    averaged = with_stress(mean_over_seeds(flow_curve))
    offsets = xr.Dataset({"value": yield_stress, "error": yield_stress_error})

    return xr.merge(
        [_branch(averaged, offsets, above=True), _branch(averaged, offsets, above=False)]
    )


def _branch(flow_curve: xr.Dataset, offsets: xr.Dataset, above: bool) -> xr.Dataset:
    """Fit one side of the yield stress in every cell."""
    name = "slip_coefficient" if above else "newtonian_slip_coefficient"

    def fit(at: dict[str, int], points: Points) -> Fit:
        here = offsets.isel({dim: number for dim, number in at.items() if dim in offsets.dims})
        offset, error = float(here["value"]), float(here["error"])
        if not math.isfinite(offset):
            return nothing(1, 0, "the yield stress is not known")
        side = points.stress > offset if above else points.stress < offset
        chosen = Points(points.stress[side], points.value[side], points.error[side])
        excess = chosen.stress - offset if above else chosen.stress
        known = above and math.isfinite(error)
        return _fit_proportional(chosen, excess, error if known else 0.0)

    dims, fits = each_cell(flow_curve, "slip_velocity", "steady_slip", DRIVES, fit)
    common, values, covariance = laid_out(flow_curve, dims, fits)
    renamed = common.rename(
        {
            "reduced_chi_square": f"{name}_reduced_chi_square",
            "points": f"{name}_points",
            "fit_message": f"{name}_message",
        }
    )
    error = np.sqrt(covariance[..., 0, 0])
    return described(renamed.assign({name: (dims, values[..., 0]), f"{name}_error": (dims, error)}))
