"""Creep curves (Fig. 8a-c)."""

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
    facets,
    grid_of_panels,
    named,
    note_missing,
    sequence,
    styled,
    with_dimensions,
)
from softslip.analysis.figures.shown import place, quantity, show
from softslip.analysis.observables import mean_over_seeds

THIN, THICK = 0.5, 1.4
"""Line widths of a single run and of a mean over runs [point]."""


@styled
def creep(dataset: xr.Dataset) -> Figure:
    """Draw the apparent shear rate at the roughest and smoothest wall, and the bulk's at all.

    Colours are stresses. In the first two panels thin lines are single runs where there are
    several seeds, thick ones their mean; in the third each line style is a roughness, averaged
    over seeds. Rates that are not positive leave gaps, and the figure says so. Further
    dimensions get a row of panels each.

    Parameters
    ----------
    dataset
        From `analysis.observables.creep`.
    """
    single = with_dimensions(dataset, "stress", "roughness")
    mean = with_dimensions(mean_over_seeds(dataset), "stress", "roughness")
    rows = facets(mean, "stress", "roughness")
    figure, panels = grid_of_panels(len(rows), 3, width=WIDE, height=2.9)
    for (title, chosen), axes in zip(rows, panels, strict=True):
        _draw_row(single.sel(chosen), mean.sel(chosen), axes)
        axes[0].set_ylabel(f"{title}\n" * bool(title) + "shear rate [1 / time unit]")
    _add_legends(figure, panels[0][2], mean)
    rates = [mean[name].values for name in ("shear_rate_wall", "shear_rate_bulk")]
    with np.errstate(invalid="ignore"):
        gaps = any((rate <= 0).any() for rate in rates)
    note_missing(figure, dataset, "gaps: rate not positive" if gaps else "")
    return figure


def _draw_row(single: xr.Dataset, mean: xr.Dataset, axes: list[Axes]) -> None:
    roughnesses = mean["roughness"].values
    order = np.argsort(np.nan_to_num(roughnesses))
    ends = [(order[-1], "a"), (order[0], "b")]
    for (number, letter), panel in zip(ends, axes, strict=False):
        if "seed" in single.dims and single.sizes["seed"] > 1:
            for seed in range(single.sizes["seed"]):
                runs = single.isel(roughness=number, seed=seed)
                _draw_bundle(panel, runs, "shear_rate_wall", "-", THIN)
                _keep_bundle(panel, letter, "run", runs, "shear_rate_wall")
        _draw_bundle(panel, mean.isel(roughness=number), "shear_rate_wall", "-", THICK)
        _keep_bundle(panel, letter, "mean", mean.isel(roughness=number), "shear_rate_wall")
        words = named("roughness", roughnesses[number])
        panel.set_title(rf"({letter}) $\dot\gamma_\mathrm{{wall}}$, {words}".rstrip(", "))
    for number, index in enumerate(order):
        style = LINES[number % len(LINES)]
        _draw_bundle(axes[2], mean.isel(roughness=index), "shear_rate_bulk", style, THIN + 0.5)
        _keep_bundle(axes[2], "c", "mean", mean.isel(roughness=index), "shear_rate_bulk")
    axes[2].set_title(r"(c) $\dot\gamma_\mathrm{bulk}$, all $\beta$")
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


def _add_legends(figure: Figure, bulk: Axes, mean: xr.Dataset) -> None:
    """Explain the colours above the panels and the line styles in the first panel of the bulk."""
    stresses = mean["stress"].values
    colours = [
        Line2D([], [], color=colour, linewidth=THICK, label=named("stress", stress))
        for colour, stress in zip(sequence(len(stresses)), stresses, strict=True)
        if named("stress", stress)
    ]
    if colours:
        figure.legend(handles=colours[::-1], loc="outside upper center", ncols=min(len(colours), 8))
    styles = [
        Line2D([], [], color="0.3", linestyle=LINES[n % len(LINES)], label=named("roughness", each))
        for n, each in enumerate(np.sort(mean["roughness"].values))
        if named("roughness", each)
    ]
    if styles:
        bulk.legend(handles=styles, loc="lower left")
