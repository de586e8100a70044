"""A single run: its shear rates and slip in time, and its velocity profile."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from softslip.analysis.figures.drawing import (
    COLOURS,
    LINES,
    NARROW,
    WIDE,
    grid_of_panels,
    label_decades,
    note,
    styled,
)
from softslip.analysis.figures.membranes import conditions
from softslip.analysis.figures.shown import quantity, show
from softslip.analysis.figures.velocity import draw_normalised, frame_profiles
from softslip.analysis.observables import mean_profile, steady_state, yielding_time
from softslip.analysis.observables.steady import FLAGS, VERDICT_NAMES
from softslip.analysis.observables.tables import creep

HEIGHT = 2.9
"""Height of the panels [inch]."""

LABELS = {
    "shear_rate_wall": r"$\dot\gamma_\mathrm{wall}$",
    "shear_rate_bulk": r"$\dot\gamma_\mathrm{bulk}$",
    "slip_velocity": r"$V_\mathrm{s}$",
}
"""How series are written in a legend."""


@styled
def creep_curve(run: xr.Dataset) -> Figure:
    """Draw the apparent and true shear rate of a run in time, and its slip velocity.

    Thin lines span the averages that the flow curve has of the run, over their window: dashed where
    the series drifts. A triangle marks where the bulk yields. Values that are not positive leave
    gaps, and the figure says so.

    Parameters
    ----------
    run
        A shear run.
    """
    series = creep([({}, run)])
    steady = steady_state(run)
    figure, ((rates, slip),) = grid_of_panels(1, 2, width=WIDE, height=HEIGHT)
    gaps = False
    panels = {"shear_rate_wall": rates, "shear_rate_bulk": rates, "slip_velocity": slip}
    for number, (name, panel) in enumerate(panels.items()):
        if np.isfinite(series[name].values).any():
            gaps |= _draw_series(panel, series, name, COLOURS[number])
            _draw_mean(panel, run, steady, name, COLOURS[number])
    _mark_yielding(rates, run, series)
    rates.set_ylabel("shear rate [1 / time unit]")
    slip.set_ylabel("slip velocity [length unit / time unit]")
    for panel in (rates, slip):
        panel.set(xscale="log", yscale="log", xlabel=r"time $t$ [time unit]")
        if panel.lines:
            label_decades(panel.yaxis)
            panel.legend()
    rates.set_title(", ".join(conditions(run)), loc="left")
    note(figure, _verdicts(steady), "gaps: not positive" if gaps else "")
    return figure


def _draw_series(axes: Axes, series: xr.Dataset, name: str, colour: str) -> bool:
    """Draw a series; return whether it has gaps."""
    values = series[name].values
    positive: NDArray[np.float64] = np.where(values > 0, values, np.nan)
    axes.plot(series["time"].values, positive, color=colour, label=LABELS[name])
    points = {"time": quantity(series["time"]), name: quantity(series[name], positive)}
    show(axes, name, "series", points)
    return bool((np.isfinite(values) & ~np.isfinite(positive)).any())


def _draw_mean(axes: Axes, run: xr.Dataset, steady: xr.Dataset, name: str, colour: str) -> None:
    """Draw the average of a series over its window, with a band of its standard error."""
    mean, error = float(steady[name]), float(steady[f"{name}_error"])
    if not mean > 0:
        return
    window = [float(steady["steady_from"]), float(run["time"][-1])]
    style: Any = LINES[0] if bool(steady[FLAGS[name]]) else LINES[1]
    axes.plot(window, [mean, mean], color=colour, linestyle=style, linewidth=0.8)
    if 0 < error < mean:
        axes.fill_between(window, mean - error, mean + error, color=colour, alpha=0.2, linewidth=0)
    points = {
        "time": quantity(run["time"], window),
        name: quantity(steady[name], [mean, mean]),
        f"{name}_error": quantity(steady[f"{name}_error"], [error, error]),
    }
    show(axes, name, "average", points)


def _mark_yielding(axes: Axes, run: xr.Dataset, series: xr.Dataset) -> None:
    """Mark the least bulk shear rate, where the bulk yields."""
    time = float(yielding_time(run)["yielding_time"])
    rate = series["shear_rate_bulk"].values
    with np.errstate(invalid="ignore"):
        known = rate > 0
    if not np.isfinite(time) or not known.any():
        return
    height = np.exp(np.interp(time, series["time"].values[known], np.log(rate[known])))
    look: dict[str, Any] = {"marker": "v", "markersize": 6, "markeredgecolor": "black"}
    axes.plot(time, height, color=COLOURS[1], linestyle="none", label=r"$\tau_y$", zorder=4, **look)
    points = {"time": quantity(series["time"], [time])}
    points["shear_rate_bulk"] = quantity(series["shear_rate_bulk"], [height])
    show(axes, "shear_rate_bulk", "yielding", points)


def _verdicts(steady: xr.Dataset) -> str:
    """Say which series are steady; one that a run lacks has no verdict."""
    told = {LABELS[name]: str(steady[VERDICT_NAMES[name]].item()) for name in FLAGS}
    return "; ".join(f"{label} {verdict}" for label, verdict in told.items() if verdict)


@styled
def velocity_profile(run: xr.Dataset) -> Figure:
    """Draw the mean velocity profile of a run from wall to wall, normalised (Fig. 4).

    The dotted line is flow without slip; the band is the standard error over the profiles.

    Parameters
    ----------
    run
        A shear run.
    """
    profile = mean_profile(run)
    figure, ((axes,),) = grid_of_panels(1, 1, width=NARROW, height=NARROW)
    draw_normalised(axes, profile, COLOURS[0])
    frame_profiles(axes)
    axes.set_ylabel(r"$v_\mathrm{norm}$ [1]")
    axes.set_title(", ".join(conditions(run)), loc="left")
    known = ("wall_distance", "normalised_position", "normalised_velocity")
    points = {name: quantity(profile[name]) for name in (*known, "normalised_velocity_error")}
    show(axes, "", "profile", points)
    used = int(profile["profiles_used"])
    moves = np.isfinite(profile["normalised_velocity"].values).any()
    still = "" if moves else "the walls do not move"
    note(figure, still or f"mean of {used} profile" + "s" * (used != 1))
    return figure
