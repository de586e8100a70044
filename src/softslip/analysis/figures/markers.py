"""Points by the verdict on their steady state, with bars, and the paper's numbers beside them."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STEADY, WITHIN_ERROR, DRIFTING = "steady", "steady within its error", "drifting"
"""Verdicts that are drawn differently: filled, half filled, and open with a dashed bar."""

LEAST_SHARE = 1e-2
"""Lower end of an error bar that reaches zero, over its value, on a logarithmic axis."""

DASHES = (0, (2, 1.5))
"""Bars that span a drift."""

MEANINGS = {
    STEADY: "filled: steady, bars are standard errors",
    WITHIN_ERROR: "half filled: no trend, but a large standard error",
    DRIFTING: "open: drifting, dashed bars span the drift",
}
"""What symbols mean, in the order in which they are explained."""


ALL_STEADY = "bars: standard errors"
"""What is said where all symbols are filled."""


def verdicts(cell: xr.Dataset, flag: str) -> NDArray[Any]:
    """Return the verdict on each value of a series, raveled: one of the three that are drawn.

    Parameters
    ----------
    cell
        Some of a table of steady averages.
    flag
        Which series: ``steady_wall``, ``steady_bulk`` or ``steady_slip``.
    """
    steady = cell[flag].values.ravel()
    found = np.where(steady, STEADY, DRIFTING).astype(object)
    name = flag.replace("steady", "verdict")
    if name in cell:
        found[steady & (cell[name].values.ravel() == WITHIN_ERROR)] = WITHIN_ERROR
    return found


def worse(one: NDArray[Any], other: NDArray[Any]) -> NDArray[Any]:
    """Return the worse one of two verdicts on each of some values."""
    order = list(MEANINGS)
    pairs = zip(one, other, strict=True)
    return np.array([max(pair, key=order.index) for pair in pairs], dtype=object)


def explained(table: xr.Dataset, *flags: str) -> str:
    """Say what the symbols mean that occur in a figure; only the bars, if all are alike steady."""
    done = (table["status"] == "done").values.ravel()
    seen = {str(each) for flag in flags for each in verdicts(table, flag)[done]}
    if seen <= {STEADY}:
        return ALL_STEADY
    return "; ".join(words for verdict, words in MEANINGS.items() if verdict in seen)


def draw_points(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    error: FloatArray,
    verdict: NDArray[Any],
    look: dict[str, Any],
    *,
    along: str = "y",
) -> None:
    """Draw points, filled where steady, half filled where only within their error, open otherwise.

    Parameters
    ----------
    axes
        Where; on a logarithmic axis a bar that reaches zero ends at `LEAST_SHARE` of the value.
    x, y, error
        Shape (points,); the error is that of x or y, or of shape (2, points) where it differs
        downwards and upwards.
    verdict
        Of each point.
    look
        Colour, marker and size.
    along
        Which of x and y the error belongs to.
    """
    down, up = np.broadcast_to(np.nan_to_num(error), (2, len(x)))
    scale = axes.get_xscale() if along == "x" else axes.get_yscale()
    value = x if along == "x" else y
    below = np.minimum(down, (1 - LEAST_SHARE) * value) if scale == "log" else down
    bars = np.stack((below, up))
    for state in MEANINGS:
        chosen = (verdict == state) & np.isfinite(x) & np.isfinite(y)
        if not chosen.any():
            continue
        drawn = axes.errorbar(
            x[chosen],
            y[chosen],
            xerr=bars[:, chosen] if along == "x" else None,
            yerr=bars[:, chosen] if along == "y" else None,
            linestyle="none",
            elinewidth=0.8,
            zorder=3 if state == STEADY else 2.5,
            **look,
            **_filling(state, look["color"]),
        )
        if state == DRIFTING:
            for collection in drawn.lines[2]:
                collection.set_linestyle(DASHES)


def _filling(state: str, colour: Any) -> dict[str, Any]:
    if state == WITHIN_ERROR:
        return {
            "fillstyle": "bottom",
            "markerfacecolor": colour,
            "markerfacecoloralt": "white",
            "markeredgecolor": colour,
        }
    return {"markerfacecolor": colour if state == STEADY else "white"}
