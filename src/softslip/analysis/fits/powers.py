"""Powers of the stress: heterogeneity, and the times of yielding and of slip."""

from functools import partial

import numpy as np
import xarray as xr

from softslip.analysis.fits.likelihood import Problem
from softslip.analysis.fits.measured_points import FloatArray, Points, moderated
from softslip.analysis.fits.outcomes import LawToFit, fitted
from softslip.analysis.fits.points import (
    DRIVES,
    Fit,
    each_cell,
    laid_out,
    nothing,
    number_at,
    with_stress,
)
from softslip.analysis.fits.slip import on_side
from softslip.analysis.observables import mean_over_seeds

LEAST_POINTS = 3
"""Fewest points of a power: one more than it has parameters."""

EXPONENTS = {
    "heterogeneity": "heterogeneity_exponent",
    "yielding_time": "yielding_exponent",
    "slip_time": "slip_time_exponent",
}
"""Quantities that a power of the stress is fitted to, and the exponent of each."""


def fit_power(points: Points, offset: float, offset_error: float) -> Fit:
    """Fit q in y = A ((σ − σ_y)/Δ)^q, where σ_y is as likely as its error says.

    Parameters
    ----------
    points
        Above σ_y; values may be of any sign.
    offset, offset_error
        σ_y and its error [stress unit].
    """
    if points.count < LEAST_POINTS or len(np.unique(points.abscissa)) < LEAST_POINTS:
        said = f"too few points: {points.count} of at least {LEAST_POINTS}"
        return nothing(1, points.count, said)
    points = moderated(points)
    stress, size = float(points.abscissa.max()), float(np.abs(points.value).max())
    middle = float(np.exp(np.mean(np.log(points.abscissa - offset)))) / stress
    at, doubt = offset / stress, offset_error / stress
    exact = offset_error == 0

    def deviations(parameters: FloatArray) -> FloatArray:
        start = at if exact else float(parameters[-1])
        excess = np.maximum(points.abscissa / stress - start, 1e-9) / middle
        found = (
            (points.value / size - parameters[1] * excess ** parameters[0]) * size / points.error
        )
        return found if exact else np.append(found, (start - at) / doubt)

    freedom = points.freedom if exact else np.append(points.freedom, 1e6)
    level = float(np.median(points.value)) / size
    last = [] if exact else [at]
    starts = [np.array([power, level, *last]) for power in (-1.0, -0.2, 0.5)]
    law = LawToFit(Problem(deviations, freedom, points.common), starts, (1.0,), ("the exponent",))
    return fitted(law, points.count)


def powers(
    flow_curve: xr.Dataset, yield_stress: xr.DataArray, yield_stress_error: xr.DataArray
) -> xr.Dataset:
    """Fit powers of the stress, of each roughness and pooled over it (Figs. 6d and 8d-e).

    δ_het ∝ σ^q where the bulk is steady, and τ_y, τ_s ∝ (σ − σ_y)^q above yield by two errors of
    σ_y, by maximum likelihood with the errors of each value (at least 1 %). Runs whose time or
    heterogeneity is not known are left out, as are times without an error.

    Returns
    -------
    xr.Dataset
        ``heterogeneity_exponent``, ``yielding_exponent`` and ``slip_time_exponent``, each with
        ``_error``, ``_interval``, ``_reduced_chi_square``, ``_points`` and ``_message``; after
        ``pooled_`` for all roughnesses together, but for the slip time, which depends on it.
    """
    curve = with_stress(mean_over_seeds(flow_curve))
    offsets = xr.Dataset({"value": yield_stress, "error": yield_stress_error})
    parts = []
    for name, parameter in EXPONENTS.items():
        known = curve.assign(known_value=curve[name].notnull())
        if name == "heterogeneity":
            # Of creep that goes on, it is no property of a flow at that stress.
            known["known_value"] &= curve["steady_bulk"]
        fit = partial(_fit_cell, offsets, name)
        for prefix, pooled in (("", DRIVES), ("pooled_", (*DRIVES, "roughness"))):
            if not (prefix and name == "slip_time"):
                dims, fits = each_cell(known, name, "known_value", pooled, fit)
                before = f"{prefix}{parameter}_"
                parts.append(laid_out(curve, dims, fits, (parameter,), before, pooled=prefix))
    return xr.merge(parts, compat="no_conflicts", join="exact")


def _fit_cell(offsets: xr.Dataset, name: str, at: dict[str, int], points: Points) -> Fit:
    """Fit the power of one quantity in one cell."""
    if name == "heterogeneity":
        return fit_power(points, 0.0, 0.0)
    offset, error = number_at(offsets["value"], at), number_at(offsets["error"], at)
    if not (np.isfinite(offset) and np.isfinite(error)):
        return nothing(1, 0, "the yield stress is not known")
    chosen = points.where(on_side(points.abscissa, offset, error, above=True))
    return fit_power(chosen, offset, error)
