"""When the bulk yields and when slip sets in (Sec. IV C)."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from softslip.analysis.observables.series import (
    SMOOTHING_WIDTH,
    FloatArray,
    smooth_in_log_time,
)
from softslip.analysis.observables.steady import steady_state
from softslip.files.quantities import described

RECOVERY = 2.0
"""Standard errors by which a series must exceed its minimum on both sides of it."""

OTHER_WIDTHS = (0.5 * SMOOTHING_WIDTH, 2.0 * SMOOTHING_WIDTH)
"""Widths of the window by which the sensitivity of a time to smoothing is found [decades]."""


def _sensitivity(time: float, found: Callable[[float], tuple[float, float]]) -> float:
    """Return by how much a time changes at most with half or twice the smoothing [time unit].

    Infinite where there is no such time with another smoothing, NaN where there is none at all.
    """
    if not np.isfinite(time):
        return float("nan")
    changes = [abs(found(width)[0] - time) for width in OTHER_WIDTHS]
    return float("inf") if np.isnan(changes).any() else float(max(changes))


def yielding_time(run: xr.Dataset) -> xr.Dataset:
    """Find the time τ_y of the minimum of the bulk shear rate (Fig. 8d).

    The series is smoothed with a Gaussian window in log time of 0.1 decades
    (`smooth_in_log_time`). The minimum counts only if the smoothed series exceeds it on both
    sides by twice the standard error, so that a minimum at an end, or in the noise of a creep,
    gives NaN. The uncertainty is half the time during which the smoothed series stays within one
    standard error of its minimum, and at least half a record.

    Returns
    -------
    xr.Dataset
        Scalars ``yielding_time``, ``yielding_time_error`` and ``yielding_time_smoothing`` (by how
        much half or twice the smoothing changes it; infinite where it is found with one only)
        [time unit], and the flag ``yielded``.
    """

    def found(width: float) -> tuple[float, float]:
        return _least(run, width) if "shear_rate_bulk" in run else (np.nan, np.nan)

    time, error = found(SMOOTHING_WIDTH)
    return described(
        xr.Dataset(
            {
                "yielding_time": time,
                "yielding_time_error": error,
                "yielding_time_smoothing": _sensitivity(time, found),
                "yielded": bool(np.isfinite(time)),
            }
        )
    )


def _least(run: xr.Dataset, width: float) -> tuple[float, float]:
    """Return the time of the least bulk rate and its uncertainty [time unit]; NaN if none."""
    times, smooth, noise = smooth_in_log_time(run, "shear_rate_bulk", width)
    lowest = int(np.argmin(smooth))
    enough = smooth[lowest] + RECOVERY * noise[lowest]
    if not smooth[:lowest].max(initial=-np.inf) > enough < smooth[lowest:].max():
        return float("nan"), float("nan")
    near = smooth <= smooth[lowest] + noise[lowest]
    return float(times[lowest]), _extent(times, near, lowest, float(run["interval"][lowest]))


def _extent(times: FloatArray, near: np.ndarray, middle: int, interval: float) -> float:
    """Return half the length of the unbroken stretch of ``near`` about an index [time unit]."""
    away = np.flatnonzero(~near)
    first = int(away[away < middle].max(initial=-1)) + 1
    last = int(away[away > middle].min(initial=len(times))) - 1
    return 0.5 * max(float(times[last] - times[first]), interval)


def slip_time(run: xr.Dataset) -> xr.Dataset:
    """Find the time τ_s at which the slip velocity first rises to half its steady value (Fig. 8e).

    The series is smoothed as for the yielding time, and crossings are interpolated in log time.
    The uncertainty is the time to the farther of the crossings of half the steady value less, and
    plus, one standard error (of the smoothed series and of half the steady value together), and
    at least half a record; in made-up runs it covers the true time in 6 of 10. NaN if the slip
    velocity is not steady, or never rises through half its steady value: a smoothed series that
    starts above it counts only once it has fallen below.

    Returns
    -------
    xr.Dataset
        Scalars ``slip_time``, ``slip_time_error`` and ``slip_time_smoothing`` (as that of the
        yielding time) [time unit].
    """
    steady = steady_state(run)

    def found(width: float) -> tuple[float, float]:
        if bool(steady["steady_slip"]) and float(steady["slip_velocity"]) > 0:
            return _half_risen(run, steady, width)
        return float("nan"), float("nan")

    time, error = found(SMOOTHING_WIDTH)
    told = {
        "slip_time": time,
        "slip_time_error": error,
        "slip_time_smoothing": _sensitivity(time, found),
    }
    return described(xr.Dataset(told))


def _half_risen(run: xr.Dataset, steady: xr.Dataset, width: float) -> tuple[float, float]:
    """Return when slip has risen to half, and the uncertainty of that [time unit]; NaN if never."""
    half = 0.5 * float(steady["slip_velocity"])
    times, smooth, noise = smooth_in_log_time(run, "slip_velocity", width)
    time = _first_rise(times, smooth, half)
    if not np.isfinite(time):
        return float("nan"), float("nan")
    at = int(np.searchsorted(times, time).clip(max=len(times) - 1))
    margin = float(np.hypot(noise[at], 0.5 * float(steady["slip_velocity_error"])))
    early = _first_rise(times, smooth, half - margin)
    late = _first_rise(times, smooth, half + margin)
    reach = np.nanmax([time - early, late - time, 0.5 * float(run["interval"][at])])
    return time, float(reach)


def _first_rise(times: FloatArray, values: FloatArray, level: float) -> float:
    """Return when the values first rise through a level, interpolated in log time; else NaN."""
    rises = np.flatnonzero((values[:-1] < level) & (values[1:] >= level))
    if not len(rises):
        return float("nan")
    first = int(rises[0])
    share = (level - values[first]) / (values[first + 1] - values[first])
    return float(times[first] * (times[first + 1] / times[first]) ** share)
