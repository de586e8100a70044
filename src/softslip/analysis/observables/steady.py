"""Averages of a run over its steady state, with errors, and verdicts on whether it has one."""

import numpy as np
import xarray as xr

from softslip.analysis.observables.series import (
    FloatArray,
    equal_bins,
    interval_means,
    parameters_of,
)
from softslip.analysis.observables.verdicts import (
    DRIFTING,
    SIGNIFICANCE,
    STEADY,
    TOO_SHORT,
    WITHIN_ERROR,
    Window,
    judged,
    steady_verdict,
    window_of,
)
from softslip.files.quantities import described

FLAGS = {
    "shear_rate_wall": "steady_wall",
    "shear_rate_bulk": "steady_bulk",
    "slip_velocity": "steady_slip",
}
"""Series whose steady state is looked for, and the name of each one's flag."""

VERDICT_NAMES = {name: flag.replace("steady", "verdict") for name, flag in FLAGS.items()}
"""The name of the verdict on each of those series."""

MEAN_ENDINGS = ("_error", "_freedom", "_drift", "_drift_error")
"""Ends of the names of what is told beside the mean of a series."""

BULK = "shear_rate_bulk"
"""Series that must have flowed to be steady."""

NO_SERIES = ""
"""Verdict on a series that a run lacks."""


def _scaled(run: xr.Dataset, name: str, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a series in bins, and what it is relative to: slip to half the speed of the walls."""
    values = interval_means(run, name, edges)
    if name != "slip_velocity":
        return values, values
    half_speed = 0.5 * parameters_of(run).channel.height
    return values, half_speed * interval_means(run, "shear_rate_wall", edges)


def steady_state(run: xr.Dataset) -> xr.Dataset:
    """Average a shear run over its steady state, and say whether it has one.

    For each of shear_rate_wall, shear_rate_bulk and slip_velocity:

    1. The records are averaged into equal bins, as long as the longest record.
    2. The transient is cut off by the marginal standard error rule, in batches as long as the
       series is correlated, and no more is cut than differs from the rest (`steady_start`).
    3. A straight line is fitted to the window. The drift is its change over the window relative to
       the mean; for the slip velocity relative to half the relative speed of the walls, of which
       slip is a part. Its error counts the correlation of the series (`change_of`).
    4. The series is **drifting** if the trend is significant (t-test, 5 %) and above 5 %; if the
       transient does not end before 45 % of the run, unless drift and its error are below 5 %; if
       a rate falls on as a power of time (`falls_as_power`); or if the bulk has strained too little
       to have flowed (`has_not_flowed`). It is **too short** if the window has less
       than 20 bins. Otherwise it is **steady**, or, where the standard error of the mean
       (`mean_of`) exceeds 5 %, **steady within its error**.

    Series that are not drifting share one window, from the latest of their starting points to the
    end, so that γ̇_wall = γ̇_bulk + 2 V_s/H (Eq. A1) holds for their means. A small but significant
    trend adds half its change to the error. A drifting series is averaged over the last half, and
    its error is half its linear change there or the standard error, whichever is larger: the bar
    spans the drift. How often verdicts err, and intervals cover the truth, stands in
    docs/accuracy.md.

    Parameters
    ----------
    run
        A shear run.

    Returns
    -------
    xr.Dataset
        Scalars: ``<name>``, ``<name>_error``, ``<name>_freedom`` (degrees of freedom of the error:
        an interval is mean ± t error with Student's quantile), ``<name>_drift`` and
        ``<name>_drift_error`` of each series (NaN where the run has no bulk observables); verdicts
        ``verdict_wall``, ``verdict_bulk``, ``verdict_slip``; flags ``steady_wall``,
        ``steady_bulk``, ``steady_slip`` that are True for either steady verdict; ``steady`` (wall
        and, where there is one, bulk), ``steady_from`` (start of the shared window; of the last
        half where all drifts) [time unit], ``drift`` (the largest in size of wall and bulk), and
        ``shear_stress`` with its error and freedom over the same window.

    Raises
    ------
    DatasetError
        When the run has no records, or its parameters cannot be read.
    """
    edges = equal_bins(run)
    length = float(edges[1] - edges[0])
    series = {name: _scaled(run, name, edges) for name in FLAGS if name in run}
    found = {
        name: judged(values, scale, name != "slip_velocity", length if name == BULK else None)
        for name, (values, scale) in series.items()
    }
    steady = {name: found.get(name, (0, NO_SERIES))[1] in (STEADY, WITHIN_ERROR) for name in FLAGS}
    half = (len(edges) - 1) // 2
    start = max((first for name, (first, _) in found.items() if steady[name]), default=half)
    told: dict[str, float | bool | str] = {}
    for name, flag in FLAGS.items():
        verdict, window = NO_SERIES, None
        if name in series:
            first = start if steady[name] else half
            verdict = found[name][1]
            window = window_of(*(each[first:] for each in series[name]))
            if steady[name]:
                verdict = steady_verdict(window.mean.error, window.scale)
        told |= _estimates(name, window, verdict)
        told |= {flag: steady[name], VERDICT_NAMES[name]: verdict}
    stress = interval_means(run, "stress", edges[start:])
    kept = window_of(stress, stress).mean
    rates = [name for name in ("shear_rate_wall", BULK) if name in series]
    told |= {
        "steady": all(steady[name] for name in rates),
        "steady_from": float(edges[start]),
        "drift": max((float(told[f"{name}_drift"]) for name in rates), key=abs),
        "shear_stress": kept.value,
        "shear_stress_error": kept.error,
        "shear_stress_freedom": kept.freedom,
    }
    return described(xr.Dataset(told))


def verdicts_of(steady: xr.Dataset, *names: str) -> xr.Dataset:
    """Return of a steady state what `mean_over_seeds` takes to judge seeds of it together.

    Parameters
    ----------
    steady
        From `steady_state`.
    names
        Keys of `FLAGS`.

    Returns
    -------
    xr.Dataset
        The means of these series with their errors and drifts, verdicts and flags.
    """
    means = [f"{name}{end}" for name in names for end in ("", *MEAN_ENDINGS)]
    return steady[[*means, *(words[name] for words in (VERDICT_NAMES, FLAGS) for name in names)]]


def _estimates(name: str, window: Window | None, verdict: str) -> dict[str, float]:
    """Return the mean of a series with its errors."""
    mean = error = freedom = drift = drift_error = float("nan")
    if window is not None:
        mean, error, freedom = window.mean.value, window.mean.error, window.mean.freedom
        drift, drift_error = window.drift, window.drift_error
        change = 0.5 * abs(window.change.value)
        if verdict in (DRIFTING, TOO_SHORT):
            error = float(np.fmax(error, change))
        elif window.change.chance < SIGNIFICANCE:
            error = float(np.hypot(error, change))
    return {
        name: mean,
        f"{name}_error": error,
        f"{name}_freedom": freedom,
        f"{name}_drift": drift,
        f"{name}_drift_error": drift_error,
    }
