"""When the bulk yields and when slip sets in (Sec. IV C)."""

from collections.abc import Callable

import numpy as np
import scipy
import xarray as xr

from softslip.analysis.observables.correlation import MeanEstimate, estimate_named
from softslip.analysis.observables.series import FloatArray
from softslip.analysis.observables.slip_lengths import KNOWN_RATE
from softslip.analysis.observables.smoothed_series import (
    SMOOTHING_WIDTH,
    NoisySeries,
    noisy_series,
    sharp,
)
from softslip.analysis.observables.steady import steady_state
from softslip.files.quantities import described

SIGNIFICANCE = 0.01
"""Chance of a minimum as deep in the noise of a series without one."""

FROM_ZERO = 0.05
"""Level of the two-sided t-test by which a steady slip is told from zero."""

OTHER_WIDTHS = (0.5 * SMOOTHING_WIDTH, 2.0 * SMOOTHING_WIDTH)
"""Widths of the window by which the sensitivity of a time to smoothing is found [decades]."""

CENTRAL = 0.9
"""Share of the draws of a time whose range is that of the same share of a normal distribution."""

NOTHING = (float("nan"), float("nan"))
"""Time and error where there is no such time."""


def _sensitivity(time: float, found: Callable[[float], float]) -> float:
    """Return by how much a time changes at most with half or twice the smoothing [time unit].

    Infinite where there is no such time with another smoothing, NaN where there is none at all.
    """
    if not np.isfinite(time):
        return float("nan")
    changes = [abs(found(width) - time) for width in OTHER_WIDTHS]
    return float("inf") if np.isnan(changes).any() else float(max(changes))


def _spread(times: FloatArray) -> float:
    """Return the standard deviation of a normal distribution with the range of most draws."""
    ends = np.nanquantile(times, [0.5 * (1 - CENTRAL), 0.5 * (1 + CENTRAL)])
    return float(ends[1] - ends[0]) / float(2 * scipy.stats.norm.ppf(0.5 * (1 + CENTRAL)))


def yielding_time(run: xr.Dataset) -> xr.Dataset:
    """Find the time τ_y of the minimum of the bulk shear rate (Fig. 8d).

    There is such a minimum if the bulk flows at last, at a rate above zero by two errors (over the
    steady window, or the last half of the run where it is not steady), and if that of the series
    smoothed with a Gaussian window in log time of 0.1 decades is deeper, relative to the lower of
    the highest rates before and after it, than in 99 of 100 random courses of the noise of a
    constant rate (`noisy_series`). Any noise has minima, in all of its decades of time together
    many; two standard errors on both sides of one, which were asked for before, are found in nine
    of ten series that are stationary.

    Its time is that of the minimum of the series smoothed with a window of fourth order of the same
    width: a Gaussian one displaces the minimum of a creep that gives way to flow by a twentieth of
    itself, as it falls slowly and rises fast.

    The error is that of the minima of random courses of the noise about the series as smoothed
    with twice the window (W. Härdle and J. S. Marron, *Ann. Stat.* 19, 778, 1991: about the series
    as smoothed with the same window they would be pinned to its own minimum), from the range of the
    logarithms of nine of ten of them, as that window displaces all by the same share; together with
    the change by the higher order, as much may be left of the displacement, and at least half a
    record.

    Returns
    -------
    xr.Dataset
        Scalars ``yielding_time``, ``yielding_time_error`` and ``yielding_time_smoothing`` (by how
        much half or twice the smoothing changes it; infinite where it is found with one only)
        [time unit], and the flag ``yielded``.
    """
    series = None
    if "shear_rate_bulk" in run:
        series = noisy_series(run, "shear_rate_bulk", _noise_from(run, "steady_bulk"), True)
    flows = series is not None and series.mean.value > KNOWN_RATE * series.mean.error
    time, error = _least(series) if series is not None and flows else NOTHING
    return described(
        xr.Dataset(
            {
                "yielding_time": time,
                "yielding_time_error": error,
                "yielding_time_smoothing": _sensitivity(
                    time, lambda width: np.nan if series is None else _least_at(series, width)
                ),
                "yielded": bool(np.isfinite(time)),
            }
        )
    )


def _noise_from(run: xr.Dataset, flag: str) -> float:
    """Return from when on noise is measured: the steady window, or the last half of the run."""
    steady = steady_state(run)
    return float(steady["steady_from"]) if bool(steady[flag]) else 0.5 * float(run["time"][-1])


def _least(series: NoisySeries) -> tuple[float, float]:
    """Return the time of the least rate and its error [time unit]; NaN if there is no minimum."""
    time = _least_at(series, SMOOTHING_WIDTH)
    if not np.isfinite(time):
        return NOTHING
    pilot = series.smoothed(2 * SMOOTHING_WIDTH)
    courses = pilot[:, None] + series.smoothed_noise(pilot, SMOOTHING_WIDTH, sharp)
    spread = time * _spread(np.log(_minimum(series.times, courses)))
    moved = time - _minimum_of(series, series.smoothed(SMOOTHING_WIDTH))
    error = float(np.hypot(spread, moved))
    return time, max(error, _half_record(series, time))


def _half_record(series: NoisySeries, time: float) -> float:
    """Return half the length of the record at a time [time unit]."""
    at = int(np.searchsorted(series.edges, time)) - 1
    return 0.5 * float(np.diff(series.edges)[at])


def _least_at(series: NoisySeries, width: float) -> float:
    """Return the time of the least rate by a window of some width [decades]; NaN if there is none.

    The window is Gaussian for whether there is one, and of fourth order for when.
    """
    smooth = series.smoothed(width)
    constant = 1.0 + series.smoothed_noise(np.ones_like(smooth), width)
    depth = float(_depths(smooth[:, None])[0])
    if not depth > np.quantile(_depths(constant), 1 - SIGNIFICANCE, method="higher"):
        return float("nan")
    return _minimum_of(series, series.smoothed(width, sharp))


def _minimum_of(series: NoisySeries, rates: FloatArray) -> float:
    """Return the time of the minimum of one course of rates along the series' records."""
    return float(_minimum(series.times, rates[:, None])[0])


def _depths(rates: FloatArray) -> FloatArray:
    """Return how deep the minima of rates are, shape (time, courses): 1 − minimum/shoulder.

    The shoulder is the lower one of the highest rates before and after; the depth is 0 where a
    rate is least at an end, infinite where no shoulder is above zero.
    """
    lowest = np.argmin(rates, axis=0)
    course = np.arange(rates.shape[1])
    before = np.maximum.accumulate(rates, axis=0)[lowest, course]
    after = np.maximum.accumulate(rates[::-1], axis=0)[::-1][lowest, course]
    shoulder = np.minimum(before, after)
    known = shoulder > 0
    return np.where(known, 1 - rates[lowest, course] / np.where(known, shoulder, 1.0), np.inf)


def _minimum(times: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the times of the minima of rates, shape (time, courses).

    Between records it is that of the parabola in log time through the least three.
    """
    lowest, course, at = np.argmin(rates, axis=0), np.arange(rates.shape[1]), np.log(times)
    if len(times) < 3:
        return np.asarray(times[lowest])
    middle = np.clip(lowest, 1, len(times) - 2)
    first = np.diff(rates, axis=0) / np.diff(at)[:, None]
    falls, rises = first[middle - 1, course], first[middle, course]
    bent = (rises - falls) / (at[middle + 1] - at[middle - 1])
    inside = (lowest == middle) & (bent > 0)
    vertex = 0.5 * (at[middle - 1] + at[middle]) - falls / (2 * np.where(inside, bent, 1.0))
    return np.asarray(np.exp(np.where(inside, vertex, at[lowest])))


def slip_time(run: xr.Dataset) -> xr.Dataset:
    """Find the time τ_s at which the slip velocity rises to half its steady value (Fig. 8e).

    The series is smoothed as for the yielding time, and crossings are interpolated in log time.
    Where it rises through half more than once, τ_s is the time of the step from no slip to the
    steady velocity V that is nearest to it by least squares: of the rises, that before which
    ∫ (V_s − V/2) dt is least. So neither the elastic jump of a suspension that is loaded at once,
    which may pass half within the first tenth of a time unit and falls back, nor a lull in a noisy
    steady state is taken for the onset.

    The error is that of the rises of random courses of its noise (`noisy_series`) to half of
    steady values that scatter by their own error, from the range of nine of ten of them. NaN if
    the slip velocity is not steady, or not above zero by a t-test at 5 %: noise about no slip
    rises to half of its mean as well; or if no such step is nearer than one at either end: a series
    that is above half from the start never rises to it.

    Returns
    -------
    xr.Dataset
        Scalars ``slip_time``, ``slip_time_error`` and ``slip_time_smoothing`` (as that of the
        yielding time) [time unit].
    """
    steady, series = steady_state(run), None
    slip = estimate_named(steady, "slip_velocity")
    if bool(steady["steady_slip"]) and slip.value > 0 and slip.chance < FROM_ZERO:
        series = noisy_series(run, "slip_velocity", float(steady["steady_from"]))
    time, error = NOTHING if series is None else _half_risen(series, slip)
    told = {
        "slip_time": time,
        "slip_time_error": error,
        "slip_time_smoothing": _sensitivity(
            time, lambda width: np.nan if series is None else _half_risen_at(series, slip, width)
        ),
    }
    return described(xr.Dataset(told))


def _half_risen_at(series: NoisySeries, slip: MeanEstimate, width: float) -> float:
    """Return when slip, smoothed by a window [decades], has risen to half; NaN if never."""
    smooth = series.smoothed(width)[:, None]
    return float(_rises(series, smooth, np.array([0.5 * slip.value]))[0])


def _half_risen(series: NoisySeries, slip: MeanEstimate) -> tuple[float, float]:
    """Return when slip has risen to half, and the error of that [time unit]; NaN if never."""
    time = _half_risen_at(series, slip, SMOOTHING_WIDTH)
    if not np.isfinite(time):
        return NOTHING
    smooth = series.smoothed(SMOOTHING_WIDTH)
    courses = smooth[:, None] + series.smoothed_noise(smooth, SMOOTHING_WIDTH)
    random = np.random.default_rng(np.random.SeedSequence(courses.shape))
    steady = slip.value + slip.error * random.standard_normal(courses.shape[1])
    return time, _spread(_rises(series, courses, np.asarray(0.5 * steady)))


def _rises(series: NoisySeries, values: FloatArray, levels: FloatArray) -> FloatArray:
    """Return when courses along a series, shape (time, courses), rise through their levels.

    That rise before which the integral of what is above the level is least; NaN where it is least
    at either end. Interpolated in log time.
    """
    gained = np.cumsum((values - levels) * np.diff(series.edges)[:, None], axis=0)
    last, course = np.argmin(gained, axis=0), np.arange(values.shape[1])
    rises = (gained[last, course] < 0) & (last < len(values) - 1)
    last = np.minimum(last, len(values) - 2)
    low, high = values[last, course], values[last + 1, course]
    share = np.where(rises, levels - low, 0.0) / np.where(rises, high - low, 1.0)
    times = series.times
    return np.where(rises, times[last] * (times[last + 1] / times[last]) ** share, np.nan)
