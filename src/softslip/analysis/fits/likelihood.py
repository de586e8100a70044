"""Maximum likelihood with Student's errors, and intervals from its profiles."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special, stats

from softslip.analysis.observables.series import FloatArray

CONFIDENCE = (0.68, 0.95)
"""Confidence of the intervals."""

MOST_FREEDOM = 1e6
"""Degrees of freedom from which an error is taken as exactly known."""

SCATTER = 0.01
"""Chance of the deviance below which intervals are widened by the scatter of the points."""

HOPELESS = 1e-4
"""Chance of the deviance below which a law does not describe the points."""

DOUBLINGS = 12
"""Most doublings of the distance in which the end of an interval is looked for."""

LOOKED_AT = 2.0 ** np.arange(-1.0, 2.25, 0.5)
"""Distances at which a deviance with several minima is looked at, over the expected one."""

PRECISION = 1e-2
"""Precision of the end of an interval, relative to its distance from the estimate."""

DIFFERENCE = 1e-3
"""Step of a difference quotient, over the standard error of its parameter."""

Deviations = Callable[[FloatArray], FloatArray]
"""From parameters to the deviations of points from a law, over their errors, shape (points,)."""


@dataclass(frozen=True)
class Problem:
    """Points, and a law with parameters that are free numbers of order one.

    Attributes
    ----------
    deviations
        Of the points from the law, over their errors.
    freedom
        Degrees of freedom of the errors, shape (points,).
    common
        Degrees of freedom by which the errors of all points are known together.
    """

    deviations: Deviations
    freedom: FloatArray
    common: float = MOST_FREEDOM

    def roots(self, parameters: FloatArray) -> FloatArray:
        """Return numbers whose squares add up to the deviance, −2 ln of the likelihood ratio.

        A point of deviation z whose error has ν degrees of freedom adds (ν + 1) ln(1 + z²/ν) to it,
        which is z² for an error that is known.
        """
        z = self.deviations(parameters)
        freedom = np.minimum(self.freedom, MOST_FREEDOM)
        return np.asarray(np.sign(z) * np.sqrt((freedom + 1) * np.log1p(z**2 / freedom)))

    def expected(self, parameters: int) -> tuple[float, float]:
        """Return mean and variance of the deviance at the optimum of so many parameters."""
        freedom = np.minimum(self.freedom, MOST_FREEDOM)
        half, more = 0.5 * freedom, 0.5 * (freedom + 1)
        mean = (freedom + 1) * (special.digamma(more) - special.digamma(half))
        variance = (freedom + 1) ** 2 * (special.polygamma(1, half) - special.polygamma(1, more))
        share = (len(freedom) - parameters) / len(freedom)
        return float(mean.sum() * share), float(variance.sum() * share)


@dataclass(frozen=True)
class Optimum:
    """The most likely parameters.

    Attributes
    ----------
    values
        Of the parameters, shape (p,).
    covariance
        Inverse curvature of half the deviance there, shape (p, p); infinite where it is flat.
    deviance
        At these values.
    """

    values: FloatArray
    covariance: FloatArray
    deviance: float


def optimum(problem: Problem, starts: list[FloatArray]) -> Optimum | None:
    """Return the most likely parameters (`scipy.optimize.leastsq`), None where none are.

    Parameters
    ----------
    problem
        What to fit.
    starts
        Where to start from; the best end is taken.
    """
    ends = [end for end in (_descended(problem, start) for start in starts) if end is not None]
    return min(ends, key=lambda end: end.deviance, default=None)


def _descended(problem: Problem, start: FloatArray) -> Optimum | None:
    """Return the next minimum of the deviance downhill, None where that is no number."""
    if len(start) > len(problem.freedom):
        return None
    with np.errstate(all="ignore"), warnings.catch_warnings():
        # A flat minimum is told by its covariance.
        warnings.simplefilter("ignore")
        values, covariance, info, _, _ = optimize.leastsq(
            problem.roots, start, full_output=True, xtol=1e-8, ftol=1e-8, maxfev=400
        )
    deviance = float(info["fvec"] @ info["fvec"])
    if not np.isfinite(deviance):
        return None
    size = len(start)
    if covariance is None or not np.isfinite(covariance).all() or np.diag(covariance).min() <= 0:
        covariance = np.full((size, size), np.inf)
    return Optimum(np.asarray(values), np.asarray(covariance), deviance)


@dataclass(frozen=True)
class Quality:
    """How well a law describes the points.

    Attributes
    ----------
    reduced_chi_square
        Deviance over the one expected.
    chance
        Of a deviance at least as large if the law and the errors are right.
    """

    reduced_chi_square: float
    chance: float

    @property
    def widening(self) -> float:
        """By how much the square of an error is enlarged: where points scatter too much."""
        return max(self.reduced_chi_square, 1.0) if self.chance < SCATTER else 1.0


def quality(problem: Problem, found: Optimum) -> Quality:
    """Return how well a law describes the points, by the two moments of the deviance."""
    mean, variance = problem.expected(len(found.values))
    if mean <= 0:
        return Quality(float("nan"), 1.0)
    chance = stats.gamma.sf(found.deviance, mean**2 / variance, scale=variance / mean)
    return Quality(found.deviance / mean, float(chance))


def freedom_along(problem: Problem, found: Optimum, direction: FloatArray) -> float:
    """Return the degrees of freedom of the error of a combination of parameters.

    Each point adds a share to its variance; the shares' freedoms go together as by F. E.
    Satterthwaite (*Biometrics Bull.* 2, 110, 1946).

    Parameters
    ----------
    problem, found
        What was fitted, and the outcome.
    direction
        Coefficients of the combination.
    """
    if not np.isfinite(found.covariance).all():
        return MOST_FREEDOM
    steps = DIFFERENCE * np.sqrt(np.diag(found.covariance))
    with np.errstate(all="ignore"):
        slopes = [
            (problem.deviations(found.values + step) - problem.deviations(found.values - step)) / 2
            for step in np.diag(steps)
        ]
        weights = found.covariance @ direction / steps
        powers = (weights @ np.array(slopes)) ** 2
        total = float(powers.sum())
    if not (np.isfinite(total) and total > 0):
        return MOST_FREEDOM
    freedom = np.minimum(problem.freedom, MOST_FREEDOM)
    return float(1 / np.sum((powers / total) ** 2 / freedom))


def _height(problem: Problem, found: Optimum, direction: FloatArray, confidence: float) -> float:
    """Return by how much the deviance at the ends of an interval exceeds the least.

    It is the squared quantile of Student's distribution with the degrees of freedom of all errors
    together; but where few points determine the combination, what makes the interval of one such
    point Student's with its own degrees of freedom.
    """
    quantile = 0.5 * (1 + confidence)
    own = freedom_along(problem, found, direction)
    alone = (own + 1) * np.log1p(stats.t.ppf(quantile, own) ** 2 / own)
    return float(max(stats.t.ppf(quantile, problem.common) ** 2, alone))


def profile_interval(
    problem: Problem,
    found: Optimum,
    direction: FloatArray,
    confidence: float,
    widening: float,
    starts: Sequence[FloatArray] = (),
) -> tuple[float, float]:
    """Return the ends of the interval of a linear combination of the parameters.

    Its ends are where the least deviance at that value of the combination, over all other
    parameters, exceeds the least of all by the quantile of χ² of one degree of freedom (S. S.
    Wilks, *Ann. Math. Stat.* 9, 60, 1938), or more where errors are not exactly known (`_height`).
    Where the deviance has several minima it may do so more than once: the interval has the
    outermost ends that are seen. An end that is not found within thousands of errors is infinite:
    the points do not tell.

    Parameters
    ----------
    problem, found
        What was fitted, and the outcome.
    direction
        Coefficients of the combination; its largest one tells which parameter it stands for.
    confidence
        Such as 0.95.
    widening
        Factor on the quantile, such as that of `Quality`.
    starts
        Parameters that the others are looked for from too, besides where they were last: where
        the deviance has several minima, the least of which counts.
    """
    height = _height(problem, found, direction, confidence) * widening
    known = bool(np.isfinite(found.covariance).all())
    step = float(np.sqrt(height * (direction @ found.covariance @ direction))) if known else 1.0
    at = float(direction @ found.values)
    own = int(np.argmax(np.abs(direction)))
    others = [number for number in range(len(direction)) if number != own]

    def completed(value: float, free: FloatArray) -> FloatArray:
        parameters = np.empty(len(direction))
        parameters[others] = free
        parameters[own] = (value - direction[others] @ free) / direction[own]
        return parameters

    def side(sign: float) -> float:
        """Return how far the end on one side is from the estimate."""
        known: dict[float, float] = {0.0: -height}
        last = found.values[others]

        def excess(distance: float) -> float:
            nonlocal last
            if distance not in known:
                value = at + sign * distance
                tried = [last, *(start[others] for start in starts)]
                least, last = _least(problem, lambda free: completed(value, free), tried)
                known[distance] = min(least - found.deviance - height, 1e3 * height)
            return known[distance]

        near, far = 0.0, step
        for _ in range(DOUBLINGS):
            places = far * LOOKED_AT if starts else np.array([far])
            near = max([each for each in places if excess(each) < 0], default=near)
            beyond = places[places > near]
            if len(beyond):
                return float(optimize.brentq(excess, near, beyond[0], xtol=PRECISION * beyond[0]))
            far = 2 * far
        return float("inf")

    return at - side(-1.0), at + side(1.0)


def _least(
    problem: Problem, completed: Callable[[FloatArray], FloatArray], starts: list[FloatArray]
) -> tuple[float, FloatArray]:
    """Return the least deviance over the free parameters, and where it is."""
    if not len(starts[0]):
        roots = problem.roots(completed(starts[0]))
        return float(roots @ roots), starts[0]
    inner = Problem(lambda values: problem.deviations(completed(values)), problem.freedom)
    best = optimum(inner, starts)
    return (np.inf, starts[0]) if best is None else (best.deviance, best.values)
