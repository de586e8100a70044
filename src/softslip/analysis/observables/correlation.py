"""Correlated series: their autocorrelation time, the error of their mean, and their trend."""

from dataclasses import dataclass

import numpy as np
import scipy
import xarray as xr

from softslip.analysis.observables.series import FloatArray

SOKAL_WINDOW = 5.0
"""Autocorrelation times after which the autocorrelation is summed no further (Sokal 1997)."""

REFINEMENTS = 3
"""Rounds in which the autocorrelation that the removed mean took away is put back."""

TIMES_PER_COSINE = 4.0
"""Autocorrelation times of a series for each cosine by which its slow fluctuation is measured."""

MOST_COSINES = 30
"""Most cosines: more would hardly narrow an interval."""

ROUNDING = 1e-9
"""Scatter below which a series is constant, relative to its largest value."""


@dataclass(frozen=True)
class MeanEstimate:
    """A number measured in a correlated series.

    Attributes
    ----------
    value
        The number.
    error
        Its standard error.
    freedom
        Degrees of freedom of the error: an interval of confidence is value ± t error, with the
        quantile t of Student's distribution.
    """

    value: float
    error: float
    freedom: float

    @property
    def chance(self) -> float:
        """Probability of a number at least as far from zero if the true one is zero."""
        if self.error == 0:
            return 1.0 if self.value == 0 else 0.0
        return float(2 * scipy.stats.t.sf(abs(self.value) / self.error, self.freedom))


def estimate_named(dataset: xr.Dataset, name: str) -> MeanEstimate:
    """Return a number of a dataset with its ``_error`` and ``_freedom``; NaN where it has none."""
    endings = ("", "_error", "_freedom")
    return MeanEstimate(*(float(dataset.get(f"{name}{end}", np.nan)) for end in endings))


def constant(values: FloatArray) -> bool:
    """Tell whether a series scatters by no more than rounding."""
    return bool(np.ptp(values) <= ROUNDING * np.abs(values).max(initial=0.0))


def _residual(values: FloatArray, removed: int) -> FloatArray:
    """Return a series less its mean (``removed`` 1) or less a straight line (2)."""
    if removed == 1:
        return np.asarray(values - values.mean())
    time = np.arange(len(values)) - 0.5 * (len(values) - 1)
    slope = (time @ values) / (time @ time)
    return np.asarray(values - values.mean() - slope * time)


def correlation_time(values: FloatArray, removed: int = 1) -> float:
    """Return the integrated autocorrelation time, τ = 1 + 2 Σ ρ(k), of an equally spaced series.

    The sum ends at the first lag that exceeds 5 τ (A. D. Sokal, in *Functional Integration*, 1997,
    Eq. 3.18). What the removal of the mean, or of a straight line, takes from ρ, about τ/n each, is
    put back with the τ found before.

    Parameters
    ----------
    values
        Shape (n,).
    removed
        What is removed first: 1 the mean, 2 a straight line.

    Returns
    -------
    float
        In units of the spacing, from 1 to n; 1 for a constant series.
    """
    count = len(values)
    residual = _residual(values, removed)
    if count < 3 or constant(values):
        return 1.0
    modes = np.fft.rfft(residual, 2 * count)
    lags = np.arange(1, count)
    measured = np.fft.irfft(np.abs(modes) ** 2)[:count] / np.arange(count, 0, -1)
    time, variance = 0.0, float(measured[0])
    for _ in range(REFINEMENTS):
        corrected = measured + removed * time / count * variance
        variance = float(corrected[0])
        if variance <= 0:
            return 1.0
        times = 1.0 + 2.0 * np.cumsum(corrected[1:] / variance)
        far = np.flatnonzero(lags >= SOKAL_WINDOW * times)
        time = max(float(times[far[0] if len(far) else -1]), 1.0)
    return min(time, float(count))


def _cosines(count: int, time: float) -> int:
    """Return by how many cosines the slow fluctuation of a series is measured."""
    return int(np.clip(count / (TIMES_PER_COSINE * time), 1, MOST_COSINES))


def mean_of(values: FloatArray) -> MeanEstimate:
    """Return the mean of a correlated series with its standard error.

    The error is measured by the slowest cosines Λ_j = √(2/n) Σ (x_i − x̄) cos(π j (i + ½)/n) of the
    series, j = 1 … B: the variance of the mean is Σ Λ_j²/(B n), and (x̄ − truth)/error follows
    Student's distribution of B degrees of freedom (U. K. Müller, *J. Econometrics* 141, 1331,
    2007; E. Lazarus et al., *J. Bus. Econ. Stat.* 36, 541, 2018). B = n/(4 τ), at least 1 and at
    most 30, with τ of `correlation_time`: these cosines are slower than the correlation, so that
    they fluctuate as the mean does, where the means of as many batches would still be correlated.
    """
    count = len(values)
    mean = float(values.mean()) if count else float("nan")
    if count < 2:
        return MeanEstimate(mean, float("nan"), 0.0)
    if constant(values):
        return MeanEstimate(mean, 0.0, float(MOST_COSINES))
    number = _cosines(count, correlation_time(values))
    phase = np.pi * np.outer(np.arange(1, number + 1), np.arange(count) + 0.5) / count
    parts = np.sqrt(2.0 / count) * np.cos(phase) @ (values - mean)
    return MeanEstimate(mean, float(np.sqrt(np.mean(parts**2) / count)), float(number))


def change_of(values: FloatArray) -> MeanEstimate:
    """Return the linear change of a correlated series over its length, with its standard error.

    As `mean_of`, with a straight line removed and with cosines that are made orthogonal to it: the
    error is that of a least-squares slope in noise as correlated as the series.
    """
    count = len(values)
    if count < 4:
        return MeanEstimate(
            float(values[-1] - values[0]) if count else float("nan"), float("nan"), 0.0
        )
    time = (np.arange(count) + 0.5) / count - 0.5
    change = float((time @ values) / (time @ time))
    if constant(_residual(values, 2) + values.mean()):
        return MeanEstimate(0.0 if constant(values) else change, 0.0, float(MOST_COSINES))
    number = min(_cosines(count, correlation_time(values, removed=2)), count - 3)
    phase = np.pi * np.outer(np.arange(2, number + 2), time + 0.5)
    basis, _ = np.linalg.qr(np.vstack((np.ones(count), time, np.cos(phase))).T)
    parts = basis[:, 2:].T @ values
    error = np.sqrt(np.mean(parts**2) / (time @ time))
    return MeanEstimate(change, float(error), float(number))
