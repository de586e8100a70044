"""Errors against exact solutions, over whatever was swept."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.figures.drawing import (
    COLOURS,
    LINES,
    MARKERS,
    WIDE,
    grid_of_panels,
    named,
    note,
    styled,
)

LEVELS = ("literal", "preview", "standard", "paper", "converged")
"""Fidelities in the order of their colours; others come after."""

PUBLISHED_DRAG: Mapping[float, float] = {
    0.05: 15.56,
    0.10: 24.83,
    0.20: 51.53,
    0.30: 102.90,
    0.40: 217.89,
    0.50: 532.55,
}
"""Drag F/(ηU) of square arrays of cylinders by area fraction (Sangani & Acrivos 1982)."""

WIDE_RANGE = 20.0
"""Ratio of the largest to the smallest value of an axis beyond which it is logarithmic."""

COLUMNS = 2


@styled
def validation(*datasets: xr.Dataset) -> Figure:
    """Draw the leading error of each case over what was swept, a colour a fidelity.

    A case that has no error anywhere is shown by its results beside what they should be. A second
    panel of the cylinders has their drag with the exact and the published values. Dashed
    grey lines are the largest acceptable errors; what could not be solved leaves a gap.

    Parameters
    ----------
    datasets
        Of `softslip.validation.sweep`, in any number.
    """
    panels = [
        (_draw_errors if _has_errors(dataset) else _draw_results, dataset) for dataset in datasets
    ]
    panels += [(_draw_drag, dataset) for dataset in datasets if _has_drag(dataset)]
    rows = max(math.ceil(len(panels) / COLUMNS), 1)
    figure, grid = grid_of_panels(rows, COLUMNS, width=WIDE, height=2.6)
    places = list(itertools.chain.from_iterable(grid))
    for number, (axes, (draw, dataset)) in enumerate(zip(places, panels, strict=False)):
        draw(axes, dataset)
        axes.set_title(f"({chr(ord('a') + number)}) {axes.get_title()}")
    for axes in places[len(panels) :]:
        axes.remove()
    note(figure, *(_refused(dataset) for dataset in datasets), _failed(datasets))
    return figure


def _has_drag(dataset: xr.Dataset) -> bool:
    return dataset.attrs["case"] == "cylinders" and "concentration" in dataset.dims


def _numeric(dataset: xr.Dataset, dim: str) -> bool:
    """Return whether the values have places on an axis; a null among numbers has none."""
    values = dataset[dim].values
    return values.dtype.kind in "fiu" and bool(np.isfinite(values).all())


def _along(dataset: xr.Dataset, prefer: str | None = None) -> str:
    """Return the dimension that the panel runs along: a numeric one if there is, the longest."""
    dims = [str(dim) for dim in dataset["passed"].dims]
    if prefer in dims:
        return str(prefer)
    return max(
        dims, key=lambda dim: (_numeric(dataset, dim), dim != "fidelity", dataset.sizes[dim])
    )


def _lines(dataset: xr.Dataset, along: str) -> Iterator[tuple[dict[str, Any], str, xr.Dataset]]:
    """Yield for each combination of the other dimensions its style, its words and its values."""
    others = [str(dim) for dim in dataset["passed"].dims if dim not in (along, "fidelity")]
    level = str(dataset.attrs.get("fidelity", ""))
    levels = dataset["fidelity"].values.tolist() if "fidelity" in dataset.dims else [level]
    if along == "fidelity":
        levels = [""]
    known = [*LEVELS, *(name for name in levels if name not in LEVELS)]
    combinations = list(itertools.product(*(range(dataset.sizes[dim]) for dim in others)))
    for name, (kind, places) in itertools.product(levels, enumerate(combinations)):
        part = dataset.isel(dict(zip(others, places, strict=True)))
        if along != "fidelity" and "fidelity" in dataset.dims:
            part = part.sel(fidelity=name)
        words = [name, *(named(dim, part[dim].item()) for dim in others)]
        style = {
            "color": COLOURS[known.index(name) % len(COLOURS)],
            "linestyle": LINES[kind % len(LINES)],
            "marker": MARKERS[kind % len(MARKERS)],
        }
        yield style, ", ".join(word for word in words if word), part


def _places(dataset: xr.Dataset, along: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return where the values of a dimension lie on its axis: at their number, if words."""
    if _numeric(dataset, along):
        return np.asarray(dataset[along].values, np.float64)
    return np.arange(dataset.sizes[along], dtype=np.float64)


def _has_errors(dataset: xr.Dataset) -> bool:
    leading = dataset.attrs["leading"]
    return not leading or not bool((dataset[f"{leading}_error"] == 0).all())


def _draw_results(axes: Axes, dataset: xr.Dataset) -> None:
    """Draw what came out, and what should have: dashed."""
    leading, along = dataset.attrs["leading"], _along(dataset)
    axes.set_title(dataset.attrs["case"])
    _label(axes, dataset, along)
    axes.set_ylabel(leading.replace("_", " "))
    x = _places(dataset, along)
    for style, words, part in _lines(dataset, along):
        axes.plot(x, part[f"{leading}_result"].values, label=words, **style)
        wanted = part[f"{leading}_reference"].values
        axes.plot(x, wanted, color="0.5", linestyle="--", linewidth=0.8, zorder=0)
    axes.set_ylim(0, 1.2 * float(dataset[f"{leading}_result"].max()))
    handles, labels = axes.get_legend_handles_labels()
    if any(labels):
        axes.legend(handles, labels, fontsize=6.5)


def _draw_errors(axes: Axes, dataset: xr.Dataset) -> None:
    """Draw the leading error, thick, and a tolerance line."""
    leading, along = dataset.attrs["leading"], _along(dataset)
    axes.set_title(dataset.attrs["case"])
    _label(axes, dataset, along)
    axes.set(yscale="log", ylabel=f"error of {leading.replace('_', ' ')}")
    if not leading:
        return
    x = _places(dataset, along)
    for style, words, part in _lines(dataset, along):
        axes.plot(x, _positive(part[f"{leading}_error"].values), label=words, **style)
        if f"bare_{leading}_error" in part:
            faint = {**style, "marker": "", "linestyle": ":", "linewidth": 0.8}
            axes.plot(x, _positive(part[f"bare_{leading}_error"].values), **faint)
    limits = dataset[f"{leading}_tolerance"]
    loosest = limits.max([dim for dim in limits.dims if dim != along])
    axes.plot(x, loosest.values, color="0.5", linestyle="--", linewidth=0.8, zorder=0)
    handles, labels = axes.get_legend_handles_labels()
    if any(labels):
        axes.legend(handles, labels, fontsize=6.5, ncols=2)


def _positive(values: Any) -> Any:
    """Return values for a logarithmic axis: an error of exactly zero leaves a gap."""
    return np.where(np.asarray(values) > 0, values, np.nan)


def _draw_drag(axes: Axes, dataset: xr.Dataset) -> None:
    """Draw the drag on cylinders over their area fraction."""
    along = "concentration"
    axes.set_title("cylinders: drag")
    x = _places(dataset, along)
    for style, words, part in _lines(dataset, along):
        axes.plot(x, part["drag_result"].values, label=words, **{**style, "linestyle": ""})
    exact = dataset["bare_drag_reference"]
    exact = exact.mean([dim for dim in exact.dims if dim != along])
    axes.plot(x, exact.values, color="0.3", zorder=0, label="exact, without regularisation")
    values = list(PUBLISHED_DRAG.values())
    label = "Sangani & Acrivos (1982)"
    axes.plot(list(PUBLISHED_DRAG), values, "+", color="k", markersize=9, label=label)
    _label(axes, dataset, along)
    axes.set(yscale="log", ylabel=r"drag $F/\eta U$")
    axes.legend(fontsize=6.5)


def _label(axes: Axes, dataset: xr.Dataset, along: str) -> None:
    """Name the axis of a dimension, and choose its scale."""
    words, units = along.replace("_", " "), dataset[along].attrs.get("units", "1")
    axes.set_xlabel(words if units == "1" else f"{words} [{units}]")
    x = _places(dataset, along)
    numeric = _numeric(dataset, along)
    if numeric and np.min(x) > 0 and np.max(x) / np.min(x) > WIDE_RANGE:
        axes.set_xscale("log")
    elif numeric:
        return
    axes.set_xticks(x, [_text(value) for value in dataset[along].values.tolist()])
    axes.tick_params(axis="x", which="minor", bottom=False, top=False, labelbottom=False)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if math.isfinite(value) else "null"
    return str(value)


def _refused(dataset: xr.Dataset) -> str:
    """Return how many combinations of a case could not be solved, in words."""
    count = int((dataset["refusal"].astype(str) != "").sum())
    case = dataset.attrs["case"]
    return f"{case}: {count} of {dataset['refusal'].size} refused" if count else ""


def _failed(datasets: Sequence[xr.Dataset]) -> str:
    solved = sum(int((dataset["refusal"].astype(str) == "").sum()) for dataset in datasets)
    passed = sum(int(dataset["passed"].sum()) for dataset in datasets)
    return f"{passed} of {solved} solved within their tolerances"
