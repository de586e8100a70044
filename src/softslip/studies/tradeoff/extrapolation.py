"""The limit of no regularisation, ε → 0, from members of several regularisation lengths.

A film of thickness h between two sheets of regularised forces slides as one of h - 2ε/√π would.
Rates that films limit are therefore linear in ε at first, with a curvature that grows with ε/h.
"""

from dataclasses import dataclass

import numpy as np

from softslip.solver.geometry import FloatArray

LARGEST = 1.0
"""Largest regularisation length over the paper's mesh size that is fitted: films are some 7 thick,
so that the next term is below (2ε/√π h)² = 3 %."""


@dataclass(frozen=True)
class Limit:
    """An extrapolation to ε = 0; arrays have the shape of one regularisation length's values.

    Attributes
    ----------
    value
        At ε = 0.
    uncertainty
        Difference from the fit of one degree less.
    slope
        dy/dε at ε = 0, ε over the paper's mesh size.
    residual
        Rms distance of the points from a straight line.
    """

    value: FloatArray
    uncertainty: FloatArray
    slope: FloatArray
    residual: FloatArray


def extrapolated(lengths: FloatArray, values: FloatArray) -> Limit:
    """Extrapolate values without statistical error to ε = 0.

    A parabola goes through the points of ε up to `LARGEST`, or a line where these are two. Its
    uncertainty is what one degree less, on all but the largest ε, gives instead; of a single point
    that is unknown (NaN).

    Parameters
    ----------
    lengths
        Regularisation lengths over the paper's mesh size, shape (points,).
    values
        Shape (points, ...).
    """
    order = np.argsort(lengths)
    order = order[lengths[order] <= LARGEST] if (lengths <= LARGEST).any() else order[:1]
    x, y = lengths[order], values[order].reshape(len(order), -1)
    shape = values.shape[1:]
    degree = min(2, len(x) - 1)
    fit = np.polynomial.polynomial.polyfit(x, y, degree)
    if degree == 0:
        unknown = np.full(shape, np.nan)
        return Limit(y[0].reshape(shape), unknown, unknown, unknown)
    lower = np.polynomial.polynomial.polyfit(x[:-1], y[:-1], degree - 1)
    line = np.polynomial.polynomial.polyfit(x, y, 1)
    apart = y - np.polynomial.polynomial.polyval(x, line).T
    return Limit(
        value=fit[0].reshape(shape),
        uncertainty=np.abs(fit[0] - lower[0]).reshape(shape),
        slope=fit[1].reshape(shape),
        residual=np.sqrt(np.mean(apart**2, axis=0)).reshape(shape),
    )


@dataclass(frozen=True)
class Line:
    """A straight line through values with statistical errors.

    Attributes
    ----------
    value, error
        At ε = 0, with its standard error.
    slope, slope_error
        And per ε over the paper's mesh size.
    chi_square
        Sum of the squared residuals over the errors, per degree of freedom; NaN of two points.
    """

    value: float
    error: float
    slope: float
    slope_error: float
    chi_square: float


def fitted(lengths: FloatArray, values: FloatArray, errors: FloatArray) -> Line:
    """Fit a line to values of ε up to `LARGEST`, weighted by their standard errors.

    Values or errors that are no numbers, and errors of zero, are left out; fewer than two points
    give NaN.

    Parameters
    ----------
    lengths, values, errors
        Shape (points,).
    """
    good = np.isfinite(values) & (errors > 0) & (lengths <= LARGEST)
    x, y, weights = lengths[good], values[good], errors[good] ** -2.0
    if len(x) < 2:
        return Line(*([float("nan")] * 5))
    total = weights.sum()
    middle, mean = weights @ x / total, weights @ y / total
    spread = weights @ (x - middle) ** 2
    slope = weights @ ((x - middle) * (y - mean)) / spread
    value = mean - slope * middle
    freedom = len(x) - 2
    residual = weights @ (y - value - slope * x) ** 2
    return Line(
        value=float(value),
        error=float(np.sqrt(1 / total + middle**2 / spread)),
        slope=float(slope),
        slope_error=float(spread**-0.5),
        chi_square=float(residual / freedom) if freedom else float("nan"),
    )
