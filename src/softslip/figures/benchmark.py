"""Where the time of an evaluation goes, and how much faster than the paper's scheme it all is."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.figures.drawing import COLOURS, WIDE, grid_of_panels, note, styled

BARS = {
    ("mobility", "ratio"): "evaluation,\nsame nodes",
    ("mobility", "own_ratio"): "evaluation,\nown nodes",
    ("run", "ratio"): "simulated\ntime",
    ("memory", "ratio"): "memory",
}
"""Ratios that are shown, by benchmark and variable, and what is under their bars."""


@styled
def benchmark(scaling: xr.Dataset, *others: xr.Dataset) -> Figure:
    """Draw the time per node of each part of an evaluation, and the ratios to the paper's scheme.

    Parameters
    ----------
    scaling
        Of `softslip bench scaling`.
    others
        Of the other benchmarks, in any order; what is missing is left out.
    """
    figure, ((left, right),) = grid_of_panels(1, 2, width=WIDE, height=2.9)
    _draw_parts(left, scaling)
    _draw_ratios(right, others)
    for axes in (left, right):  # Between names there is nothing to mark.
        axes.tick_params(axis="x", which="both", bottom=False, top=False)
    note(figure, *(_size(dataset) for dataset in others))
    return figure


def _draw_parts(axes: Axes, scaling: xr.Dataset) -> None:
    """Stack the parts over the number of particles."""
    table = scaling["nanoseconds"].transpose("part", "particles")
    places = np.arange(table.sizes["particles"])
    # What remains after the parts may come out below zero by the jitter of the clock.
    heights = np.maximum(table.values, 0.0)
    below = np.cumsum(heights, axis=0) - heights
    for number, (part, height) in enumerate(zip(table["part"].values, heights, strict=True)):
        colour = COLOURS[number] if number < len(COLOURS) else "0.7"
        axes.bar(places, height, bottom=below[number], color=colour, width=0.8, label=str(part))
    axes.set_xticks(places, [str(count) for count in table["particles"].values])
    axes.set(xlabel="particles $N$", ylabel="time per node and evaluation [ns]")
    axes.set_ylim(0, 1.6 * float(heights.sum(axis=0).max()))
    axes.legend(loc="upper center", ncols=3, reverse=True)
    exponent = scaling.get("exponent")
    law = "" if exponent is None else rf", time $\propto N^{{{float(exponent):.2f}}}$"
    axes.set_title(f"(a) {scaling.attrs['fidelity']}{law}")


def _draw_ratios(axes: Axes, others: tuple[xr.Dataset, ...]) -> None:
    """Draw a bar for each ratio."""
    by_name = {dataset.attrs["bench"]: dataset for dataset in others}
    shown = {
        words: float(by_name[bench][name])
        for (bench, name), words in BARS.items()
        if bench in by_name
    }
    bars = axes.bar(list(shown), list(shown.values()), color=COLOURS[0], width=0.6)
    axes.bar_label(bars, fmt="%.3g", padding=2)
    if shown:
        axes.set(yscale="log", ylim=(0.8, 3 * max(1.0, *shown.values())))
    axes.axhline(1.0, color="0.5", linewidth=0.7)
    axes.set(ylabel="cost of the paper's scheme, relative")
    axes.set_title("(b) the paper's scheme over this one")


def _size(dataset: xr.Dataset) -> str:
    attrs = dataset.attrs
    return f"{attrs['bench']}: {int(dataset['particles'])} particles, {attrs['fidelity']}"
