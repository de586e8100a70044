"""Where the scheme is stable: the map of stability, and the longest stable steps."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from softslip.analysis.figures.drawing import COLOURS, MARKERS, WIDE, grid_of_panels, note, styled
from softslip.analysis.figures.shown import Quantity, quantity, show, words

VERDICTS = {
    "correct": ("#8fd0b6", "correct"),
    "stopped": ("#f3d58a", "stopped with a clear error"),
    "wrong": ("#d5451b", "wrong"),
}
"""Colour and words of each verdict."""

AXES = {
    "step_euler": r"Euler step, $\Delta t\,\rho/2$",
    "step_rkc2": r"step asked of rkc2, $\Delta t\,\rho/2$",
    "step_imex_rkc2": r"step asked of imex_rkc2, $\Delta t\,\rho/2$",
    "stress": r"stress $\sigma$",
    "membrane_modulus": r"membrane modulus $K_\mathrm{e}$",
    "wall_stiffness": r"tether constant $K_\mathrm{w}$",
    "contact_energy": r"contact energy $K_\mathrm{LJ}$",
    "contact_range": r"contact range $\sigma_\mathrm{LJ}/dx_\mathrm{ref}$",
    "roughness": r"roughness $\beta$",
    "area_fraction": r"area fraction $\phi$",
    "wall_separation": r"wall separation $H/\bar R$",
    "particles": r"number of particles",
    "rest": r"explicit steps at rest",
    "far_shear": r"periods the walls are sheared",
    "printed_control": r"wall speed, solvent outside",
}
"""What each group varies."""

SCHEMES = {"standard": "level 'standard'", "literal": "mesh and Euler steps"}
"""Columns of the map."""

LETTERS = 330.0
"""Size of a letter that would fill a row by itself [point]."""

ROW = 0.3
"""Height of a row of the map [inch]."""


@styled
def stability_map(dataset: xr.Dataset) -> Figure:
    """Draw a cell for each run: groups as rows, values as cells, colours for the verdicts.

    Parameters
    ----------
    dataset
        Of `studies.stability.gather`.
    """
    groups = list(dict.fromkeys(dataset["group"].values.tolist()))
    figure = Figure(figsize=(WIDE, ROW * len(groups) + 1.0), layout="constrained")
    columns = figure.subplots(1, len(SCHEMES), sharey=True)
    widest = max(int((dataset["group"] == name).sum()) for name in groups)
    for axes, (scheme, title) in zip(columns, SCHEMES.items(), strict=True):
        shown = dataset.isel(cell=np.flatnonzero(dataset["scheme"].values == scheme))
        rows = [shown.isel(cell=np.flatnonzero(shown["group"].values == name)) for name in groups]
        widest = max(row.sizes["cell"] for row in rows)
        for number, row in enumerate(rows):
            _draw_row(axes, number, row, widest)
            _keep_row(axes, scheme, groups[number], row)
        axes.set(xlim=(0, 1), ylim=(len(groups) - 0.5, -0.5), xticks=[])
        axes.set_title(title)
        axes.tick_params(which="both", left=False, right=False, top=False, bottom=False)
        axes.spines[:].set_visible(False)
    columns[0].set_yticks(range(len(groups)), [AXES.get(name, name) for name in groups])
    patches = [Patch(color=colour, label=verdict) for colour, verdict in VERDICTS.values()]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))
    counts = ", ".join(f"{int((dataset['verdict'] == name).sum())} {name}" for name in VERDICTS)
    note(figure, f"{dataset.sizes['cell']} cells: {counts}", "values grow from left to right")
    return figure


def _keep_row(axes: Axes, scheme: str, group: str, row: xr.Dataset) -> None:
    """Keep the cells of a group from left to right."""
    points = {
        "place": Quantity(np.arange(row.sizes["cell"]), "1", "number of the cell in its row"),
        "label": quantity(row["label"], words(row["label"].values)),
        "verdict": quantity(row["verdict"], words(row["verdict"].values)),
    }
    show(axes, scheme, "cells", points, {"group": Quantity(group, "1", "what is varied")})


def _draw_row(axes: Axes, number: int, row: xr.Dataset, widest: int) -> None:
    """Draw the cells of a group side by side, as wide as the row with most cells needs."""
    count = row.sizes["cell"]
    width = 1.0 / max(count, min(widest, 6))
    for place in range(count):
        colour, _ = VERDICTS[str(row["verdict"].values[place])]
        axes.barh(
            number, width, left=place * width, height=0.86, color=colour, edgecolor="w", lw=0.8
        )
        text = str(row["label"].values[place]).replace(", ", "\n")
        middle = (place + 0.5) * width
        size = LETTERS / max(map(len, text.split("\n"))) * width
        axes.text(
            middle,
            number,
            text,
            ha="center",
            va="center",
            fontsize=min(size, 6.0 if "\n" in text else 7.0),
            linespacing=0.85,
        )


@styled
def stability_limit(dataset: xr.Dataset) -> Figure:
    """Draw the longest stable steps that were measured against those of the theory.

    Parameters
    ----------
    dataset
        Of `studies.stability.measure_limits`.
    """
    figure, ((left, right),) = grid_of_panels(1, 2, width=WIDE, height=2.9)
    _draw_euler(left, dataset)
    _draw_stages(right, dataset)
    note(
        figure,
        r"Theory: $2/\rho$ and $\frac{2}{3}(s^2-1)(1-\frac{2}{15}\varepsilon)/\rho$, "
        r"$\rho$ from a converged power iteration",
    )
    return figure


def _draw_euler(axes: Axes, dataset: xr.Dataset) -> None:
    theory, limit = dataset["euler_theory"].values, dataset["euler_limit"].values
    names = (dataset[name].values.tolist() for name in ("mobility", "roughness"))
    kinds = list(dict.fromkeys(zip(*names, strict=True)))
    ends = np.array([0.7 * theory.min(), 1.4 * theory.max()])
    axes.plot(ends, ends, color="0.5", linewidth=0.7, zorder=0, label="theory")
    for number, (mobility, roughness) in enumerate(kinds):
        chosen = (dataset["mobility"].values == mobility) & (
            dataset["roughness"].values == roughness
        )
        axes.plot(
            theory[chosen],
            limit[chosen],
            MARKERS[number % len(MARKERS)],
            color=COLOURS[number % len(COLOURS)],
            markerfacecolor="none",
            label=f"{mobility}, $\\beta$ = {roughness:g}",
        )
        points = {
            name: quantity(dataset[name], values[chosen])
            for name, values in (("euler_theory", theory), ("euler_limit", limit))
        }
        at = {"mobility": Quantity(mobility), "roughness": Quantity(roughness)}
        show(axes, "a", "explicit Euler", points, at)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.set(xlabel=r"$2/\rho$ [time unit]", ylabel=r"longest stable $\Delta t$ [time unit]")
    axes.set_title("(a) explicit Euler")
    axes.legend(loc="upper left")


def _draw_stages(axes: Axes, dataset: xr.Dataset) -> None:
    stages = dataset["stages"].values
    for name, style, label in (
        ("rkc2_theory", "-", "theory"),
        ("rkc2_limit", "o", "measured"),
    ):
        points = {"stages": quantity(dataset["stages"]), name: quantity(dataset[name])}
        show(axes, "b", f"rkc2, {label}", points)
        axes.plot(
            stages,
            dataset[name].values,
            style,
            color="0.5" if style == "-" else COLOURS[0],
            markerfacecolor="none",
            label=label,
        )
    axes.set(xscale="log", yscale="log", xlabel=r"stages $s$", ylabel=r"$\Delta t$ [time unit]")
    ticks = [str(int(each)) for each in stages]
    axes.set_xticks(stages, ticks)
    axes.set_xticks([], minor=True)
    axes.set_title("(b) rkc2")
    axes.legend(loc="upper left")
