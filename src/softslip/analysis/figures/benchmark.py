"""Where the time of an evaluation goes, and how much faster than the paper's scheme it all is."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from softslip.analysis.figures.drawing import COLOURS, WIDE, grid_of_panels, note, styled
from softslip.analysis.figures.shown import Quantity, quantity, show

BARS = {
    ("mobility", "ratio"): "evaluation,\nsame nodes",
    ("mobility", "own_ratio"): "evaluation,\nown nodes",
    ("run", "ratio"): "simulated\ntime",
    ("run", "memory_ratio"): "memory",
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
        Of the other benchmarks, in any order, each for any numbers of particles; what is missing
        is left out.
    """
    figure, ((left, right),) = grid_of_panels(1, 2, width=WIDE, height=2.9)
    _draw_parts(left, scaling)
    _draw_ratios(right, others)
    for axes in (left, right):  # Between names there is nothing to mark.
        axes.tick_params(axis="x", which="both", bottom=False, top=False)
    note(figure, *_sizes(others))
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
        points = {
            "particles": quantity(table["particles"]),
            "nanoseconds": quantity(table, height),
        }
        show(axes, "a", "time of a part", points, {"part": Quantity(str(part))})
    axes.set_xticks(places, [str(count) for count in table["particles"].values])
    axes.set(xlabel="particles $N$", ylabel="time per node and evaluation [ns]")
    axes.set_ylim(0, 1.6 * float(heights.sum(axis=0).max()))
    axes.legend(loc="upper center", ncols=3, reverse=True)
    exponent = scaling.get("exponent")
    if exponent is not None:
        points = {"exponent": quantity(exponent, [float(exponent)])}
        show(axes, "a", "exponent of the time over the particles", points)
    law = "" if exponent is None else rf", time $\propto N^{{{float(exponent):.2f}}}$"
    axes.set_title(f"(a) {scaling.attrs['fidelity']}{law}")


def _draw_ratios(axes: Axes, others: tuple[xr.Dataset, ...]) -> None:
    """Draw for each ratio a bar a number of particles."""
    sizes = sorted({int(dataset["particles"]) for dataset in others})
    ratios = [key for key in BARS if key[0] in {dataset.attrs["bench"] for dataset in others}]
    width = 0.8 / max(len(sizes), 1)
    for number, size in enumerate(sizes):
        found = {
            place: float(dataset[name])
            for place, (bench, name) in enumerate(ratios)
            for dataset in others
            if dataset.attrs["bench"] == bench and name in dataset
            if int(dataset["particles"]) == size
        }
        places = np.array(list(found)) + (number - 0.5 * (len(sizes) - 1)) * width
        colour = COLOURS[number % len(COLOURS)]
        bars = axes.bar(places, list(found.values()), color=colour, width=width, label=str(size))
        axes.bar_label(bars, fmt="%.3g", padding=2, fontsize=7.5)
        for place, height in found.items():
            bench, name = ratios[place]
            whose = {"benchmark": Quantity(bench), "variable": Quantity(name)}
            points = {"particles": Quantity([size]), "ratio": Quantity([height])}
            show(axes, "b", "cost of the paper's scheme, relative", points, whose)
    if ratios:
        largest = max(bar.get_height() for bar in axes.patches if isinstance(bar, Rectangle))
        axes.set(yscale="log", ylim=(0.8, 8 * max(1.0, largest)))
        axes.set_xticks(range(len(ratios)), [BARS[key] for key in ratios])
        axes.legend(loc="upper left", title="particles $N$", ncols=len(sizes))
    axes.axhline(1.0, color="0.5", linewidth=0.7)
    axes.set(ylabel="cost of the paper's scheme, relative")
    axes.set_title("(b) the paper's scheme over this one")


def _sizes(others: tuple[xr.Dataset, ...]) -> list[str]:
    """Return for each benchmark and level the numbers of particles, in words."""
    found: dict[str, list[int]] = {}
    for dataset in others:
        name = f"{dataset.attrs['bench']} ({dataset.attrs['fidelity']})"
        found.setdefault(name, []).append(int(dataset["particles"]))
    return [f"{name}: N = {', '.join(map(str, sorted(counts)))}" for name, counts in found.items()]
