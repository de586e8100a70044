"""Herschel-Bulkley law of the bulk."""

import numpy as np
import xarray as xr
from scipy import optimize

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

PARAMETERS = ("yield_stress", "consistency", "flow_index")
"""Parameters of the Herschel-Bulkley law, in the order of its covariance."""

LEAST_POINTS = 4
"""Fewest points of a fit: one more than it has parameters."""

FLOW_INDEX_BOUNDS = (0.1, 2.0)
"""Range of the flow index n."""

ROUNDS = 50
"""Most rounds of reweighting."""

TOLERANCE = 1e-7
"""Relative change of the parameters at which reweighting ends."""


def flow_law(rate: FloatArray, yield_stress: float, consistency: float, index: float) -> FloatArray:
    """Return the Herschel-Bulkley stress σ = σ_y + k γ̇^n [stress unit] (Sec. I)."""
    return np.asarray(yield_stress + consistency * rate**index)


def _fit_flow_law(points: Points) -> Fit:
    """Fit σ_y, k and n by reweighted least squares; see `herschel_bulkley`."""
    count = points.count
    if count < LEAST_POINTS:
        return nothing(3, count, f"too few steady points: {count} of at least {LEAST_POINTS}")
    if len(np.unique(points.stress)) < LEAST_POINTS:
        different = len(np.unique(points.stress))
        return nothing(3, count, f"too few stresses: {different} of at least {LEAST_POINTS}")
    relative = np.maximum(points.error / points.value, LEAST_RELATIVE_ERROR)
    low, high = float(points.stress.min()), float(points.stress.max())
    lowest, highest = FLOW_INDEX_BOUNDS
    bounds = ([0.0, 0.0, lowest], [high, np.inf, highest])
    values = np.array([0.5 * low, (high - 0.5 * low) / points.value.max() ** 0.5, 0.5])
    for _ in range(ROUNDS):
        viscous = values[1] * points.value ** values[2]
        error = np.maximum(values[2] * viscous * relative, 1e-12 * high)
        try:
            new, covariance = optimize.curve_fit(
                flow_law,
                points.value,
                points.stress,
                p0=np.clip(values, bounds[0], bounds[1]),
                sigma=error,
                absolute_sigma=True,
                bounds=bounds,
                x_scale=np.maximum(values, [1e-3 * high, 1e-3 * high, lowest]),
            )
        except (RuntimeError, optimize.OptimizeWarning) as failure:
            return nothing(3, count, f"the fit to {count} points failed: {failure}")
        converged = np.allclose(new, values, rtol=TOLERANCE, atol=TOLERANCE * high)
        values = new
        if converged:
            break
    else:
        return nothing(3, count, f"the fit did not settle in {ROUNDS} rounds of reweighting")
    deviation = (points.stress - flow_law(points.value, *values)) / error
    covariance, reduced = enlarged(covariance, float(deviation @ deviation), count - 3)
    return _at_bounds(Fit(values, covariance, reduced, count, FITTED))


def _at_bounds(fit: Fit) -> Fit:
    """Say which parameters stick at a bound, and take away their errors."""
    yield_stress, consistency, index = (float(value) for value in fit.values)
    scale = yield_stress + consistency
    lowest, highest = FLOW_INDEX_BOUNDS
    stuck = [
        (0, yield_stress <= 1e-6 * scale, "the yield stress at its bound 0"),
        (2, index <= lowest * (1 + 1e-4), f"the flow index at its bound {lowest:g}"),
        (2, index >= highest * (1 - 1e-4), f"the flow index at its bound {highest:g}"),
    ]
    covariance = fit.covariance.copy()
    for row, is_stuck, _ in stuck:
        if is_stuck:
            covariance[row, :] = covariance[:, row] = np.nan
    said = " and ".join(words for _, is_stuck, words in stuck if is_stuck)
    message = f"{fit.message}, with {said}: its error is not known" if said else fit.message
    return Fit(fit.values, covariance, fit.reduced_chi_square, fit.points, message)


def _herschel_bulkley(flow_curve: xr.Dataset, pooled: tuple[str, ...]) -> xr.Dataset:
    dims, fits = each_cell(
        flow_curve,
        "shear_rate_bulk",
        "steady_bulk",
        pooled,
        lambda _, points: _fit_flow_law(points),
    )
    result, values, covariance = laid_out(flow_curve, dims, fits)
    for number, name in enumerate(PARAMETERS):
        result[name] = dims, values[..., number]
        result[f"{name}_error"] = dims, np.sqrt(covariance[..., number, number])
    between = ("parameter", "other_parameter")
    result["covariance"] = (*dims, *between), covariance
    return described(result.assign_coords({dim: list(PARAMETERS) for dim in between}))


def herschel_bulkley(flow_curve: xr.Dataset) -> xr.Dataset:
    """Fit σ = σ_y + k γ̇^n to the steady bulk flow curve (Fig. 5, right).

    The stress is exact and the error lies in γ̇, so each point's deviation in stress is weighted
    by its error carried over to stress, n k γ̇^n (δγ̇/γ̇), with δγ̇/γ̇ at least 1 %; weights and
    parameters are iterated until both agree (`scipy.optimize.curve_fit`, 0 ≤ σ_y, 0.1 ≤ n ≤ 2).
    Seeds are averaged first (`mean_over_seeds`). Points that are missing, not steady, or of a rate
    or stress that is not positive are left out.

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`, with a dimension ``stress``.

    Returns
    -------
    xr.Dataset
        For every combination of the other dimensions: ``yield_stress``, ``consistency``,
        ``flow_index``, their ``_error`` and ``covariance``, ``reduced_chi_square``, ``points`` and
        ``fit_message`` ("fitted" or why not). The same names after ``pooled_`` are of one fit
        to all roughnesses together. A parameter at its bound has no error.
    """
    averaged = with_stress(mean_over_seeds(flow_curve))
    single = _herschel_bulkley(averaged, DRIVES)
    pooled = _herschel_bulkley(averaged, (*DRIVES, "roughness"))
    return single.merge(pooled.rename({name: f"pooled_{name}" for name in pooled.data_vars}))
