"""How steady flow depends on the size of the channel: Eq. A1, and trends (Appendix A)."""

from dataclasses import replace

import numpy as np
import xarray as xr

from softslip.analysis.fits.likelihood import Problem
from softslip.analysis.fits.measured_points import FloatArray, Points, dimensionless, moderated
from softslip.analysis.fits.outcomes import LawToFit, fitted
from softslip.analysis.fits.points import (
    FITTED,
    IMPOSED_RATE,
    Fit,
    laid_out,
    nothing,
    points_of_cells,
)
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import described

SEPARATION, LENGTH = "wall_separation", "channel_length"
"""Dimensions that `channel.height` and `channel.length` become where they are swept."""

ONE_SIZE = {
    SEPARATION: "one wall separation only: sweep channel.height",
    LENGTH: "one channel length only: sweep channel.length",
}
"""Message where a size was not swept."""

NO_STRESS = "wall separations share no stress: impose rheometer.stress"
"""Message where the walls' rate is imposed, and the stress is another one in each channel."""

MOONEY_SLIP, MOONEY_BULK = "mooney_slip_velocity", "mooney_shear_rate_bulk"
"""Parameters of Eq. A1."""

MISMATCH = f"{MOONEY_SLIP}_mismatch"

LEAST_SEPARATIONS = 3
"""Fewest wall separations of a fit of Eq. A1: one more than it has parameters."""

LEAST_SIZES = 2
"""Fewest sizes of a trend."""

FLAGS_OF_TRENDS = {"shear_rate_bulk": "steady_bulk", "slip_velocity": "steady_slip"}
"""What is free of the trivial dependence of Eq. A1, and the flag of its steady state."""

SIZES = {SEPARATION: "separation", LENGTH: "length"}
"""What a size is called in the name of a trend."""


def trend_name(name: str, size: str) -> str:
    """Return what the trend of a quantity with a size is called in the fits."""
    return f"{name}_{SIZES[size]}_trend"


def refusal(flow_curve: xr.Dataset, size: str) -> str:
    """Return why nothing can be fitted over a size of the channel, nothing where it can."""
    if flow_curve.sizes.get(size, 1) < LEAST_SIZES:
        return ONE_SIZE[size]
    if size == SEPARATION and IMPOSED_RATE in flow_curve.dims:
        return NO_STRESS
    return ""


def _refused(
    flow_curve: xr.Dataset, size: str, parameters: int
) -> tuple[tuple[str, ...], dict[tuple[int, ...], Fit]]:
    """Return outcomes that say why there is none, in every cell."""
    dims = tuple(str(dim) for dim in flow_curve["shear_rate_bulk"].dims if dim != size)
    outcome = nothing(parameters, 0, refusal(flow_curve, size))
    return dims, {place: outcome for place in np.ndindex(*(flow_curve.sizes[dim] for dim in dims))}


def _fitted_about_zero(law: LawToFit, count: int) -> Fit:
    """Fit a law of which parameters may be 0, where steps relative to them would be lost.

    Difference quotients take steps in proportion to a parameter, so that each is counted from −1.
    """

    def deviations(moved: FloatArray) -> FloatArray:
        return law.problem.deviations(moved - 1)

    problem = replace(law.problem, deviations=deviations)
    fit = fitted(replace(law, problem=problem, starts=[start + 1 for start in law.starts]), count)
    units = np.array(law.units)
    ends = fit.intervals - units[:, None, None]
    return replace(fit, values=fit.values - units, intervals=ends)


def _fit_mooney(wall: Points, bulk: Points, slip: Points) -> Fit:
    """Fit V_s and γ̇_bulk of Eq. A1, and compare V_s with that of the profiles."""
    count = wall.count
    if count < LEAST_SEPARATIONS:
        said = f"too few steady points: {count} of at least {LEAST_SEPARATIONS} wall separations"
        return nothing(2, count, said)
    scaled, size, rate = dimensionless(wall, np.min)
    inverse = 2 / scaled.abscissa

    def deviations(parameters: FloatArray) -> FloatArray:
        rates = parameters[0] * inverse + parameters[1]
        return np.asarray((scaled.value - rates) / scaled.error)

    start = np.polyfit(inverse, scaled.value, 1, w=1 / scaled.error)
    names = ("the slip velocity", "the bulk shear rate")
    law = LawToFit(
        Problem(deviations, scaled.freedom, scaled.common), [start], (rate * size, rate), names
    )
    fit = _fitted_about_zero(law, count)
    mismatch = _mismatch(fit, moderated(wall), moderated(bulk), moderated(slip))
    return replace(fit, more={"mismatch": mismatch})


def _mismatch(fit: Fit, wall: Points, bulk: Points, slip: Points) -> float:
    """Return V_s of Eq. A1 less the mean of the profiles', over the error of the difference.

    Both are from the same runs, so that their errors are not independent: both are sums of the
    channels' values with known weights, and the covariance of the two values of one channel follows
    from three errors (`_covariance`).
    """
    _, at, own = np.intersect1d(wall.abscissa, slip.abscissa, return_indices=True)
    if fit.message != FITTED or not len(at):
        return float("nan")
    inverse, weight = 2 / wall.abscissa, wall.error**-2.0
    slope = weight * (inverse - np.average(inverse, weights=weight))
    slope /= slope @ inverse
    share = slip.error[own] ** -2.0
    share /= share.sum()
    known = dict(zip(bulk.abscissa.tolist(), bulk.error.tolist(), strict=True))
    bulk_error = np.array([known.get(height, np.nan) for height in wall.abscissa[at].tolist()])
    together = _covariance(inverse[at], wall.error[at], bulk_error, slip.error[own])
    variance = fit.covariance[0, 0] + share**2 @ slip.error[own] ** 2
    variance -= 2 * (slope[at] * share) @ together
    difference = fit.values[0] - share @ slip.value[own]
    return float(difference / np.sqrt(variance)) if variance > 0 else float("nan")


def _covariance(
    inverse: FloatArray, wall: FloatArray, bulk: FloatArray, slip: FloatArray
) -> FloatArray:
    """Return the covariance of γ̇_wall and V_s of each channel, from the errors of three series.

    γ̇_bulk = γ̇_wall − 2 V_s/H holds for the means of every run, so that
    δγ̇_bulk² = δγ̇_wall² + (2/H)² δV_s² − 2 (2/H) cov. Where the bulk is not steady, and so averaged
    over another window, its fluctuations are taken as independent of those of slip.

    Parameters
    ----------
    inverse
        2/H.
    wall, bulk, slip
        Errors of γ̇_wall, γ̇_bulk (NaN where it is not steady) and V_s.
    """
    found = (wall**2 + (inverse * slip) ** 2 - bulk**2) / (2 * inverse)
    found = np.where(np.isfinite(bulk), found, inverse * slip**2)
    return np.asarray(np.clip(found, -wall * slip, wall * slip))


def _fit_trend(points: Points) -> Fit:
    """Fit the relative change a per doubling in y = y₀ (1 + a log₂(L/L₀)).

    L₀ is the geometric mean of the sizes. Where y₀ may be 0, a has no bounds, and the fit says so.
    """
    count = points.count
    if count < LEAST_SIZES:
        return nothing(1, count, f"too few steady points: {count} of at least {LEAST_SIZES} sizes")
    scaled, _, _ = dimensionless(points, np.min)
    doublings = np.log2(scaled.abscissa)
    doublings -= doublings.mean()

    def deviations(parameters: FloatArray) -> FloatArray:
        expected = parameters[1] * (1 + parameters[0] * doublings)
        return np.asarray((scaled.value - expected) / scaled.error)

    slope, level = np.polyfit(doublings, scaled.value, 1, w=1 / scaled.error)
    # Relative to a level of at least its error, as starts must be finite.
    least = float(scaled.error.min())
    start = np.array([slope / (level if abs(level) > least else least), level])
    law = LawToFit(
        Problem(deviations, scaled.freedom, scaled.common),
        [start],
        (1.0,),
        ("the relative change",),
    )
    return _fitted_about_zero(law, count)


def finite_size(flow_curve: xr.Dataset) -> xr.Dataset:
    """Fit Eq. A1 over wall separations, and look for trends with the size of the channel.

    γ̇_wall(H) = 2 V_s/H + γ̇_bulk with V_s and γ̇_bulk that do not depend on H: Mooney's way to
    measure slip without a velocity profile (M. Mooney, *J. Rheol.* 2, 210, 1931). V_s is the slope
    of the steady apparent rates in 2/H, γ̇_bulk their intercept, both for each stress, by maximum
    likelihood with the errors of the rates (at least 1 %, Student's by their degrees of freedom).
    The mismatch is this V_s less the mean of those of the velocity profiles, weighted by their
    errors, over the standard error of the difference: beyond about 2, or 3 where errors are from
    three seeds, V_s or γ̇_bulk depends on H, or the profiles measure something else.

    A trend is the relative change of the steady bulk rate, or of the slip velocity, with each
    doubling of H or of the channel's length L_x, by a straight line in the logarithm of the size.
    Sizes make a difference where its interval leaves out 0. Two sizes determine it, and nothing is
    left to tell whether the line describes them.

    Seeds are averaged and judged together first. Where a size was not swept the message says so.

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`.

    Returns
    -------
    xr.Dataset
        For every combination of the dimensions other than ``wall_separation``:
        ``mooney_slip_velocity`` [length unit / time unit], its ``_mismatch``, and
        ``mooney_shear_rate_bulk`` [1 / time unit], which shares ``_reduced_chi_square``,
        ``_points`` and ``_message`` with it; ``shear_rate_bulk_separation_trend`` and
        ``slip_velocity_separation_trend``. For every combination of those other than
        ``channel_length``: ``shear_rate_bulk_length_trend`` and ``slip_velocity_length_trend``.
        Each has ``_error`` and ``_interval``.
    """
    averaged = mean_over_seeds(flow_curve)
    parts = [_mooney(averaged)]
    parts += [_trend(averaged, name, size) for size in SIZES for name in FLAGS_OF_TRENDS]
    return xr.merge(parts, compat="no_conflicts", join="exact")


def _mooney(curve: xr.Dataset) -> xr.Dataset:
    """Fit Eq. A1 in every cell."""
    if refusal(curve, SEPARATION):
        dims, fits = _refused(curve, SEPARATION, 2)
    else:
        pooled = (SEPARATION,)
        dims, wall = points_of_cells(curve, "shear_rate_wall", "steady_wall", pooled, SEPARATION)
        _, bulk = points_of_cells(curve, "shear_rate_bulk", "steady_bulk", pooled, SEPARATION)
        _, slip = points_of_cells(curve, "slip_velocity", "steady_slip", pooled, SEPARATION)
        fits = {place: _fit_mooney(wall[place], bulk[place], slip[place]) for place in wall}
    part = laid_out(curve, dims, fits, (MOONEY_SLIP, MOONEY_BULK), f"{MOONEY_SLIP}_")
    shape = tuple(curve.sizes[dim] for dim in dims)
    found = [fits[place].more.get("mismatch", np.nan) for place in np.ndindex(*shape)]
    part[MISMATCH] = dims, np.reshape(found, shape)
    return described(part)


def _trend(curve: xr.Dataset, name: str, size: str) -> xr.Dataset:
    """Fit the trend of one quantity with one size in every cell."""
    if refusal(curve, size):
        dims, fits = _refused(curve, size, 1)
    else:
        dims, points = points_of_cells(curve, name, FLAGS_OF_TRENDS[name], (size,), size)
        fits = {place: _fit_trend(points[place]) for place in points}
    parameter = trend_name(name, size)
    return laid_out(curve, dims, fits, (parameter,), f"{parameter}_")
