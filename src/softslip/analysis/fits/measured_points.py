"""Measured points, whose errors are known from few samples each, and better from all together."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

FloatArray = NDArray[np.float64]

LEAST_POINTS = 2
"""Fewest points whose errors are looked at together."""

MOST_DEGREE = 2
"""Highest degree of the curve along which errors change with the abscissa, each with three places
of it."""

LARGEST_FREEDOM = 1e4
"""Degrees of freedom of a common error that no scatter contradicts."""


@dataclass(frozen=True)
class Points:
    """Measured values at places of an abscissa, all of shape (points,), sorted by it.

    Attributes
    ----------
    abscissa, abscissa_error
        The stress, imposed without error or measured [stress unit]; or a size of the channel,
        without error [length unit].
    value, error
        Measured, at any value: also at or below zero.
    freedom
        Degrees of freedom of the errors.
    common
        Degrees of freedom by which the errors of all of them are known together.
    """

    abscissa: FloatArray
    abscissa_error: FloatArray
    value: FloatArray
    error: FloatArray
    freedom: FloatArray
    common: float

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.abscissa)

    def where(self, chosen: NDArray[np.bool_]) -> "Points":
        """Return some of the points."""
        rows = ("abscissa", "abscissa_error", "value", "error", "freedom")
        kept = {name: getattr(self, name)[chosen] for name in rows}
        return replace(self, **kept, common=float(kept["freedom"].sum()))

    def over(self, abscissa: float, value: float) -> "Points":
        """Return the points over a unit of the abscissa and one of value."""
        return replace(
            self,
            abscissa=self.abscissa / abscissa,
            abscissa_error=self.abscissa_error / abscissa,
            value=self.value / value,
            error=self.error / value,
        )


def moderated(points: Points) -> Points:
    """Return points whose errors lean on those of the other points.

    The standard error over three seeds has two degrees of freedom; by chance it is a tenth of the
    true one for one point in a hundred, which would then rule a fit. The logarithms of the squared
    errors are taken as a parabola (with six places) or a straight line in the logarithm of the
    abscissa. They scatter about it by their own few degrees of freedom d, and by as much as errors
    truly differ, as a scaled inverse χ² of d₀ degrees of freedom. The squared error of each point
    is then (d₀ s₀² + d s²)/(d₀ + d), with d₀ + d degrees of freedom (G. K. Smyth, *Stat. Appl.
    Genet. Mol. Biol.* 3, 3, 2004), but no more than d/h, by which the curve is known there: h is
    the leverage of the point on it, 1 where the curve goes through the point. Errors that are well
    known stay as they are.

    Parameters
    ----------
    points
        At positive places, with positive errors.
    """
    if points.count < LEAST_POINTS:
        return points
    freedom = points.freedom
    logarithm = np.log(points.error**2) - special.digamma(freedom / 2) + np.log(freedom / 2)
    degree = min(MOST_DEGREE, len(np.unique(points.abscissa)) // 3)
    at = np.log(points.abscissa / points.abscissa.max())
    basis, _ = np.linalg.qr(np.vander(at, degree + 1))
    curve = basis @ (basis.T @ logarithm)
    scatter = float(np.sum((logarithm - curve) ** 2)) / (points.count - 1 - degree)
    prior = _freedom_of(scatter - float(np.mean(special.polygamma(1, freedom / 2))))
    typical = np.exp(curve + special.digamma(prior / 2) - np.log(prior / 2))
    total = prior + freedom
    error = np.sqrt((prior * typical + freedom * points.error**2) / total)
    # A curve that follows a point, as at its ends, tells little more than the point's own error.
    leverage = np.sum(basis**2, axis=1)
    known = np.maximum(np.minimum(total, freedom.mean() / leverage), freedom)
    # As many of the degrees of freedom as the curve leaves.
    left = points.common * (points.count - degree) / points.count
    common = left if prior == LARGEST_FREEDOM else points.common
    return replace(points, error=error, freedom=known, common=common)


def _freedom_of(excess: float) -> float:
    """Return the d₀ whose trigamma of d₀/2 is the excess of the scatter; none means very many."""
    if excess <= special.polygamma(1, LARGEST_FREEDOM / 2):
        return LARGEST_FREEDOM
    least = 1e-3
    if excess >= special.polygamma(1, least / 2):
        return least
    return float(
        optimize.brentq(
            lambda each: float(special.polygamma(1, each / 2)) - excess, least, LARGEST_FREEDOM
        )
    )


def dimensionless(
    points: Points, unit: Callable[[FloatArray], np.floating[Any]] = np.max
) -> tuple[Points, float, float]:
    """Return points in units of a place and a value, and these units; errors are moderated.

    Parameters
    ----------
    points
        Measured.
    unit
        Of all places, that of the abscissa. Values are in units of the largest value or error.
    """
    points = moderated(points)
    place = float(unit(points.abscissa))
    value = max(float(np.abs(points.value).max()), float(points.error.max()))
    return points.over(place, value), place, value
