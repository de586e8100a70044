"""Creep and yielding (Fig. 8)."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from softslip.analysis.figures.drawing import (
    LINES,
    WIDE,
    grid_of_panels,
    label_decades,
    named,
    sequence,
    styled,
)
from softslip.analysis.figures.markers import DRIFTING, STEADY, draw_points
from softslip.analysis.figures.panels import (
    ROUGHNESS,
    Family,
    above,
    columns_for,
    facets,
    leave_empty,
    note_missing,
    of_all,
    selected,
    with_dimensions,
)
from softslip.analysis.figures.shown import place, quantity, show
from softslip.analysis.figures.timescale_panels import (
    draw_times,
    explained_times,
    yield_stress_of,
)
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.observables.verdicts import SIGNIFICANCE

THIN, THICK = 0.5, 1.4
"""Line widths of a single run and of a mean over runs [point]."""

ROWS = 7
"""Entries of the legend in the last panel that have one column."""

ROOM = 3.0
"""Height of the last panel over its largest value, for the legend."""

BELOW_LEGEND = 0.2
"""Share of its height at which it says why it is empty."""

KNOWN = ("stress", ROUGHNESS)
"""Dimensions that do not become rows of panels."""


@styled
def transients(dataset: xr.Dataset, flow_curve: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw the shear rates in time, and when the bulk yields and slip sets in.

    (a, b) Apparent shear rate at the roughest and smoothest wall of which a run is done: colours
    are stresses, thin lines single runs where there are several seeds, thick ones their mean. (c)
    That of the bulk, each line style a roughness, averaged over seeds, with a triangle where it
    yields. (d, e) Yielding and slip time against the stress above yield, with the powers fitted to
    them, and the paper's through them where the material is the paper's; filled, half filled and
    open as other smoothings of the series bear them out (`timescale_panels.decided`). Rates that
    are not positive leave gaps, and the figure says so. (f) How far the curves of (c) lie apart
    that differ in roughness, over what seeds let expect (`observables.master_curves.collapse`);
    open where chance has at least that spread in less than 5 % of cases. Further dimensions get two
    rows of panels each.

    Parameters
    ----------
    dataset
        From `analysis.observables.creep`.
    flow_curve
        From `analysis.observables.flow_curve`, of the same runs.
    fits
        Its `analysis.fits.fit_laws`, for the yield stress.
    """
    single = with_dimensions(dataset, *KNOWN)
    mean = with_dimensions(mean_over_seeds(dataset), *KNOWN)
    table = with_dimensions(mean_over_seeds(flow_curve), *KNOWN)
    rows = facets(mean, *KNOWN)
    figure, panels = grid_of_panels(2 * len(rows), 3, width=WIDE, height=2.75)
    family = Family.along(table, ROUGHNESS)
    notes, seen, apart = list[str](), set[str](), False
    for number, (title, chosen) in enumerate(rows):
        rates, times = panels[2 * number : 2 * number + 2]
        cell = table.sel(chosen)
        _draw_row(single.sel(chosen), mean.sel(chosen), family, rates)
        rates[0].set_ylabel(above(title, "shear rate [1 / time unit]"))
        laws = selected(fits, chosen)
        offset, whose = yield_stress_of(cell, laws)
        notes.append(whose)
        _mark_yielding(rates[2], cell, mean.sel(chosen), offset)
        seen |= draw_times(times[0], "d", cell, family, "yielding_time", offset, laws)
        seen |= draw_times(times[1], "e", cell, family, "slip_time", offset, laws)
        apart |= _draw_collapse(times[2], cell)
        times[0].set_ylabel(above(title, times[0].get_ylabel()))
    _add_legends(figure, panels, mean, family)
    every = [mean[name].values for name in ("shear_rate_wall", "shear_rate_bulk")]
    with np.errstate(invalid="ignore"):
        gaps = any((rate <= 0).any() for rate in every)
    gap = "gaps: rate not positive" if gaps else ""
    words = (
        *(_explained_lines(dataset), gap, *dict.fromkeys(notes), explained_times(seen)),
        _explained_collapse(table, apart),
    )
    note_missing(figure, dataset, *words, known=KNOWN)
    return figure


def _explained_lines(dataset: xr.Dataset) -> str:
    """Say what thin and thick lines are, where there are several seeds."""
    if dataset.sizes.get("seed", 1) == 1:
        return ""
    return "(a, b) thin lines: single seeds, thick: their mean; (c) means over seeds"


def _explained_collapse(table: xr.Dataset, apart: bool) -> str:
    """Say what is drawn of how curves collapse; whether some of them lie apart."""
    if not np.isfinite(table["master_curve_spread_ratio"]).any():
        return ""
    words = "(f) at 1, curves differ between roughnesses as between seeds"
    return f"{words}; open: by more than chance ({SIGNIFICANCE:.0%})" if apart else words


def _draw_row(single: xr.Dataset, mean: xr.Dataset, family: Family, axes: list[Axes]) -> None:
    roughnesses = mean[ROUGHNESS].values
    done = [number for number, _, _ in family.members(mean)] or range(len(roughnesses))
    ends = [(done[-1], "a"), (done[0], "b")]
    for (number, letter), panel in zip(ends, axes, strict=False):
        if "seed" in single.dims and single.sizes["seed"] > 1:
            for seed in range(single.sizes["seed"]):
                runs = single.isel(roughness=number, seed=seed)
                _draw_bundle(panel, runs, "shear_rate_wall", "-", THIN)
                _keep_bundle(panel, letter, "run", runs, "shear_rate_wall")
        _draw_bundle(panel, mean.isel(roughness=number), "shear_rate_wall", "-", THICK)
        _keep_bundle(panel, letter, "mean", mean.isel(roughness=number), "shear_rate_wall")
        words = named(ROUGHNESS, roughnesses[number])
        panel.set_title(rf"({letter}) $\dot\gamma_\mathrm{{wall}}$, {words}".rstrip(", "))
    for number, _, line in family.members(mean):
        style = LINES[number % len(LINES)]
        _draw_bundle(axes[2], line, "shear_rate_bulk", style, THIN + 0.5)
        _keep_bundle(axes[2], "c", "mean", line, "shear_rate_bulk")
    axes[2].set_title(rf"(c) $\dot\gamma_\mathrm{{bulk}}$, {of_all(ROUGHNESS)}")
    limits = [panel.get_ylim() for panel in axes if panel.lines]
    for panel in axes:
        panel.set(xscale="log", yscale="log", xlabel=r"time $t$ [time unit]")
        if limits:
            panel.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
    for panel in axes[1:]:
        panel.tick_params(labelleft=False)


def _draw_bundle(axes: Axes, runs: xr.Dataset, name: str, style: Any, width: float) -> None:
    """Draw one series for all stresses."""
    axes.set(xscale="log", yscale="log")
    for number, colour in enumerate(sequence(runs.sizes["stress"])):
        shown = _positive(runs[name].isel(stress=number).values)
        if np.isfinite(shown).any():
            time = runs["time"].values
            axes.plot(time, shown, color=colour, linestyle=style, linewidth=width)


def _positive(rate: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rates for a logarithmic axis: one that is not positive leaves a gap."""
    with np.errstate(invalid="ignore"):
        return np.where(rate > 0, rate, np.nan)


def _keep_bundle(axes: Axes, panel: str, kind: str, runs: xr.Dataset, name: str) -> None:
    """Keep the numbers of one series for all stresses, where there are any."""
    for number in range(runs.sizes["stress"]):
        one = runs[name].isel(stress=number)
        rate = _positive(one.values)
        if np.isfinite(rate).any():
            points = {"time": quantity(one["time"]), name: quantity(one, rate)}
            show(axes, panel, kind, points, place(one))


def _mark_yielding(axes: Axes, cell: xr.Dataset, mean: xr.Dataset, yield_stress: float) -> None:
    """Mark where the bulk yields on its curves of the rate in time, above the yield stress."""
    time = mean["time"].values
    for number, colour in enumerate(sequence(mean.sizes["stress"])):
        for index in range(mean.sizes[ROUGHNESS]):
            at = {"stress": number, ROUGHNESS: index}
            yielded = float(cell["yielding_time"].isel(at))
            rate = _positive(mean["shear_rate_bulk"].isel(at).values)
            above_yield = float(mean["stress"][number]) > yield_stress
            if above_yield and np.isfinite(yielded) and np.isfinite(rate).any():
                known = np.isfinite(rate)
                height = np.exp(np.interp(yielded, time[known], np.log(rate[known])))
                look = {"color": colour, "markeredgecolor": "black", "markeredgewidth": 0.5}
                axes.plot(yielded, height, marker="v", markersize=4.5, zorder=4, **look)
                line = mean["shear_rate_bulk"].isel(at)
                points = {"time": quantity(mean["time"], [yielded])}
                points["shear_rate_bulk"] = quantity(line, [height])
                show(axes, "c", "yielding", points, place(line))


def _draw_collapse(axes: Axes, cell: xr.Dataset) -> bool:
    """Draw how well the bulk's curves of all roughnesses are one; tell whether some are not."""
    axes.set_title("(f) collapse of (c)")
    names = [f"master_curve_{end}" for end in ("spread_ratio", "spread_chance", "spread")]
    ratio, chance, spread = (_of_first_roughness(cell[name]) for name in names)
    stress = cell["stress"].values
    known = np.isfinite(ratio.values)
    if not known.any():
        leave_empty(axes, _why_unknown(cell, spread), BELOW_LEGEND)
        return False
    apart = known & (chance.values < SIGNIFICANCE)
    states = np.where(apart, DRIFTING, STEADY)[known]
    axes.set(xscale="log", xlabel=r"$\sigma$ [stress unit]", ylabel="spread over expected [1]")
    axes.axhline(1.0, color="0.7", linewidth=0.8, zorder=0)
    look = {"color": "black", "marker": "o", "markersize": 5.5}
    height = ratio.values[known]
    draw_points(axes, stress[known], height, np.zeros(len(height)), states, look)
    label_decades(axes.xaxis)
    axes.set_ylim(0.0, ROOM * max(1.0, height.max()))
    points = {"stress": quantity(cell["stress"], stress[known])}
    for name, each in zip(names, (ratio, chance, spread), strict=True):
        points[name] = quantity(each, each.values[known])
    show(axes, "f", "collapse", points, place(ratio))
    return bool(apart.any())


def _why_unknown(cell: xr.Dataset, spread: xr.DataArray) -> str:
    if cell.sizes[ROUGHNESS] == 1:
        return "one roughness only"
    if np.isfinite(spread).any():
        return "no two seeds of a roughness"
    return "no two roughnesses at a stress"


def _of_first_roughness(values: xr.DataArray) -> xr.DataArray:
    """Return what all roughnesses say together, where it was given a dimension of one of them."""
    return values.isel({ROUGHNESS: 0}) if ROUGHNESS in values.dims else values


def _add_legends(
    figure: Figure, panels: list[list[Axes]], mean: xr.Dataset, family: Family
) -> None:
    """Explain the colours above the panels, lines and markers in the room of the last one."""
    stresses = mean["stress"].values
    colours = [
        Line2D([], [], color=colour, linewidth=THICK, label=named("stress", stress))
        for colour, stress in zip(sequence(len(stresses)), stresses, strict=True)
        if named("stress", stress)
    ]
    if colours:
        columns = columns_for(len(colours), 8)
        figure.legend(handles=colours[::-1], loc="outside upper center", ncols=columns)
    styles = [
        Line2D([], [], color="0.3", linestyle=LINES[number % len(LINES)], label=f"{label} (c)")
        for number, label, _ in family.members(mean)
        if label
    ]
    points = [
        Line2D([], [], linestyle="none", label=f"{label} (d, e)", **family.look(number))
        for number, label, _ in family.members(mean)
        if label
    ]
    triangle: dict[str, Any] = {
        "marker": "v",
        "markersize": 4.5,
        "linestyle": "none",
        "color": "0.6",
    }
    mark = Line2D([], [], markeredgecolor="black", label=r"$\tau_y$ in (c)", **triangle)
    handles = [*styles, *points, mark]
    columns = columns_for(len(handles), 2) if len(handles) > ROWS else 1
    panels[1][2].legend(
        handles=handles, loc="upper left", fontsize=7, ncols=columns, columnspacing=1.0
    )
