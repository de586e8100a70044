"""The paper's numbers beside ours."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from softslip.analysis.figures.shown import Quantity, show
from softslip.analysis.paper import Reported

FloatArray = NDArray[np.float64]

GREY, DASHED = "0.45", (0, (4, 2))
"""Colour and line of what the paper reports."""

WORDS = 7.5
"""Size of the paper's numbers [point]."""


def as_text(number: Reported) -> str:
    """Return one of the paper's numbers with its symbol and error."""
    error = "" if number.uncertainty is None else rf" \pm {number.uncertainty:g}"
    return rf"${number.symbol} = {number.value:g}{error}$"


def keep(axes: Axes, panel: str, name: str, number: Reported) -> None:
    """Keep one of the paper's numbers among what a figure shows."""
    known = {name: number.value, f"{name}_error": number.uncertainty}
    points = {
        key: Quantity([np.nan if each is None else each], number.unit, key.replace("_", " "))
        for key, each in known.items()
    }
    show(axes, panel, f"{name.replace('_', ' ')} of the paper", points)


def mark_level(axes: Axes, panel: str, name: str, number: Reported, words: str = "") -> None:
    """Draw one of the paper's numbers as a level of the vertical axis, with its error as a band.

    ``words`` are written below it at the right, where no flow curve comes.
    """
    keep(axes, panel, name, number)
    error = number.uncertainty or 0.0
    axes.axhspan(number.value - error, number.value + error, color="0.85", linewidth=0, zorder=0)
    axes.axhline(number.value, color=GREY, linewidth=0.8, linestyle=DASHED, zorder=0.5)
    if not words:
        return
    axes.annotate(
        f"paper: {words}",
        (0.98, number.value - error),
        xycoords=axes.get_yaxis_transform(),
        xytext=(0, -1.5),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=WORDS,
        color="0.35",
    )


def mark_place(
    axes: Axes, panel: str, name: str, number: Reported, words: str = "", top: float = 1.0
) -> None:
    """Draw one of the paper's numbers as a place on the horizontal axis, whose limits are set.

    The line ends at ``top``, a share of the height: below what is written there.
    """
    left, right = axes.get_xlim()
    to_the_right = number.value < 0.5 * (left + right)
    keep(axes, panel, name, number)
    line: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": DASHED, "zorder": 0.5}
    axes.axvline(number.value, ymax=top, **line)
    axes.annotate(
        f"paper: {words}" if words else "",
        (number.value, 0.04),
        xycoords=axes.get_xaxis_transform(),
        xytext=(3 if to_the_right else -3, 0),
        textcoords="offset points",
        ha="left" if to_the_right else "right",
        va="bottom",
        fontsize=WORDS,
        color="0.35",
    )


def guide(
    axes: Axes, panel: str, x: FloatArray, y: FloatArray, number: Reported, words: str
) -> None:
    """Draw a power law of the paper's exponent through the middle of some points.

    Parameters
    ----------
    axes, panel
        Where, with logarithmic axes.
    x, y
        Positive points in whose logarithmic mean the line passes, shape (points,).
    number
        The exponent.
    words
        Of the legend.
    """
    keep(axes, panel, "exponent", number)
    power_through(axes, x, y, number.value, color=GREY, linestyle=DASHED, label=words)


def power_through(axes: Axes, x: FloatArray, y: FloatArray, power: float, **look: Any) -> None:
    """Draw a power law through the logarithmic mean of the positive ones of some points."""
    usable = np.isfinite(x) & np.isfinite(y) & (x > 0) & (y > 0)
    if not usable.any():
        return
    middle = np.exp(np.mean(np.log(x[usable]))), np.exp(np.mean(np.log(y[usable])))
    ends = np.array([0.75 * x[usable].min(), 1.35 * x[usable].max()])
    line: dict[str, Any] = {"linewidth": 0.9, "zorder": 1}
    axes.plot(ends, middle[1] * (ends / middle[0]) ** power, **(line | look))
