"""Slip velocity above and below yield."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

from softslip.analysis.fits.likelihood import Problem
from softslip.analysis.fits.measured_points import FloatArray, Points, dimensionless
from softslip.analysis.fits.outcomes import LawToFit, fitted, least_deviance
from softslip.analysis.fits.points import (
    DRIVES,
    Fit,
    each_cell,
    laid_out,
    nothing,
    number_at,
    with_stress,
)
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import described

CLEAR = 2.0
"""Errors of the yield stress by which a stress is clearly above or below it."""

QUADRATIC = 2.0
"""Exponent that p = 1 is compared with (Refs. 21, 22 of the paper)."""

CONCLUSIVE = 3.0
"""Size of the evidence, a logarithm of a ratio of likelihoods, from which it favours an exponent:
one is then twenty times as likely as the other."""

COEFFICIENT, NEWTONIAN = "slip_coefficient", "newtonian_slip_coefficient"
EXPONENT, INTERCEPT = "slip_exponent", "slip_yield_stress"
EVIDENCE = "slip_linear_evidence"


def _law(
    points: Points, offset: float, offset_error: float, exponent: float | None
) -> tuple[Problem, list[FloatArray]]:
    """Return the fit of V = A ((σ − σ_y)/Δ)^p: parameters A, p where it is free, σ_y.

    Δ is the largest σ − σ_y. σ_y is as likely as its error says; it is no parameter where it is
    exact.
    """
    largest = float(points.abscissa.max()) - offset
    exact = offset_error == 0

    def deviations(parameters: FloatArray) -> FloatArray:
        power = parameters[1] if exponent is None else exponent
        start = offset if exact else float(parameters[-1])
        excess = np.maximum(points.abscissa - start, 1e-9 * largest)
        speeds = parameters[0] * (excess / largest) ** power
        found = (points.value - speeds) / points.error
        return found if exact else np.append(found, (start - offset) / offset_error)

    freedom = points.freedom if exact else np.append(points.freedom, 1e6)
    level = float(np.average(points.value, weights=(points.abscissa - offset) / points.error**2))
    middle = [] if exponent is not None else [1.0]
    last = [] if exact else [offset]
    starts = [np.array([level * factor, *middle, *last]) for factor in (1.0, 2.0)]
    return Problem(deviations, freedom, points.common), starts


def _fit_above(points: Points, offset: float, offset_error: float) -> Fit:
    """Fit ν with p = 1, and compare with p = 2."""
    if points.count < 2:
        return nothing(1, points.count, f"too few steady points: {points.count} of at least 2")
    scaled, stress, speed = dimensionless(points)
    at, doubt = offset / stress, offset_error / stress
    problem, starts = _law(scaled, at, doubt, 1.0)
    unit = speed / (stress - offset)
    fit = fitted(LawToFit(problem, starts, (unit,), ("the slip coefficient",)), points.count)
    quadratic, starts = _law(scaled, at, doubt, QUADRATIC)
    linear = least_deviance(LawToFit(problem, starts, (1.0,), ("",)))
    more = {"evidence": 0.5 * (least_deviance(LawToFit(quadratic, starts, (1.0,), ("",))) - linear)}
    return replace(fit, more=more)


def _fit_exponent(points: Points, offset: float, offset_error: float) -> Fit:
    """Fit p with a free coefficient."""
    if points.count < 3:
        return nothing(1, points.count, f"too few steady points: {points.count} of at least 3")
    scaled, stress, _ = dimensionless(points)
    problem, starts = _law(scaled, offset / stress, offset_error / stress, None)

    def turned(parameters: FloatArray) -> FloatArray:
        return problem.deviations(np.concatenate(([parameters[1], parameters[0]], parameters[2:])))

    first = [np.concatenate(([start[1], start[0]], start[2:])) for start in starts]
    law = LawToFit(replace(problem, deviations=turned), first, (1.0,), ("the exponent",))
    return fitted(law, points.count)


def _fit_intercept(points: Points, offset: float) -> Fit:
    """Fit the stress at which slip begins, V = ν (σ − σ'), with a free coefficient."""
    if points.count < 3:
        return nothing(1, points.count, f"too few steady points: {points.count} of at least 3")
    scaled, stress, _ = dimensionless(points)

    def deviations(parameters: FloatArray) -> FloatArray:
        speeds = parameters[1] * (scaled.abscissa - parameters[0])
        return np.asarray((scaled.value - speeds) / scaled.error)

    slope, _ = np.polyfit(scaled.abscissa, scaled.value, 1, w=1 / scaled.error)
    law = LawToFit(
        Problem(deviations, scaled.freedom, scaled.common),
        [np.array([offset / stress, slope]), np.array([0.0, slope])],
        (stress,),
        ("the stress at which slip begins",),
    )
    return fitted(law, points.count)


def _fit_below(points: Points) -> Fit:
    """Fit V = ν_N σ."""
    if points.count < 2:
        return nothing(1, points.count, f"too few steady points: {points.count} of at least 2")
    scaled, stress, speed = dimensionless(points)
    problem, starts = _law(scaled, 0.0, 0.0, 1.0)
    return fitted(
        LawToFit(problem, starts, (speed / stress,), ("the slip coefficient",)), points.count
    )


def slip_law(
    flow_curve: xr.Dataset,
    yield_stress: float | xr.DataArray,
    yield_stress_error: float | xr.DataArray = 0.0,
) -> xr.Dataset:
    """Fit the slip velocity above and below yield (Fig. 6a-c).

    V_s = ν (σ − σ_y)^p for σ > σ_y and V_s = ν_N σ for σ < σ_y, by maximum likelihood with the
    errors of V_s (at least 1 %, Student's by their degrees of freedom). Every point enters whose
    verdict is steady, or steady within its error, also where V_s is zero or negative, as at rough
    walls. A stress counts as above or below yield if it is so by two errors of σ_y. σ_y itself is
    fitted along, as likely as its error says. Where σ_y is not known, the two laws without it are
    fitted by verdicts: below the least stress at which the bulk flows, and from there on. Seeds are
    averaged and judged together first.

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
        For every combination of the other dimensions: ``slip_coefficient`` (ν, p = 1),
        ``newtonian_slip_coefficient`` (ν_N) [length unit / time unit / stress unit],
        ``slip_exponent`` (p, free) and ``slip_yield_stress`` (σ_y free, p = 1), each with
        ``_error``, ``_interval``, ``_reduced_chi_square``, ``_points`` and ``_message``; and
        ``slip_linear_evidence``, the natural logarithm of the likelihood of p = 1 over that of
        p = 2, which have as many parameters: above 3 for p = 1, below −3 for p = 2, else neither
        (`CONCLUSIVE`).
    """
    averaged = with_stress(mean_over_seeds(flow_curve))
    offsets = xr.Dataset(
        {
            "value": yield_stress,
            "error": yield_stress_error,
            "flowing": least_flowing_stress(averaged),
        }
    )
    parts = [_fitted_everywhere(averaged, offsets, name) for name in _MAKERS]
    return xr.merge(parts, compat="no_conflicts", join="exact")


_MAKERS: dict[str, Callable[[Points, float, float], Fit]] = {
    COEFFICIENT: _fit_above,
    EXPONENT: _fit_exponent,
    INTERCEPT: lambda points, offset, _: _fit_intercept(points, offset),
    NEWTONIAN: lambda points, _, __: _fit_below(points),
}
"""What fits each parameter to points on its side, given σ_y and its error."""


def _fitted_everywhere(flow_curve: xr.Dataset, offsets: xr.Dataset, name: str) -> xr.Dataset:
    """Fit one parameter in every cell."""
    above, alone = name != NEWTONIAN, name in (NEWTONIAN, INTERCEPT)

    def fit(at: dict[str, int], points: Points) -> Fit:
        offset, error = number_at(offsets["value"], at), number_at(offsets["error"], at)
        if math.isfinite(offset) and math.isfinite(error):
            chosen = on_side(points.abscissa, offset, error, above)
            return _MAKERS[name](points.where(chosen), offset, error)
        if not alone:
            return nothing(1, 0, "the yield stress is not known")
        least = number_at(offsets["flowing"], at)
        chosen = (points.abscissa >= least) if above else ~(points.abscissa >= least)
        return _MAKERS[name](points.where(chosen), 0.0, 0.0)

    dims, fits = each_cell(flow_curve, "slip_velocity", "steady_slip", DRIVES, fit)
    part = laid_out(flow_curve, dims, fits, (name,), f"{name}_")
    if name == COEFFICIENT:
        shape = tuple(flow_curve.sizes[dim] for dim in dims)
        ratios = [fits[place].more.get("evidence", np.nan) for place in np.ndindex(*shape)]
        part[EVIDENCE] = dims, np.reshape(ratios, shape)
    return described(part)


def least_flowing_stress(flow_curve: xr.Dataset) -> xr.DataArray:
    """Return the least stress at which the bulk flows at any roughness; NaN where it never does."""
    stress = flow_curve["stress"].where(flow_curve["steady_bulk"])
    return stress.min([dim for dim in stress.dims if dim in (*DRIVES, "roughness")])


def on_side(stress: FloatArray, offset: float, error: float, above: bool) -> np.ndarray:
    """Tell which stresses are clearly above, or below, a yield stress with an error."""
    side = 1.0 if above else -1.0
    return np.asarray(side * (stress - offset) > CLEAR * error)
