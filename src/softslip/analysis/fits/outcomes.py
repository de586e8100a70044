"""From the most likely parameters of a law to the outcome of a fit."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from softslip.analysis.fits.likelihood import (
    CONFIDENCE,
    HOPELESS,
    Optimum,
    Problem,
    optimum,
    profile_interval,
    quality,
)
from softslip.analysis.fits.measured_points import FloatArray
from softslip.analysis.fits.points import (
    FITTED,
    Fit,
    nothing,
)


@dataclass(frozen=True)
class LawToFit:
    """A law as it is fitted.

    Attributes
    ----------
    problem
        Points and deviations.
    starts
        Parameters to start from.
    units
        What each wanted parameter is multiplied with afterwards; those beyond are of no interest.
    names
        What each wanted parameter is called in messages.
    branched
        Whether the law is the faster of several: then there may be a minimum for each way in which
        the points can belong to them, at every value of a parameter.
    quantile_factors
        From the most likely parameters to factors on the quantiles of the intervals, one for each
        of `CONFIDENCE`; None where quantiles of χ² do.
    """

    problem: Problem
    starts: list[FloatArray]
    units: tuple[float, ...]
    names: tuple[str, ...]
    branched: bool = False
    quantile_factors: Callable[[FloatArray], FloatArray] | None = None


def fitted(law: LawToFit, points: int) -> Fit:
    """Return the outcome of a fit, or what the points do not determine.

    Parameters
    ----------
    law
        What to fit.
    points
        Number of points, for the outcome.
    """
    size = len(law.units)
    found = optimum(law.problem, law.starts)
    if found is None:
        return nothing(size, points, "no law is near the points")
    good = quality(law.problem, found)
    if good.chance < HOPELESS:
        said = f"the law does not describe the points: χ² is {good.reduced_chi_square:.3g} of 1"
        return replace(nothing(size, points, said), reduced_chi_square=good.reduced_chi_square)
    units = np.array(law.units)
    starts = law.starts if law.branched else []
    widening = np.full(len(CONFIDENCE), good.widening)
    if law.quantile_factors is not None:
        widening *= law.quantile_factors(found.values)
    ends = np.array(
        [
            [
                profile_interval(law.problem, found, row, c, wider, starts)
                for c, wider in zip(CONFIDENCE, widening, strict=True)
            ]
            for row in np.eye(len(found.values))[:size]
        ]
    )
    covariance = found.covariance[:size, :size] * np.outer(units, units) * good.widening
    unknown = [
        name
        for name, end, variance in zip(law.names, ends, np.diag(covariance), strict=True)
        if not (np.isfinite(end).all() and np.isfinite(variance))
    ]
    message = f"the points do not determine {' and '.join(unknown)}" if unknown else FITTED
    values, intervals = found.values[:size] * units, ends * units[:, None, None]
    chi = good.reduced_chi_square
    return Fit(values, covariance, intervals, chi, points, message)


def least_deviance(law: LawToFit) -> float:
    """Return the deviance at the most likely parameters, infinite where there are none."""
    found: Optimum | None = optimum(law.problem, law.starts)
    return np.inf if found is None else found.deviance
