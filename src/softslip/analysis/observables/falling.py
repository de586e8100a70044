"""Whether a rate still falls as a power of time, as in creep."""

from itertools import pairwise

import numpy as np
import scipy

from softslip.analysis.observables.correlation import correlation_time, mean_of
from softslip.analysis.observables.series import FloatArray

SPAN = 30.0
"""Time at the end over that at the beginning of the stretch to which a power is fitted."""

STRETCHES_PER_DECADE = 8
"""Means per decade of time to which it is fitted."""

LEAST_STRETCHES = 5
"""Fewest means to which it is fitted."""

LATEST_END = 0.25
"""Share of a series that is fitted at least where its window begins earlier."""

DEPARTURE = 0.1
"""Relative departure from a power that a creep may have in itself."""

SIGNIFICANCE = 0.01
"""Level of the one-sided test on the exponent."""

AGREEMENT = 2.0
"""Standard errors by which the window may exceed the extrapolated power and still continue it."""


def falls_as_power(values: FloatArray, start: int) -> bool:
    """Tell whether a series goes on in its window as the power of time by which it fell before.

    A power a t^−α is fitted to logarithmically spaced means over the last decade and a half before
    the window (generalised least squares in logarithms; relative noise and correlation are those of
    the window, where means of neighbouring stretches are correlated as e^(−2Δt/τ)). The series
    falls as a power if α > 0 at the level of 1 % and the window's mean is no more than two
    standard errors above the mean of the extrapolated power. A series with means that are not
    positive is no power.

    Parameters
    ----------
    values
        Equal bins from time 0 on, shape (n,).
    start
        First bin of the window.
    """
    count = len(values)
    end = max(start, int(LATEST_END * count))
    window = values[end:]
    kept = mean_of(window)
    if count - end < LEAST_STRETCHES or kept.value <= 0 or not np.isfinite(kept.error):
        return False
    times, means, lengths = _stretches(values, end)
    if len(times) < LEAST_STRETCHES or means.min() <= 0:
        return False
    line = np.arange(len(window)) - 0.5 * (len(window) - 1)
    residual = window - kept.value - line * (line @ window) / (line @ line)
    noise = float(residual.std()) / kept.value
    covariance = _covariance(times, lengths, noise, correlation_time(window, removed=2))
    design = np.stack((np.ones_like(times), -np.log(times / end)), axis=1)
    weighted = np.linalg.solve(covariance, design)
    uncertainty = np.linalg.inv(design.T @ weighted)
    level, exponent = uncertainty @ (weighted.T @ np.log(means))
    if exponent <= scipy.stats.norm.isf(SIGNIFICANCE) * np.sqrt(uncertainty[1, 1]):
        return False
    later = (np.arange(end, count) + 0.5) / end
    expected = float(level + np.log(np.mean(later**-exponent)))
    slope = np.array([1.0, -float(np.mean(np.log(later)))])
    spread = slope @ uncertainty @ slope + (kept.error / kept.value) ** 2
    return bool(np.log(kept.value) < expected + AGREEMENT * np.sqrt(spread))


def _stretches(values: FloatArray, end: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the middle, mean and length of logarithmically spaced stretches up to a bin."""
    decades = np.log10(SPAN)
    edges = np.geomspace(end / SPAN, end, round(decades * STRETCHES_PER_DECADE) + 1)
    edges = np.unique(np.clip(np.round(edges), 1, end).astype(np.int64))
    pairs = list(pairwise(edges.tolist()))
    middles = np.array([0.5 * (first + last) for first, last in pairs])
    means = np.array([values[first:last].mean() for first, last in pairs])
    return middles, means, np.array([float(last - first) for first, last in pairs])


def _covariance(times: FloatArray, lengths: FloatArray, noise: float, time: float) -> FloatArray:
    """Return the covariance of the logarithms of means in noise that forgets within τ/2."""
    memory = max(0.5 * time, 1e-3)
    ratio = lengths / memory
    averaged = 2.0 / ratio * (1.0 - (1.0 - np.exp(-ratio)) / ratio)
    correlation = np.exp(-np.abs(times[:, None] - times[None, :]) / memory)
    np.fill_diagonal(correlation, 1.0)
    size = noise * np.sqrt(averaged)
    return np.asarray(
        size[:, None] * size[None, :] * correlation + DEPARTURE**2 * np.eye(len(times))
    )
