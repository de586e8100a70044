"""How shear rates and slip depend on the distance between the walls (Fig. 9)."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.analysis import paper
from softslip.analysis.comparable import unlike
from softslip.analysis.figures.drawing import (
    COLOURS,
    LINES,
    WIDE,
    grid_of_panels,
    label_decades,
    named,
    styled,
)
from softslip.analysis.figures.fitted import measured
from softslip.analysis.figures.markers import FloatArray, draw_points, explained, verdicts
from softslip.analysis.figures.panels import (
    ROUGHNESS,
    above,
    facets,
    legend_above,
    note_missing,
    selected,
    with_dimensions,
)
from softslip.analysis.figures.published import mark_place
from softslip.analysis.figures.shown import Quantity, along, place, quantity, show, shown
from softslip.analysis.fits import FITTED
from softslip.analysis.fits.finite_size import MOONEY_BULK, MOONEY_SLIP, SEPARATION
from softslip.analysis.observables import mean_over_seeds

KNOWN = ("stress", ROUGHNESS, SEPARATION)
"""Dimensions that do not become rows of panels."""

STEADY_VALUES = {
    "shear_rate_wall": ("steady_wall", r"$\dot\gamma_\mathrm{wall}$ [1 / time unit]"),
    "shear_rate_bulk": ("steady_bulk", r"$\dot\gamma_\mathrm{bulk}$ [1 / time unit]"),
    "slip_velocity": ("steady_slip", r"$V_s$ [length unit / time unit]"),
}
"""What the last panel shows, the flag of each one's steady state, and its name and unit."""

PARAMETERS = "Eq. A1 fitted: parameters"
"""Name of the series of the fit's constants."""

BELOW_LEGEND = 0.44
"""Height up to which the paper's separation is marked, over that of the panel."""

PINNED = ("slip_velocity", "shear_rate_bulk")
"""V_s and γ̇_bulk of one separation."""


@styled
def separations(creep: xr.Dataset, flow_curve: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw the shear rates in time for each wall separation, and the steady values against it.

    One stress and roughness are shown: the stress at which most separations have runs, the
    highest of these, and the smoothest wall, where slip is strongest. The line is Eq. A1,
    γ̇_wall(H) = 2 V_s/H + γ̇_bulk, fitted to the apparent rates of all separations; where the fit
    was not made, with V_s and γ̇_bulk of the separation nearest to the paper's. Where only one
    separation was run, the figure says so. Further dimensions get a row of panels each.

    Parameters
    ----------
    creep, flow_curve
        From `analysis.observables`, of the same runs.
    fits
        The flow curve's `analysis.fits.fit_laws`.
    """
    series = with_dimensions(mean_over_seeds(creep), *KNOWN)
    table = with_dimensions(mean_over_seeds(flow_curve), *KNOWN)
    rows = facets(table, *KNOWN)
    figure, panels = grid_of_panels(len(rows), 3, width=WIDE, height=2.9)
    for (title, chosen), axes in zip(rows, panels, strict=True):
        cell = table.sel(chosen)
        at = _condition(cell)
        words = ", ".join(filter(None, (named(dim, value) for dim, value in at.items())))
        _draw_series(axes[0], "a", series.sel(chosen).sel(at), "shear_rate_wall")
        _draw_series(axes[1], "b", series.sel(chosen).sel(at), "shear_rate_bulk")
        axes[0].set_title(rf"(a) $\dot\gamma_\mathrm{{wall}}$, {words}")
        axes[1].set_title(r"(b) $\dot\gamma_\mathrm{bulk}$, the same")
        axes[0].set_ylabel(above(title, "shear rate [1 / time unit]"))
        _share_rates(axes[0], axes[1])
        _draw_steady(axes[2], cell.sel(at), selected(fits, chosen | at))
    legend_above(figure, panels[0][0])
    count = table.sizes[SEPARATION]
    alone = "" if count > 1 else "one wall separation only: sweep channel.height to compare"
    flags = explained(table, *(flag for flag, _ in STEADY_VALUES.values()))
    marked = any(not unlike(table.sel(chosen)) for _, chosen in rows)
    least = f"dashed grey: the paper finds no effect beyond $H$ = {paper.LEAST_SEPARATION.value:g}"
    mean = "(a, b) means over seeds" if creep.sizes.get("seed", 1) > 1 else ""
    levels = any(one.name == PARAMETERS for one in shown(figure))
    constants = "(c) dotted: the constants of the fit" if levels else ""
    notes = (alone, flags, mean, constants, least if marked else "")
    note_missing(figure, flow_curve, *notes, known=KNOWN)
    return figure


def _condition(cell: xr.Dataset) -> dict[str, float]:
    """Return the stress and roughness that are shown."""
    roughnesses = cell[ROUGHNESS].values
    smoothest = roughnesses[int(np.argmin(np.nan_to_num(roughnesses)))]
    done = (cell["status"].sel({ROUGHNESS: smoothest}) == "done").sum(SEPARATION)
    best = np.flatnonzero(done.values == done.values.max())
    return {"stress": float(cell["stress"].values[best[-1]]), ROUGHNESS: float(smoothest)}


def _draw_series(axes: Axes, panel: str, series: xr.Dataset, name: str) -> None:
    """Draw one rate in time, a colour and line style for each separation."""
    axes.set(xscale="log", yscale="log", xlabel=r"time $t$ [time unit]")
    for number, value in enumerate(series[SEPARATION].values):
        line = series.isel({SEPARATION: number})[name]
        with np.errstate(invalid="ignore"):
            rate = np.where(line.values > 0, line.values, np.nan)
        if not np.isfinite(rate).any():
            continue
        look = {"color": COLOURS[number % len(COLOURS)], "linestyle": LINES[number % len(LINES)]}
        axes.plot(line["time"].values, rate, label=named(SEPARATION, value) or None, **look)
        points = {"time": quantity(line["time"]), name: quantity(line, rate)}
        show(axes, panel, "mean", points, place(line))


def _share_rates(*panels: Axes) -> None:
    limits = np.array([panel.get_ylim() for panel in panels if panel.lines])
    if len(limits):
        for panel in panels:
            panel.set_ylim(limits[:, 0].min(), limits[:, 1].max())
    for panel in panels:
        label_decades(panel.yaxis)
    for panel in panels[1:]:
        panel.tick_params(labelleft=False)


def _draw_steady(axes: Axes, cell: xr.Dataset, fits: xr.Dataset) -> None:
    """Draw the steady values against the separation, with Eq. A1."""
    axes.set(yscale="log", xlabel=r"$H$ [length unit]", title="(c) steady values")
    separation = cell[SEPARATION].values
    for number, (name, (flag, label)) in enumerate(STEADY_VALUES.items()):
        value, error = (cell[f"{name}{end}"].values for end in ("", "_error"))
        with np.errstate(invalid="ignore"):
            shown = np.isfinite(separation) & (value > 0)
        look: dict[str, Any] = {
            "color": COLOURS[number],
            "marker": "os^"[number],
            "markersize": 5.5,
        }
        axes.plot([], [], linestyle="none", label=label, **look)
        points = (separation[shown], value[shown], error[shown])
        draw_points(axes, *points, verdicts(cell, flag)[shown], look)
        columns = {key: cell[key] for key in (name, f"{name}_error")}
        kept = {key: quantity(each, each.values[shown]) for key, each in columns.items()}
        show(axes, "c", name.replace("_", " "), along(cell[name], shown) | kept, place(cell))
    _draw_theory(axes, cell, fits)
    widest = 1.15 * np.nanmax(np.append(separation, paper.FULL_SEPARATION.value))
    axes.set_xlim(0, widest)
    if not unlike(cell):
        mark_place(axes, "c", "least_separation", paper.LEAST_SEPARATION, top=BELOW_LEGEND)
    low, high = axes.get_ylim()
    axes.set_ylim(low / 1.5, high * (high / low) ** 1.2)
    axes.legend(loc="upper left", fontsize=7.5)


def _draw_theory(axes: Axes, cell: xr.Dataset, fits: xr.Dataset) -> None:
    """Draw Eq. A1 as it was fitted, or with the slip velocity and bulk rate of one separation."""
    separation = cell[SEPARATION].values
    made = str(fits[f"{MOONEY_SLIP}_message"].item()) == FITTED
    source, names = (fits, (MOONEY_SLIP, MOONEY_BULK)) if made else (_pinned(cell), PINNED)
    if source is None:
        return
    slip, bulk = (float(source[name]) for name in names)
    height = np.geomspace(0.8 * np.nanmin(separation), 1.25 * np.nanmax(separation), 100)
    rate = 2 * slip / height + bulk
    if made:
        label = rf"fitted: $V_s$ = {measured(fits, MOONEY_SLIP)}"
        _draw_constants(axes, fits, height)
    else:
        at = f"{float(source[SEPARATION]):.3g}"
        label = rf"$2 V_s/H + \dot\gamma_\mathrm{{bulk}}$ of $H$ = {at}"
    axes.plot(height, rate, color="0.3", linewidth=0.9, linestyle=(0, (4, 2)), label=label)
    points = {
        SEPARATION: Quantity(height, "length unit", "distance between the walls"),
        "shear_rate_wall": Quantity(rate, "1 / time unit", "apparent shear rate of Eq. A1"),
    }
    show(axes, "c", "Eq. A1 fitted" if made else "Eq. A1", points, place(source))


def _draw_constants(axes: Axes, fits: xr.Dataset, height: FloatArray) -> None:
    """Draw what Eq. A1 takes as independent of H, V_s and γ̇_bulk, in the colours of the points."""
    names = [f"{name}{end}" for name in (MOONEY_SLIP, MOONEY_BULK) for end in ("", "_error")]
    parameters = {name: quantity(fits[name], [float(fits[name])]) for name in names}
    show(axes, "c", PARAMETERS, parameters, place(fits))
    shown = dict(zip(PINNED, (MOONEY_SLIP, MOONEY_BULK), strict=True))
    for number, name in enumerate(STEADY_VALUES):
        value = float(fits[shown[name]]) if name in shown else np.nan
        if value > 0:
            level = np.full_like(height, value)
            axes.plot(height, level, color=COLOURS[number], linewidth=0.8, linestyle=":")


def _pinned(cell: xr.Dataset) -> xr.Dataset | None:
    """Return the values of the separation nearest to the paper's of which slip is known."""
    separation = cell[SEPARATION].values
    with np.errstate(invalid="ignore"):
        known = np.isfinite(cell["slip_velocity"].values) & np.isfinite(separation)
    if not known.any():
        return None
    distance = np.where(known, np.abs(separation - paper.FULL_SEPARATION.value), np.inf)
    return cell.isel({SEPARATION: int(np.argmin(distance))})
