"""Herschel-Bulkley law of the bulk."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from softslip.analysis.fits.likelihood import (
    CONFIDENCE,
    HOPELESS,
    Optimum,
    Problem,
    optimum,
    profile_interval,
    quality,
)
from softslip.analysis.fits.measured_points import FloatArray, Points, moderated
from softslip.analysis.fits.points import (
    DRIVES,
    FITTED,
    Fit,
    each_cell,
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

FLOW_INDEX_RANGE = (0.05, 5.0)
"""Flow indices that can be told from a jump or a plateau; a fit beyond them fixes none."""

UNKNOWN_ZERO = "the yield stress cannot be told from 0"
"""Message of a fit whose yield stress is 0 within its interval of 95 %."""


def flow_law(rate: FloatArray, yield_stress: float, consistency: float, index: float) -> FloatArray:
    """Return the Herschel-Bulkley stress σ = σ_y + k γ̇^n [stress unit] (Sec. I)."""
    return np.asarray(yield_stress + consistency * rate**index)


def flow_rate(
    stress: FloatArray, yield_stress: float, consistency: float, index: float
) -> FloatArray:
    """Return the shear rate at which the Herschel-Bulkley law has a stress; 0 below yield."""
    return np.asarray((np.maximum(stress - yield_stress, 0.0) / consistency) ** (1.0 / index))


def flow_problem(points: Points) -> Problem:
    """Return the fit of rates at exact stresses: parameters σ_y, ln k and ln n.

    Parameters
    ----------
    points
        Rates over stresses, each over a unit of its own.
    """

    def deviations(parameters: FloatArray) -> FloatArray:
        rates = flow_rate(points.abscissa, parameters[0], *np.exp(parameters[1:]))
        return np.asarray((points.value - rates) / points.error)

    return Problem(deviations, points.freedom, points.common)


def _at_imposed_rate(points: Points) -> Problem:
    """Return the fit of measured stresses and rates, each point with both errors as one.

    The error of a rate counts as that of the stress which the law carries it over to. A rate below
    its own error counts as that error there.
    """

    def deviations(parameters: FloatArray) -> FloatArray:
        consistency, index = np.exp(parameters[1:])
        rate = np.maximum(points.value, points.error)
        carried = index * consistency * rate ** (index - 1) * points.error
        stress = flow_law(np.maximum(points.value, 0.0), parameters[0], consistency, index)
        return np.asarray((points.abscissa - stress) / np.hypot(points.abscissa_error, carried))

    return Problem(deviations, points.freedom, points.common)


def flow_starts(points: Points) -> list[FloatArray]:
    """Return σ_y, ln k and ln n to start from: straight lines in logarithms above some σ_y.

    Parameters
    ----------
    points
        As of `flow_problem`.
    """
    stress, rate = points.abscissa, points.value
    positive = rate > 0
    low = float(stress.min())
    trials = [0.0, 0.5 * low, 0.9 * low, *(0.5 * (stress[:-1] + stress[1:]))[: len(stress) // 2]]
    found = []
    for trial in trials:
        above = positive & (stress > trial)
        if len(np.unique(rate[above])) < 2:
            continue
        slope, offset = np.polyfit(np.log(rate[above]), np.log(stress[above] - trial), 1)
        index = float(np.clip(slope, 0.2, 2.0))
        level = offset if index == slope else float(np.mean(np.log(stress[above] - trial)))
        found.append(np.array([trial, level, np.log(index)]))
    return found


def _fit_flow_law(points: Points) -> Fit:
    """Fit σ_y, k and n; see `herschel_bulkley`.

    Stresses and rates are divided by their largest first, so that nothing depends on units.
    """
    count = points.count
    different = len(np.unique(points.abscissa))
    if count < LEAST_POINTS or different < LEAST_POINTS:
        number = f"{count}" if count < LEAST_POINTS else f"{count}, at {different} stresses,"
        return nothing(3, count, f"too few steady points: {number} of at least {LEAST_POINTS}")
    points = moderated(points)
    stress, rate = float(points.abscissa.max()), float(np.abs(points.value).max())
    if rate == 0:
        return nothing(3, count, "no point flows")
    scaled = points.over(stress, rate)
    measured = bool((points.abscissa_error > 0).any())
    problem = _at_imposed_rate(scaled) if measured else flow_problem(scaled)
    found = optimum(problem, flow_starts(scaled))
    if found is None:
        return nothing(
            3, count, "no point flows" if (points.value <= 0).all() else "no law is near"
        )
    return flow_outcome(problem, found, count, stress, rate)


def flow_outcome(
    problem: Problem,
    found: Optimum,
    count: int,
    stress: float,
    rate: float,
    others: tuple[float, ...] = (),
) -> Fit:
    """Return the outcome in the units of stress and rate, or what the points do not determine.

    Parameters
    ----------
    problem, found
        Of σ_y, ln k, ln n and further parameters over their units.
    count
        Number of points, for the outcome.
    stress, rate, others
        Units of stresses, of rates and of each further parameter.
    """
    size = len(found.values)
    good = quality(problem, found)
    if good.chance < HOPELESS:
        said = f"the law does not describe the points: χ² is {good.reduced_chi_square:.3g} of 1"
        return replace(nothing(size, count, said), reduced_chi_square=good.reduced_chi_square)
    index = float(np.exp(found.values[2]))
    low, high = FLOW_INDEX_RANGE
    if not (low < index < high and np.isfinite(found.covariance).all()):
        return nothing(size, count, "the points do not determine the flow index")
    # ln k in units of one stress and one rate: ln k' + ln(stress) − n ln(rate), to first order.
    directions = np.eye(size)
    directions[1, 2] = -np.log(rate) * index
    level = float(found.values[1] + np.log(stress) - index * np.log(rate))
    ends = np.array(
        [
            [profile_interval(problem, found, d, c, good.widening) for c in CONFIDENCE]
            for d in directions
        ]
    )
    ends[0] *= stress
    with np.errstate(over="ignore"):
        # An end beyond the largest number is as good as none.
        ends[1] = np.exp(ends[1] - float(directions[1] @ found.values) + level)
        ends[2] = np.exp(ends[2])
    if not np.isfinite(ends[2]).all() or ends[2].min() == 0:
        return nothing(size, count, "the points do not determine the flow index")
    ends[3:] *= np.reshape(others, (-1, 1, 1))
    units = np.array(others)
    values = np.array([found.values[0] * stress, np.exp(level), index, *found.values[3:] * units])
    scales = np.diag([stress, values[1], index, *others]) @ directions
    covariance = scales @ found.covariance @ scales.T * good.widening
    message = FITTED if ends[0, -1, 0] > 0 else f"{UNKNOWN_ZERO}: below {ends[0, -1, 1]:.3g}"
    return Fit(values, covariance, ends, good.reduced_chi_square, count, message)


def _herschel_bulkley(flow_curve: xr.Dataset, pooled: tuple[str, ...], prefix: str) -> xr.Dataset:
    dims, fits = each_cell(
        flow_curve,
        "shear_rate_bulk",
        "steady_bulk",
        pooled,
        lambda _, points: _fit_flow_law(points),
    )
    result = laid_out(flow_curve, dims, fits, PARAMETERS, prefix, "fit_message", prefix)
    return described(with_covariance(result, dims, fits, f"{prefix}covariance"))


def with_covariance(
    result: xr.Dataset, dims: tuple[str, ...], fits: Mapping[tuple[int, ...], Fit], name: str
) -> xr.Dataset:
    """Return the outcomes of fits with the covariance of the flow law's parameters.

    Parameters
    ----------
    result, dims, fits
        From `laid_out`, and what it laid out.
    name
        Of the covariance.
    """
    shape, size = tuple(result.sizes[dim] for dim in dims), len(PARAMETERS)
    every = [fits[place].covariance[:size, :size] for place in np.ndindex(*shape)]
    between = ("parameter", "other_parameter")
    covariance = (*dims, *between), np.reshape(every, (*shape, size, size))
    return result.assign({name: covariance}).assign_coords(
        {dim: list(PARAMETERS) for dim in between}
    )


def herschel_bulkley(flow_curve: xr.Dataset) -> xr.Dataset:
    """Fit σ = σ_y + k γ̇^n to the steady bulk flow curve (Fig. 5, right).

    Where the stress is imposed it is exact and rates ((σ − σ_y)/k)^(1/n), zero below yield, are
    compared with those measured by their errors; where the rate of the walls is imposed, stresses
    with those measured, by the errors of both (the rate's carried over to stress, n k γ̇^(n−1) δγ̇).
    Errors are at least 1 %, and Student's by their degrees of freedom (`likelihood`). Seeds are
    averaged and judged together first (`mean_over_seeds`). Every point enters whose verdict is
    steady, or steady within its error, whatever its rate is; drifting ones, such as creep below
    yield, do not. σ_y may come out below zero, so that a fluid without one is not mistaken.

    The message says "fitted" only where the points determine all three: there are at least four at
    different stresses, the law describes them (chance of the deviance above 10⁻⁴), n is between
    0.05 and 5 with intervals that end, and σ_y is above zero at 95 %. Nothing of this depends on
    units.

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`, with a dimension ``stress`` or
        ``imposed_shear_rate``.

    Returns
    -------
    xr.Dataset
        For every combination of the other dimensions: ``yield_stress``, ``consistency``,
        ``flow_index``, their ``_error`` and ``_interval`` (profile likelihood, along
        ``confidence`` and ``end``), ``covariance``, ``reduced_chi_square``, ``points`` and
        ``fit_message``. The same names after ``pooled_`` are of one fit to all roughnesses
        together.
    """
    averaged = with_stress(mean_over_seeds(flow_curve))
    single = _herschel_bulkley(averaged, DRIVES, "")
    return single.merge(_herschel_bulkley(averaged, (*DRIVES, "roughness"), "pooled_"))
