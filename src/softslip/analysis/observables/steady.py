"""Steady states, decided by a test on the trend rather than by a look."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy import stats

from softslip.analysis.observables.series import (
    FloatArray,
    interval_means,
    parameters_of,
    record_edges,
)
from softslip.files.quantities import described

BATCHES = 10
"""Number of equal batches into which a window is cut."""

LEAST_BINS = 2 * BATCHES
"""Fewest equal bins, each as long as the longest record, in which a steady state is looked for."""

SIGNIFICANCE = 0.05
"""Level of the two-sided t-test on the trend."""

SMALL_DRIFT = 0.05
"""A relative change over the window that counts as steady even where it is significant."""

LARGE_DRIFT = 0.15
"""A relative change over the window that counts as unsteady even where it is insignificant."""

LARGEST_DRIFT_ERROR = 0.15
"""Standard error of the relative change above which a window is too short or noisy to tell."""

LATEST_START = 0.45
"""Share of the run beyond which a window's start says that the transient still lasts."""

ROUNDING = 1e-9
"""Relative scatter below which a series is constant."""

FLAGS = {
    "shear_rate_wall": "steady_wall",
    "shear_rate_bulk": "steady_bulk",
    "slip_velocity": "steady_slip",
}
"""Series whose steady state is looked for, and the name of each one's flag."""


@dataclass(frozen=True)
class Window:
    """The end of a series, from a point on, and the linear trend in it.

    Attributes
    ----------
    start
        First time of the window [time unit].
    mean
        Mean over the window.
    error
        Its standard error, from the scatter of the batch means.
    change
        Linear change over the window.
    drift
        That change relative to the scale of the series.
    drift_error
        Standard error of the drift.
    chance
        Probability of a trend at least as strong in a stationary series, from the t-test.
    bins
        Number of equal bins in the window.
    """

    start: float
    mean: float
    error: float
    change: float
    drift: float
    drift_error: float
    chance: float
    bins: int

    @property
    def steady(self) -> bool:
        """Whether the trend in this window is small, or cannot be told from none."""
        tellable = self.bins >= LEAST_BINS and self.drift_error <= LARGEST_DRIFT_ERROR
        small = abs(self.drift) <= SMALL_DRIFT
        insignificant = self.chance > SIGNIFICANCE and abs(self.drift) <= LARGE_DRIFT
        return tellable and (small or insignificant)


def _truncation(values: FloatArray) -> int:
    """Return the first bin to keep: the minimum of the marginal standard error (MSER).

    The d <= n/2 is wanted that minimises Σ_{i >= d} (x_i - mean_d)² / (n - d)². A scatter of the
    size of rounding counts as that size, so that a constant series is kept whole.
    """
    count = len(values)
    keep = np.arange(count, count - count // 2 - 1, -1)
    centred = values - values.mean()
    first = np.cumsum(centred[::-1])[keep - 1]
    second = np.cumsum(centred[::-1] ** 2)[keep - 1]
    rounding = keep * (ROUNDING * np.abs(values).max()) ** 2
    return int(np.argmin(np.maximum(second - first**2 / keep, rounding) / keep**2))


def _window(edges: FloatArray, values: FloatArray, scale: FloatArray) -> Window:
    """Measure mean and trend of equal bins; a drift is relative to the mean of ``scale``."""
    count = len(values)
    start, mean = float(edges[0]), float(values.mean())
    if count < LEAST_BINS:
        error = float(values.std(ddof=1) / np.sqrt(count)) if count > 1 else np.nan
        change = float(values[-1] - values[0])
        nan = float("nan")
        return Window(start, mean, error, change, _relative(change, scale), nan, nan, count)
    batches = np.array([batch.mean() for batch in np.array_split(values, BATCHES)])
    error = float(batches.std(ddof=1) / np.sqrt(BATCHES))
    if error == 0:
        return Window(start, mean, 0.0, 0.0, 0.0, 0.0, 1.0, count)
    trend = stats.linregress(np.arange(BATCHES) / BATCHES, batches)
    return Window(
        start=start,
        mean=mean,
        error=error,
        change=float(trend.slope),
        drift=_relative(float(trend.slope), scale),
        drift_error=abs(_relative(float(trend.stderr), scale)),
        chance=float(trend.pvalue),
        bins=count,
    )


def _relative(change: float, scale: FloatArray) -> float:
    size = abs(float(scale.mean()))
    return change / size if size > 0 else (0.0 if change == 0 else float("inf"))


def _bin_edges(run: xr.Dataset) -> FloatArray:
    """Cut a run into equal bins that end with it, none shorter than a record."""
    known = record_edges(run)
    width = float(np.diff(known).max())
    count = max(int((known[-1] - known[0]) / width + 1e-9), 1)
    edges = known[-1] - width * np.arange(count, -1, -1)
    return np.asarray(np.maximum(edges, known[0]))


def _from(run: xr.Dataset, name: str, edges: FloatArray) -> Window:
    """Measure a series of a run from the first edge on."""
    values = interval_means(run, name, edges)
    if name != "slip_velocity":
        return _window(edges, values, values)
    half_speed = 0.5 * parameters_of(run).channel.height
    return _window(edges, values, half_speed * interval_means(run, "shear_rate_wall", edges))


def steady_state(run: xr.Dataset) -> xr.Dataset:
    """Average a shear run over its steady state, and say whether it has one.

    For each of shear_rate_wall, shear_rate_bulk and slip_velocity:

    1. The records are averaged into equal bins, as long as the longest record.
    2. The window starts where the marginal standard error (MSER) is least, in the first half.
    3. A straight line is fitted to the means of 10 equal batches of the window. The drift is
       its change over the window relative to the mean; for the slip velocity relative to half
       the relative speed of the walls, of which slip is a part.
    4. The series is steady if the window has at least 20 bins and starts before 45 % of the run
       (a transient drives its start to the limit), if the standard error of the drift is at most
       15 %, and if the drift is below 5 %, or is insignificant (t-test, 5 %) and below 15 %.

    Steady series share one window, from the latest of their starting points to the end, so that
    γ̇_wall = γ̇_bulk + 2 V_s/H (Eq. A1) holds for their means. A series that is not steady is
    averaged over the last half, and its error is half its linear change there or the standard
    error, whichever is larger: the bar spans the drift.

    Error rates measured on series of 400 bins with 10 % of noise whose correlation decays in 2,
    5 or 10 bins: 4, 6 and 6 % of stationary series are called unsteady; of power-law creep t^-0.5
    none is called steady, and 2, 4 and 12 % of exponential relaxations that start from twice
    their final value and take half of the run. With 20 % of noise it is 6, 18 and 39 %; 1, 1 and
    3 %; 10, 14 and 14 %: noise makes the test refuse.

    Parameters
    ----------
    run
        A shear run.

    Returns
    -------
    xr.Dataset
        Scalars: ``<name>``, ``<name>_error`` and ``<name>_drift`` of each series (NaN where the
        run has no bulk observables), the flags steady_wall, steady_bulk and steady_slip,
        ``steady`` (wall and, where there is one, bulk), ``steady_from`` (start of the shared
        window; of the last half where nothing is steady) [time unit], ``drift`` (the largest in
        size of wall and bulk), and ``shear_stress`` with its error over the same window.

    Raises
    ------
    DatasetError
        When the run has no records, or its parameters cannot be read.
    """
    edges = _bin_edges(run)
    windows = {name: _series_window(run, name, edges) for name in FLAGS if name in run}
    latest = float(edges[0] + LATEST_START * (edges[-1] - edges[0]))
    steady = {name: each.steady and each.start < latest for name, each in windows.items()}
    half = float(edges[(len(edges) - 1) // 2])
    start = max((windows[name].start for name in windows if steady[name]), default=half)
    found: dict[str, float | bool] = {}
    for name, flag in FLAGS.items():
        first = start if steady.get(name, False) else half
        last = _from(run, name, edges[edges >= first]) if name in run else None
        found |= _estimates(name, last, steady.get(name, False))
        found[flag] = steady.get(name, False)
    stress = _from(run, "stress", edges[edges >= start])
    judged = [name for name in ("shear_rate_wall", "shear_rate_bulk") if name in windows]
    found |= {
        "steady": all(steady[name] for name in judged),
        "steady_from": start,
        "drift": max((found[f"{name}_drift"] for name in judged), key=abs),
        "shear_stress": stress.mean,
        "shear_stress_error": stress.error,
    }
    return described(xr.Dataset(found))


def _series_window(run: xr.Dataset, name: str, edges: FloatArray) -> Window:
    return _from(run, name, edges[_truncation(interval_means(run, name, edges)) :])


def _estimates(name: str, window: Window | None, steady: bool) -> dict[str, float]:
    if window is None:
        mean = error = drift = float("nan")
    else:
        mean, error, drift = window.mean, window.error, window.drift
        if not steady:
            error = float(np.fmax(error, 0.5 * abs(window.change)))
    return {name: mean, f"{name}_error": error, f"{name}_drift": drift}
