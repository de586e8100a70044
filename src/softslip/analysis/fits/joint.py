"""Flow and slip by one yield stress: what the slip tells of it where the bulk alone cannot."""

from dataclasses import replace

import numpy as np
import xarray as xr
from scipy import stats

from softslip.analysis.fits.branches import two_branches
from softslip.analysis.fits.flow import (
    PARAMETERS,
    flow_outcome,
    flow_problem,
    flow_starts,
    with_covariance,
)
from softslip.analysis.fits.likelihood import Optimum, Problem, freedom_along, optimum
from softslip.analysis.fits.measured_points import FloatArray, Points, dimensionless, moderated
from softslip.analysis.fits.points import (
    DRIVES,
    FITTED,
    Fit,
    laid_out,
    nothing,
    points_of_cells,
    with_stress,
)
from softslip.analysis.fits.slip import has_film
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import JOINT, POOLED, described

LEAST_FLOWING = 3
"""Fewest points of the bulk; the slip has the fourth that its own law would need."""

LEAST_SLIPPING = 4
"""Fewest points of the slip: one more than its law has parameters."""

CONTRADICTED = 0.01
"""Chance of the difference below which flow and slip have two yield stresses."""

SLIP_PARAMETERS = ("slip_coefficient", "newtonian_slip_coefficient")
"""Parameters of the slip law besides σ_y."""

AGREEMENT = "agreement"
"""Name of the chance that flow and slip have one yield stress."""


def _slip_problem(points: Points) -> Problem:
    """Return the fit of slip velocities: parameters σ_y, ν and ν_N."""

    def deviations(parameters: FloatArray) -> FloatArray:
        return np.asarray(
            (points.value - two_branches(points.abscissa, *parameters)) / points.error
        )

    return Problem(deviations, points.freedom, points.common)


def _slip_starts(points: Points, yield_stresses: list[float]) -> list[FloatArray]:
    """Return parameters to start from: the branches through the points at both ends."""
    low, high = points.abscissa[0], points.abscissa[-1]
    newtonian = float(points.value[0] / low)
    return [
        np.array([start, float(points.value[-1] / (high - start)), newtonian])
        for start in yield_stresses
        if start < high
    ]


def _both(flow: Problem, slip: Problem) -> Problem:
    """Return the fit of both: parameters σ_y, ln k, ln n, ν and ν_N."""

    def deviations(parameters: FloatArray) -> FloatArray:
        return np.concatenate(
            (flow.deviations(parameters[:3]), slip.deviations(parameters[[0, 3, 4]]))
        )

    freedom = np.concatenate((flow.freedom, slip.freedom))
    return Problem(deviations, freedom, flow.common + slip.common)


def _fit_both(flowing: Points, slipping: Points) -> Fit:
    """Fit σ_y, k, n, ν and ν_N; see `flow_and_slip`."""
    size, count = len(PARAMETERS) + len(SLIP_PARAMETERS), flowing.count + slipping.count
    for name, points, least in (
        ("bulk", flowing, LEAST_FLOWING),
        ("slip", slipping, LEAST_SLIPPING),
    ):
        different = len(np.unique(points.abscissa))
        if different < least:
            said = f"too few steady points of the {name}: at {different} stresses of at least"
            return nothing(size, count, f"{said} {least}")
    if not has_film(slipping.where(slipping.abscissa < flowing.abscissa.min())):
        return nothing(size, count, "the smoothest wall does not slip below yield")
    slipping, stress, speed = dimensionless(slipping)
    flowing = moderated(flowing)
    rate = float(np.abs(flowing.value).max())
    if rate == 0:
        return nothing(size, count, "no point flows")
    flowing = flowing.over(stress, rate)
    flow, slip, starts = flow_problem(flowing), _slip_problem(slipping), flow_starts(flowing)
    alone = (
        optimum(flow, starts),
        optimum(slip, _slip_starts(slipping, [float(start[0]) for start in starts])),
    )
    if alone[0] is None or alone[1] is None:
        return nothing(size, count, "no law is near")
    both = _both(flow, slip)
    found = optimum(both, _joined(alone[0], alone[1], starts))
    if found is None:
        return nothing(size, count, "no law is near")
    others = (speed / stress,) * len(SLIP_PARAMETERS)
    fit = flow_outcome(both, found, count, stress, rate, others)
    chance = _agreement(found, (flow, alone[0]), (slip, alone[1]))
    if chance < CONTRADICTED:
        said = f"flow and slip have different yield stresses: chance {chance:.2g} that they do not"
        fit = replace(fit, message=said)
    return replace(fit, more={AGREEMENT: chance})


def _agreement(
    together: Optimum, flow: tuple[Problem, Optimum], slip: tuple[Problem, Optimum]
) -> float:
    """Return the chance of the difference between the two yield stresses, if they are one.

    The root of the likelihood ratio is Student's, with the fewer degrees of freedom of the two.
    """
    excess = together.deviance - flow[1].deviance - slip[1].deviance
    freedom = min(freedom_along(*each, np.array([1.0, 0.0, 0.0])) for each in (flow, slip))
    return float(2 * stats.t.sf(np.sqrt(max(excess, 0.0)), freedom))


def _joined(flow: Optimum, slip: Optimum, starts: list[FloatArray]) -> list[FloatArray]:
    """Return parameters of both laws to start from, with the yield stress of either."""
    with_slip = [np.concatenate(([slip.values[0]], each[1:])) for each in (flow.values, *starts)]
    return [np.concatenate((each, slip.values[1:])) for each in (flow.values, *with_slip)]


def flow_and_slip(flow_curve: xr.Dataset) -> xr.Dataset:
    """Fit flow and slip with one yield stress, as the paper's laws have it.

    The bulk of all roughnesses follows σ = σ_y + k γ̇^n, and the slip at the smoothest wall the
    faster of two branches, V_s = max(ν_N σ, ν (σ − σ_y)): a film of solvent below yield, and
    fluidised layers of particles beside it above, with the exponent p = 1 that the paper finds.
    Slip settles long before the bulk does, and scatters less, so that it tells the yield stress of
    samples whose bulk takes too long to flow near it. All stresses enter at which each has a
    steady verdict, by maximum likelihood as in `herschel_bulkley`.

    That σ_y and p = 1 are shared is assumed. ``joint_agreement`` is the chance of a difference at
    least as large between the yield stresses that flow and slip have each by itself: below 1 %
    the message says that they differ.

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`, with a dimension ``stress``.

    Returns
    -------
    xr.Dataset
        For every combination of the dimensions other than stress and roughness, after ``joint_``:
        ``yield_stress``, ``consistency``, ``flow_index``, ``slip_coefficient`` and
        ``newtonian_slip_coefficient``, with ``_error`` and ``_interval``, ``covariance`` of the
        first three, ``reduced_chi_square``, ``points``, ``fit_message`` and ``agreement``.
    """
    averaged = with_stress(mean_over_seeds(flow_curve))
    pooled = (*DRIVES, "roughness")
    dims, flowing = points_of_cells(averaged, "shear_rate_bulk", "steady_bulk", pooled)
    smooth = averaged
    if "roughness" in averaged.dims:
        smooth = averaged.isel(roughness=int(np.argmin(averaged["roughness"].values)))
    _, slipping = points_of_cells(smooth, "slip_velocity", "steady_slip", pooled)
    imposed = "imposed_shear_rate" not in averaged.dims
    size = len(PARAMETERS) + len(SLIP_PARAMETERS)
    fits = {
        place: _fit_both(flowing[place], slipping[place])
        if imposed
        else nothing(
            size, flowing[place].count + slipping[place].count, "the stress is not imposed"
        )
        for place in flowing
    }
    names = (*PARAMETERS, *SLIP_PARAMETERS)
    result = laid_out(averaged, dims, fits, names, JOINT, "fit_message", JOINT)
    shape = tuple(averaged.sizes[dim] for dim in dims)
    chances = [fits[place].more.get(AGREEMENT, np.nan) for place in np.ndindex(*shape)]
    result[f"{JOINT}{AGREEMENT}"] = dims, np.reshape(chances, shape)
    return described(with_covariance(result, dims, fits, f"{JOINT}covariance"))


def yield_stress_of(
    flow: xr.Dataset, prefixes: tuple[str, ...] = (POOLED, JOINT)
) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the yield stress that laws are counted from, and its error; NaN where it is not known.

    Parameters
    ----------
    flow
        From `herschel_bulkley` and `flow_and_slip`.
    prefixes
        Beginnings of the names of the fits that it may be of: the first that determines it.
    """
    found: list[xr.DataArray] = []
    for name in ("yield_stress", "yield_stress_error"):
        each = [flow[p + name].where(flow[f"{p}fit_message"] == FITTED) for p in prefixes]
        known = each[0]
        for other in each[1:]:
            known = known.fillna(other)
        found.append(known)
    return found[0], found[1]


def law_in_use(fits: xr.Dataset) -> str:
    """Return the beginning of the names of the flow law that is shown: `POOLED` or `JOINT`.

    Parameters
    ----------
    fits
        Of one combination of the dimensions other than roughness.
    """
    messages = [str(fits[f"{prefix}fit_message"].item()) for prefix in (POOLED, JOINT)]
    return JOINT if messages[0] != FITTED and messages[1] == FITTED else POOLED
