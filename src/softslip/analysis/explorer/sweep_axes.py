"""What was swept, as the page filters and colours runs by it."""

from typing import Any

import numpy as np
import xarray as xr

from softslip.analysis.explorer.embedding import embedded
from softslip.analysis.figures.drawing import COLOURS, MARKERS, sequence
from softslip.analysis.figures.panels import ROUGHNESS

SYMBOLS = {
    "o": "circle",
    "s": "square",
    "^": "triangle-up",
    "D": "diamond",
    "v": "triangle-down",
    "<": "triangle-left",
    ">": "triangle-right",
    "p": "pentagon",
}
"""Markers of the figures, and what plotly calls them."""


def sweep_axes(
    table: xr.Dataset, runs: np.ndarray[Any, np.dtype[np.bool_]]
) -> list[dict[str, Any]]:
    """Return the axes of a table over runs for JSON, whatever they are.

    Parameters
    ----------
    table
        From `analysis.observables.flow_curve`.
    runs
        Which of its runs the page has, shape of its ``status``.

    Returns
    -------
    list of dict
        Name, symbol, unit and meaning of each; its ``values``, numbers (``whole`` or not) or texts,
        with a colour and a marker each; ``of``, which of them each run has.
    """
    dims = table["status"].dims
    places = np.nonzero(runs)
    return [
        {
            **_named(table[dim], str(dim)),
            "values": table[dim].values.tolist(),
            "whole": table[dim].dtype.kind in "iu",
            **_looks(table[dim]),
            "of": embedded(place, "u4"),
        }
        for dim, place in zip(dims, places, strict=True)
    ]


def shared_values(table: xr.Dataset) -> list[dict[str, Any]]:
    """Return what all runs of a table have in common and it names, for JSON."""
    return [
        {**_named(value, str(name)), "value": value.item()}
        for name, value in table.coords.items()
        if value.ndim == 0
    ]


def usual_colours(axes: list[dict[str, Any]]) -> str:
    """Return the axis that colours stand for at first: the roughness, or the first with several."""
    several = [str(axis["name"]) for axis in axes if len(axis["values"]) > 1]
    names = several or [str(axis["name"]) for axis in axes]
    return ROUGHNESS if ROUGHNESS in names else next(iter(names), "")


def _named(values: xr.DataArray, name: str) -> dict[str, str]:
    attributes = values.attrs
    return {
        "name": name,
        "symbol": str(attributes.get("symbol", "")),
        "unit": str(attributes.get("units", "1")),
        "meaning": str(attributes.get("long_name", name.replace("_", " "))),
    }


def _looks(values: xr.DataArray) -> dict[str, list[str]]:
    """Return a colour and a marker for each value: a scale where there are more than colours."""
    count = values.size
    colours = [COLOURS[number % len(COLOURS)] for number in range(count)]
    if count > len(COLOURS) and values.dtype.kind in "fiu":
        colours = [_hexadecimal(colour) for colour in sequence(count)]
    markers = [SYMBOLS[MARKERS[number % len(MARKERS)]] for number in range(count)]
    return {"colours": colours, "markers": markers}


def _hexadecimal(colour: tuple[float, ...]) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour[:3])
