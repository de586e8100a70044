"""A level of fidelity, the paper's mesh and a second packing: shear rate and slip over time."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.analysis.figures.drawing import COLOURS, WIDE, grid_of_panels, note, styled
from softslip.analysis.figures.shown import Quantity, quantity, show

PANELS = {
    "shear_rate_bulk": (r"$\dot\gamma_\mathrm{bulk}$", "[1 / time unit]"),
    "slip_velocity": (r"$V_\mathrm{s}$", "[length unit / time unit]"),
}
"""Quantities that are shown, with symbol and unit."""

LEVEL = "fidelity"
"""The run that the others are compared with."""

STYLES: dict[str, tuple[str, Any, float, str]] = {
    "second_seed": ("0.55", "-", 1.1, "second packing"),
    LEVEL: (COLOURS[0], "-", 2.4, "fidelity {level}"),
    "grid": (COLOURS[1], (0, (3, 1.5)), 1.2, "mesh of 1/8192 from the same state"),
}
"""Colour, line, width [point] and words of each run; later ones lie above earlier ones."""


@styled
def trajectory(dataset: xr.Dataset) -> Figure:
    """Draw γ̇_bulk(t) and V_s(t) of all runs, and below how far the others are from the level.

    A shear rate that is positive throughout has a logarithmic axis.

    Parameters
    ----------
    dataset
        Of `softslip bench trajectory`.
    """
    figure, (above, below) = grid_of_panels(2, len(PANELS), width=WIDE, height=2.2)
    for number, (quantity_name, (symbol, unit)) in enumerate(PANELS.items()):
        series, upper, lower = dataset[quantity_name], above[number], below[number]
        _draw_series(upper, series, dataset.attrs["fidelity"], "ab"[number])
        upper.set(ylabel=f"{symbol} {unit}")
        upper.set_title(f"({'ab'[number]})")
        parted = dataset.sel(quantity=quantity_name)
        _draw_differences(lower, series, "cd"[number])
        lower.set(xlabel=r"time $t$ [time unit]", ylabel=f"difference of {symbol}")
        grid, seed = (100 * float(parted[f"{kind}_difference"]) for kind in ("grid", "seed"))
        for kind, percent in (("grid", grid), ("seed", seed)):
            points = {f"{quantity_name}_rms_difference": Quantity([percent], "%")}
            show(lower, "cd"[number], "rms difference", points, {"run": Quantity(kind)})
        lower.set_title(f"({'cd'[number]}) rms: mesh {grid:.2g} %, packing {seed:.2g} %")
        for axes in (upper, lower):
            axes.set_xlim(0.0, float(series["time"].max()))
    handles, labels = above[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(STYLES))
    size = rf"{int(dataset['particles'])} particles, $\sigma$ = {float(dataset['stress']):g}"
    note(figure, size, "rms differences from $t = 1$ on, over the rms value of the level")
    return figure


def _draw_series(axes: Axes, series: xr.DataArray, level: str, panel: str) -> None:
    """Draw one quantity of all runs over time."""
    for run, (colour, line, width, words) in STYLES.items():
        axes.plot(
            series["time"].values,
            series.sel(run=run).values,
            color=colour,
            linestyle=line,
            linewidth=width,
            label=words.format(level=level),
        )
        one = series.sel(run=run)
        points = {"time": quantity(one["time"]), str(series.name): quantity(one)}
        show(axes, panel, "series", points, {"run": Quantity(run)})
    if float(series.min()) > 0:
        axes.set_yscale("log")
    else:
        axes.axhline(0.0, color="0.5", linewidth=0.5, zorder=0)


def _draw_differences(axes: Axes, series: xr.DataArray, panel: str) -> None:
    """Draw how far the other runs are from the level; what is no difference leaves a gap."""
    axes.set_yscale("log")
    for run, (colour, line, _, _) in STYLES.items():
        if run == LEVEL:
            continue
        apart = np.abs((series.sel(run=run) - series.sel(run=LEVEL)).values)
        shown = np.where(apart > 0, apart, np.nan)
        axes.plot(series["time"].values, shown, color=colour, linestyle=line)
        points = {
            "time": quantity(series["time"]),
            f"{series.name}_difference": quantity(series, shown),
        }
        show(axes, panel, "difference from the level", points, {"run": Quantity(run)})
