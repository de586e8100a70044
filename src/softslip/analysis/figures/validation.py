"""Errors against exact solutions, over whatever was swept."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softslip.analysis.figures.drawing import (
    COLOURS,
    LINES,
    MARKERS,
    WIDE,
    grid_of_panels,
    named,
    note,
    styled,
)
from softslip.analysis.figures.shown import Quantity, coordinates, quantity, show
from softslip.analysis.figures.shown import words as texts

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
    panel of the cylinders has their drag with the exact and the published values. Dashed grey
    lines are the largest acceptable errors; what could not be solved leaves a gap. The colours
    are explained once, above all panels, and in each panel what else was swept.

    Parameters
    ----------
    datasets
        Of `studies.validation.sweep`, in any number.
    """
    panels = [
        (_draw_errors if _has_errors(dataset) else _draw_results, dataset) for dataset in datasets
    ]
    panels += [(_draw_drag, dataset) for dataset in datasets if _has_drag(dataset)]
    rows = max(math.ceil(len(panels) / COLUMNS), 1)
    figure, grid = grid_of_panels(rows, COLUMNS, width=WIDE, height=2.6)
    places = list(itertools.chain.from_iterable(grid))
    for number, (axes, (draw, dataset)) in enumerate(zip(places, panels, strict=False)):
        draw(axes, dataset, chr(ord("a") + number))
        axes.set_title(f"({chr(ord('a') + number)}) {axes.get_title()}", loc="left")
        axes.set_title("")
    for axes in places[len(panels) :]:
        axes.remove()
    _name_colours(figure, datasets)
    note(figure, *(_refused(dataset) for dataset in datasets), _failed(datasets))
    return figure


def _levels(dataset: xr.Dataset) -> list[str]:
    """Return the fidelities that a dataset has lines of."""
    if "fidelity" in dataset.dims:
        return [str(name) for name in dataset["fidelity"].values]
    return [str(dataset.attrs.get("fidelity", ""))]


def _colour(level: str, levels: Sequence[str]) -> str:
    known = [*LEVELS, *(name for name in levels if name not in LEVELS)]
    return COLOURS[known.index(level) % len(COLOURS)]


def _name_colours(figure: Figure, datasets: Sequence[xr.Dataset]) -> None:
    """Explain the colours of all panels at once."""
    present = dict.fromkeys(level for dataset in datasets for level in _levels(dataset) if level)
    names = sorted(present, key=lambda name: LEVELS.index(name) if name in LEVELS else len(LEVELS))
    handles = [Line2D([], [], color=_colour(name, names), marker="o", label=name) for name in names]
    if handles:
        figure.legend(handles=handles, loc="outside upper center", ncols=len(handles))


def _has_drag(dataset: xr.Dataset) -> bool:
    return dataset.attrs["case"] == "cylinders" and "concentration" in dataset.dims


def _numeric(dataset: xr.Dataset, dim: str) -> bool:
    """Return whether the values have places on an axis; a null among numbers has none."""
    values = dataset[dim].values
    return values.dtype.kind in "fiu" and bool(np.isfinite(values).all())


def _along(dataset: xr.Dataset) -> str:
    """Return the dimension that the panel runs along: of several values, numeric, the longest."""
    sizes = {str(dim): dataset.sizes[dim] for dim in dataset["passed"].dims}
    return max(
        sizes,
        key=lambda dim: (sizes[dim] > 1, _numeric(dataset, dim), dim != "fidelity", sizes[dim]),
    )


def _lines(dataset: xr.Dataset, along: str) -> Iterator[tuple[dict[str, Any], str, xr.Dataset]]:
    """Yield for each combination of the other dimensions its style, its words and its values."""
    others = [str(dim) for dim in dataset["passed"].dims if dim not in (along, "fidelity")]
    levels = [""] if along == "fidelity" else _levels(dataset)
    combinations = list(itertools.product(*(range(dataset.sizes[dim]) for dim in others)))
    for name, (kind, places) in itertools.product(levels, enumerate(combinations)):
        part = dataset.isel(dict(zip(others, places, strict=True)))
        if along != "fidelity" and "fidelity" in dataset.dims:
            part = part.sel(fidelity=name)
        words = [named(dim, part[dim].item()) for dim in others if dataset.sizes[dim] > 1]
        style = {
            "color": _colour(name, levels),
            # Between words there is nothing to join.
            "linestyle": LINES[kind % len(LINES)] if _numeric(dataset, along) else "",
            "marker": MARKERS[kind % len(MARKERS)],
        }
        yield style, ", ".join(words), part


def _explain(axes: Axes, dataset: xr.Dataset, along: str) -> None:
    """Explain lines and markers, whatever their colour, where there are several."""
    found = {words: style for style, words, _ in _lines(dataset, along) if words}
    if found:
        handles = [
            Line2D([], [], label=words, **(style | {"color": "0.3"}))
            for words, style in found.items()
        ]
        # Beside the title: there is no curve to cover.
        axes.legend(
            handles=handles,
            fontsize=6.5,
            ncols=len(handles),
            loc="lower right",
            bbox_to_anchor=(1.02, 0.98),
            frameon=False,
        )


def _places(dataset: xr.Dataset, along: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return where the values of a dimension lie on its axis: at their number, if words."""
    if _numeric(dataset, along):
        return np.asarray(dataset[along].values, np.float64)
    return np.arange(dataset.sizes[along], dtype=np.float64)


def _has_errors(dataset: xr.Dataset) -> bool:
    leading = dataset.attrs["leading"]
    return not leading or not bool((dataset[f"{leading}_error"] == 0).all())


def _keep(
    axes: Axes, panel: str, series: str, dataset: xr.Dataset, values: dict[str, xr.DataArray]
) -> None:
    """Keep what is drawn along a dimension, with what else is known of where it belongs."""
    first = next(iter(values.values()))
    (dim,) = first.dims
    along = coordinates(first)[str(dim)]
    numeric = _numeric(first.to_dataset(name="values"), str(dim))
    shown = along if numeric else texts([_text(value) for value in along.tolist()])
    points = {str(dim): quantity(first[dim], shown)}
    points |= {name: quantity(each) for name, each in values.items()}
    case = Quantity(str(dataset.attrs["case"]), "1", "flow with a known solution")
    others = {
        str(name): quantity(each, each.item() if _numeric_item(each) else _text(each.item()))
        for name, each in first.coords.items()
        if each.ndim == 0
    }
    level = str(dataset.attrs.get("fidelity", ""))
    fidelity = {"fidelity": Quantity(level)} if level and "fidelity" not in dataset.dims else {}
    show(axes, panel, series, points, {"case": case} | fidelity | others)


def _numeric_item(value: xr.DataArray) -> bool:
    return value.dtype.kind in "iu" or (value.dtype.kind == "f" and math.isfinite(value.item()))


def _draw_results(axes: Axes, dataset: xr.Dataset, panel: str) -> None:
    """Draw what came out, and what should have: dashed."""
    leading, along = dataset.attrs["leading"], _along(dataset)
    axes.set_title(dataset.attrs["case"])
    _label(axes, dataset, along)
    axes.set_ylabel(leading.replace("_", " "))
    x = _places(dataset, along)
    for style, _, part in _lines(dataset, along):
        axes.plot(x, part[f"{leading}_result"].values, **style)
        wanted = part[f"{leading}_reference"].values
        names = (f"{leading}_result", f"{leading}_reference")
        _keep(axes, panel, "result", dataset, {name: part[name] for name in names})
        grey: dict[str, Any] = (
            {"linestyle": "--"} if style["linestyle"] else {"linestyle": "", "marker": "_"}
        )
        axes.plot(x, wanted, color="0.5", linewidth=0.8, markersize=30, zorder=0, **grey)
    axes.set_ylim(0, 1.2 * float(dataset[f"{leading}_result"].max()))
    _explain(axes, dataset, along)


def _draw_errors(axes: Axes, dataset: xr.Dataset, panel: str) -> None:
    """Draw the leading error, thick, and a tolerance line."""
    leading, along = dataset.attrs["leading"], _along(dataset)
    axes.set_title(dataset.attrs["case"])
    _label(axes, dataset, along)
    axes.set(yscale="log", ylabel=f"error of {leading.replace('_', ' ')}")
    if not leading:
        return
    x = _places(dataset, along)
    for style, _, part in _lines(dataset, along):
        axes.plot(x, _positive(part[f"{leading}_error"].values), **style)
        names = [each for each in (f"{leading}_error", f"bare_{leading}_error") if each in part]
        errors = {each: part[each].copy(data=_positive(part[each].values)) for each in names}
        _keep(axes, panel, "error", dataset, errors)
        if f"bare_{leading}_error" in part:
            faint = {**style, "marker": "", "linestyle": ":", "linewidth": 0.8}
            axes.plot(x, _positive(part[f"bare_{leading}_error"].values), **faint)
    limits = dataset[f"{leading}_tolerance"]
    loosest = limits.max([dim for dim in limits.dims if dim != along])
    axes.plot(x, loosest.values, color="0.5", linestyle="--", linewidth=0.8, zorder=0)
    largest = loosest.assign_attrs(limits.attrs)
    _keep(axes, panel, "largest acceptable error", dataset, {f"{leading}_tolerance": largest})
    _explain(axes, dataset, along)


def _positive(values: Any) -> Any:
    """Return values for a logarithmic axis: an error of exactly zero leaves a gap."""
    return np.where(np.asarray(values) > 0, values, np.nan)


def _draw_drag(axes: Axes, dataset: xr.Dataset, panel: str) -> None:
    """Draw the drag on cylinders over their area fraction."""
    along = "concentration"
    axes.set_title("cylinders: drag")
    x = _places(dataset, along)
    for style, _, part in _lines(dataset, along):
        axes.plot(x, part["drag_result"].values, **{**style, "linestyle": ""})
        _keep(axes, panel, "result", dataset, {"drag_result": part["drag_result"]})
    exact = dataset["bare_drag_reference"]
    exact = exact.mean([dim for dim in exact.dims if dim != along])
    axes.plot(x, exact.values, color="0.3", zorder=0, label="exact, without regularisation")
    bare = dataset["bare_drag_reference"].attrs
    exact = exact.assign_attrs(bare)
    _keep(axes, panel, "exact, without regularisation", dataset, {"bare_drag_reference": exact})
    values = list(PUBLISHED_DRAG.values())
    label = "Sangani & Acrivos (1982)"
    axes.plot(list(PUBLISHED_DRAG), values, "+", color="k", markersize=9, label=label)
    places = quantity(dataset[along], list(PUBLISHED_DRAG))
    known = {
        along: places,
        "published_drag": Quantity(values, "1", "drag over viscosity and speed"),
    }
    show(axes, panel, label, known, {"case": Quantity(str(dataset.attrs["case"]))})
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
