"""The slip law of two branches, and how far its deviance scatters where it is true."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from softslip.analysis.fits.likelihood import CONFIDENCE
from softslip.analysis.fits.measured_points import FloatArray

DRAWS = 1000
"""Times that the points are drawn: a quantile of 95 % is then known to 0.7 %."""

ROUNDING = 1e-12
"""Difference of two branches, over the larger, that is taken for none."""


def two_branches(
    stress: FloatArray, onset: float, coefficient: float, newtonian: float
) -> FloatArray:
    """Return the slip velocity of the branch that slips faster, ν_N σ or ν (σ − σ')."""
    return np.asarray(np.maximum(newtonian * stress, coefficient * (stress - onset)))


def quantile_factors(stress: FloatArray, error: FloatArray, parameters: FloatArray) -> FloatArray:
    """Return by what the quantiles of χ² are too small for the stress at which slip begins.

    The law is V = max(ν_N σ, ν (σ − σ')). Which points belong to which branch is found along with
    the parameters, in steps, so that the deviance at the true σ' exceeds the least of all by more
    than χ² of one degree of freedom does. By how much depends on where the stresses are: the points
    are drawn again about the law as fitted (a parametric bootstrap: B. Efron and R. J. Tibshirani,
    *An Introduction to the Bootstrap*, 1993, Sec. 25). Each draw is fitted exactly: the least is
    that of least squares with the first points on one branch and the others on the other, or with
    the crossing at a point, whichever of these is such a law and is least.

    Parameters
    ----------
    stress, error
        Of the points, in ascending order, over some units, shape (points,).
    parameters
        σ', ν and ν_N over the same units.

    Returns
    -------
    FloatArray
        For each of `CONFIDENCE`, 1 at least.
    """
    onset, coefficient, newtonian = (float(each) for each in parameters)
    random = np.random.default_rng(np.random.SeedSequence((len(stress), DRAWS)))
    drawn = two_branches(stress, onset, coefficient, newtonian) / error
    drawn = drawn + random.standard_normal((DRAWS, len(stress)))
    excess = _least(drawn, stress, error, onset) - _least(drawn, stress, error)
    chances = np.array(CONFIDENCE)
    factors = np.quantile(excess, chances) / stats.chi2.ppf(chances, 1)
    return np.asarray(np.maximum(factors, 1.0))


def _least(
    drawn: FloatArray, stress: FloatArray, error: FloatArray, onset: float | None = None
) -> FloatArray:
    """Return the least deviances of all laws, or of those of which slip begins at one stress."""
    film = _squares(drawn, stress / error)[0]
    if onset is None:
        others = _free(drawn, stress, error)
    else:
        others = _at_onset(drawn, stress, error, onset)
    return np.asarray(np.min([film, *others], axis=0))


def _squares(drawn: FloatArray, *columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return least deviances (draws,) and coefficients (draws, columns) of least squares."""
    basis, triangle = np.linalg.qr(np.array(columns).T)
    along = drawn @ basis
    return (drawn**2).sum(axis=1) - (along**2).sum(axis=1), np.linalg.solve(triangle, along.T).T


def _apart(
    low: NDArray[np.bool_],
    stress: FloatArray,
    film: FloatArray,
    slope: FloatArray,
    level: FloatArray,
) -> NDArray[np.bool_]:
    """Tell of which draws each point is on the branch that slips faster there."""
    gap = slope[:, None] * stress + level[:, None] - film[:, None] * stress
    least = -ROUNDING * np.abs(film[:, None] * stress)
    return np.asarray((np.where(low, -gap, gap) >= least).all(axis=1))


def _free(drawn: FloatArray, stress: FloatArray, error: FloatArray) -> Iterator[FloatArray]:
    """Yield the deviances of all laws but the film alone, infinite where they are none."""
    for first in range(1, len(stress) - 1):
        low = np.arange(len(stress)) < first
        deviance, found = _squares(drawn, low * stress / error, ~low * stress / error, ~low / error)
        yield np.where(_apart(low, stress, *found.T), deviance, np.inf)
    for crossing in stress[:-1]:
        deviance, found = _squares(
            drawn, stress / error, np.maximum(stress - crossing, 0.0) / error
        )
        yield np.where(found[:, 1] >= 0, deviance, np.inf)


def _at_onset(
    drawn: FloatArray, stress: FloatArray, error: FloatArray, onset: float
) -> Iterator[FloatArray]:
    """Yield the same for laws of which slip begins at one stress."""
    for first in range(1, len(stress)):
        low = np.arange(len(stress)) < first
        deviance, found = _squares(drawn, low * stress / error, ~low * (stress - onset) / error)
        film, slope = found.T
        yield np.where(_apart(low, stress, film, slope, -slope * onset), deviance, np.inf)
    for crossing in stress[stress > onset]:
        # There ν (σ − σ') = ν_N σ.
        steeper = crossing / (crossing - onset)
        line = np.where(stress < crossing, stress, steeper * (stress - onset))
        deviance, found = _squares(drawn, line / error)
        yield np.where(found[:, 0] * (steeper - 1.0) >= 0, deviance, np.inf)
