"""Where the transient of a series ends: the marginal standard error rule (MSER)."""

import numpy as np

from softslip.analysis.observables.correlation import ROUNDING, correlation_time
from softslip.analysis.observables.series import FloatArray

LEAST_BATCHES = 20
"""Fewest batches between whose ends a transient is cut."""

AGREEMENT = 3.0
"""Standard errors within which what is cut off agrees with what is kept."""


def batch_length(values: FloatArray) -> int:
    """Return the autocorrelation time of the last half, at most a twentieth of the series."""
    time = correlation_time(values[len(values) // 2 :])
    return max(min(round(time), len(values) // LEAST_BATCHES), 1)


def truncation(values: FloatArray, length: int) -> int:
    """Return how many values to cut off by the marginal standard error rule, MSER-m.

    The values are averaged in batches of m, counted from the end; wanted is the number of batches
    d <= n/2 that minimises Σ_{i >= d} (x_i − mean_d)² / (n − d)² (K. P. White, *Simulation* 69,
    323, 1997). Batches as long as the correlation keep the rule from cutting where a slow
    fluctuation happens to end. A scatter of the size of rounding counts as that size, so that a
    constant series is kept whole.

    Parameters
    ----------
    values
        An equally spaced series.
    length
        Length m of a batch.
    """
    count = len(values) // length
    if count < 2:
        return 0
    left = len(values) - count * length
    batches = values[left:].reshape(count, length).mean(axis=1)
    keep = np.arange(count, count - count // 2 - 1, -1)
    centred = batches - batches.mean()
    first = np.cumsum(centred[::-1])[keep - 1]
    second = np.cumsum(centred[::-1] ** 2)[keep - 1]
    rounding = keep * (ROUNDING * np.abs(values).max()) ** 2
    best = int(np.argmin(np.maximum(second - first**2 / keep, rounding) / keep**2))
    return left + best * length if best else 0


def steady_start(values: FloatArray) -> int:
    """Return where the window of averages starts: the first value that belongs to no transient.

    `truncation` also cuts series without any transient, wherever that makes them look quieter than
    they are, so that the errors of strongly correlated series come out too small. The cut is
    therefore moved back, batch by batch, as long as the mean of what was cut behind it is within
    three standard errors of the window's mean. Both have the variance of the window, by the number
    of autocorrelation times in them.
    """
    length = batch_length(values)
    first = truncation(values, length)
    window = values[first:]
    if not first or len(window) < LEAST_BATCHES:
        return first
    variance, time = float(window.var(ddof=1)), correlation_time(window)
    start = first
    for candidate in range(first - length, -1, -length):
        spread = variance * (min(time / (first - candidate), 1.0) + time / len(window))
        apart = float(values[candidate:first].mean() - window.mean())
        if abs(apart) > AGREEMENT * np.sqrt(spread):
            break
        start = candidate
    return start if start >= length else 0
