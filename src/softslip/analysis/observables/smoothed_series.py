"""Series smoothed in the logarithm of time, and what their noise can make of that."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
import xarray as xr

from softslip.analysis.observables.correlation import MeanEstimate, correlation_time, mean_of
from softslip.analysis.observables.series import (
    FloatArray,
    equal_bins,
    interval_means,
    record_edges,
)

SMOOTHING_WIDTH = 0.1
"""Standard deviation of the Gaussian smoothing window in log10 of time [decades]."""

LOCAL_WIDTH = 3.0
"""Width of the window in which noise is measured, over that of smoothing."""

LEAST_SHARE = 0.25
"""Share of the variance of noise that smoothing is taken to leave in the residuals at least. It
leaves less where the window is shorter than the memory of the noise, but there residuals are of
faster noise than that."""

LEAST_LEFT = 0.3
"""Share of the variance of a window that a straight line through it leaves at least."""

LEAST_BINS = 4
"""Fewest bins of a window that noise is measured in."""

DRAWS = 400
"""Random courses of the noise by which errors are found."""


Window = Callable[[FloatArray, float], FloatArray]
"""Weights of a smoothing, a row for each record, by the ends of records and a width [decades]."""


def gaussian(edges: FloatArray, width: float) -> FloatArray:
    """Return the Gaussian windows in log time, a row for each record, which add up to 1.

    Each record weighs as much as its share of the logarithmic time axis.
    """
    time = 0.5 * (edges[1:] + edges[:-1])
    distance = np.log10(time)[:, None] - np.log10(time)[None, :]
    weight = np.exp(-0.5 * (distance / width) ** 2) * (np.diff(edges) / time)[None, :]
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def sharp(edges: FloatArray, width: float) -> FloatArray:
    """Return windows of fourth order, 4/3 of a Gaussian less 1/3 of one of twice the width.

    They leave the curvature of a series in log time as it is, and so displace its minimum less.
    """
    return np.asarray((4.0 * gaussian(edges, width) - gaussian(edges, 2.0 * width)) / 3.0)


def _averaged(length: FloatArray | float) -> FloatArray:
    """Return the variance of means over such lengths [memory] of noise of variance 1.

    2/x (1 − (1 − e^−x)/x), of noise that is correlated as e^−x.
    """
    x = np.asarray(length, dtype=np.float64)
    return np.asarray(2.0 / x * (1.0 + np.expm1(-x) / x))


def _memory(time: float) -> float:
    """Return the memory of noise, whose means over bins have this autocorrelation time [bins]."""
    least = 1e-3

    def longer(memory: float) -> float:
        return 2.0 * memory / float(_averaged(1.0 / memory)) - time

    return least if longer(least) >= 0 else float(scipy.optimize.brentq(longer, least, time))


def _correlations(edges: FloatArray, memory: float) -> FloatArray:
    """Return the correlations of records, which are means of noise correlated as e^(−Δt/memory)."""
    time, length = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges) / memory
    factor = 0.5 * length + np.log(-np.expm1(-length)) - np.log(length)
    apart = np.abs(time[:, None] - time[None, :]) / memory
    size = np.sqrt(_averaged(length))
    # Below 0 between different records; of a record with itself it may be too large a power.
    power = np.minimum(factor[:, None] + factor[None, :] - apart, 0.0)
    found = np.exp(power) / np.outer(size, size)
    np.fill_diagonal(found, 1.0)
    return np.asarray(found)


@dataclass(frozen=True)
class NoisySeries:
    """A series along records, and random courses that its noise might have taken.

    Attributes
    ----------
    edges
        Ends of the records [time unit], shape (time + 1,).
    values
        Means over them, shape (time,).
    mean
        Mean over the window in which the noise was measured.
    noise
        Courses of the noise, over the size of the smoothed series, shape (time, draws).
    """

    edges: FloatArray
    values: FloatArray
    mean: MeanEstimate
    noise: FloatArray

    @property
    def times(self) -> FloatArray:
        """Middles of the records [time unit]."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))

    def smoothed(self, width: float, window: Window = gaussian) -> FloatArray:
        """Return the series smoothed by a window of some width [decades]."""
        return window(self.edges, width) @ self.values

    def smoothed_noise(
        self, base: FloatArray, width: float, window: Window = gaussian
    ) -> FloatArray:
        """Return what smoothing leaves of the noise of a series of the size of ``base``."""
        return np.asarray(window(self.edges, width) @ (np.abs(base)[:, None] * self.noise))


def noisy_series(
    run: xr.Dataset, name: str, start: float, quieter: bool = False
) -> NoisySeries | None:
    """Return a series with its noise; None where the window is too short, or its mean is 0.

    The noise is taken as relative to the series, as large and as correlated in time as about a
    straight line from ``start`` on. Noise that is slower than the window of smoothing cannot be
    told from the series itself where it has a course of its own.

    Where it may be quieter before, it is taken as no larger than the residuals about the smoothed
    series within three tenths of a decade, of which smoothing has removed what is slower than its
    window (at least a quarter is taken to be left). The residuals are those of a window of fourth
    order, which leaves no curvature in them.

    Parameters
    ----------
    run, name
        Whose series.
    start
        Begin of the window in which noise is measured [time unit].
    quieter
        Whether the noise may be quieter before, as that of a creep before it flows.
    """
    bins = equal_bins(run)
    bins = bins[bins >= start * (1 - 1e-9)]
    if len(bins) <= LEAST_BINS:
        return None
    window = interval_means(run, name, bins)
    mean = mean_of(window)
    if mean.value == 0:
        return None
    edges = record_edges(run)
    values = np.asarray(run[name].values, dtype=np.float64)
    time = correlation_time(window, removed=2)
    memory = _memory(time)
    width = float(bins[1] - bins[0])
    line = np.arange(len(window)) - 0.5 * (len(window) - 1)
    residual = window - mean.value - line * (line @ window) / (line @ line)
    left = max(1.0 - 2.0 * time / len(window), LEAST_LEFT) * (len(window) - 2)
    late = np.sqrt(residual @ residual / left / _averaged(1.0 / memory)) / abs(mean.value)
    late = late * np.sqrt(_averaged(np.diff(edges) / (memory * width)))
    correlations = _correlations(edges, memory * width)
    size = np.minimum(late, _local_noise(edges, values, correlations)) if quieter else late
    random = np.random.default_rng(np.random.SeedSequence((len(values), DRAWS)))
    root = np.linalg.cholesky(correlations + 1e-9 * np.eye(len(values)))
    noise = size[:, None] * (root @ random.standard_normal((len(values), DRAWS)))
    return NoisySeries(edges, values, mean, noise)


def _local_noise(edges: FloatArray, values: FloatArray, correlations: FloatArray) -> FloatArray:
    """Return the standard deviation of the noise about each record, over the smoothed series."""
    smooth = gaussian(edges, SMOOTHING_WIDTH) @ values
    removed = np.eye(len(values)) - sharp(edges, SMOOTHING_WIDTH)
    size = np.maximum(np.abs(smooth), np.finfo(np.float64).tiny)
    around = gaussian(edges, LOCAL_WIDTH * SMOOTHING_WIDTH)
    share = around @ ((removed @ correlations) * removed).sum(axis=1)
    power = around @ ((removed @ values) / size) ** 2
    return np.asarray(np.sqrt(power / np.maximum(share, LEAST_SHARE)))
