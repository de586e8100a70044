"""When the bulk yields and slip sets in, against the stress above yield (Fig. 8d-e)."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from softslip.analysis import paper
from softslip.analysis.comparable import unlike
from softslip.analysis.figures.drawing import label_decades
from softslip.analysis.figures.fitted import FloatArray, draw_powers
from softslip.analysis.figures.markers import (
    ALL_STEADY,
    DRIFTING,
    STEADY,
    WITHIN_ERROR,
    draw_points,
)
from softslip.analysis.figures.panels import Family, is_comparable, leave_empty
from softslip.analysis.figures.published import WORDS, guide, keep
from softslip.analysis.figures.shown import Quantity, place, quantity, show
from softslip.analysis.fits import yield_stress_of as fitted_yield_stress
from softslip.analysis.fits.powers import EXPONENTS
from softslip.analysis.observables.smoothed_series import SMOOTHING_WIDTH

SHOWN = {
    "yielding_time": (r"$\tau_y$ [time unit]", "yielding of the bulk"),
    "slip_time": (r"$\tau_s$ [time unit]", "onset of slip"),
}
"""How the axis and the panel of each time are called."""

LEGEND_ROOM = 0.3
"""Share of the axis of times that is kept for the legend."""

DECIDED = {
    STEADY: "filled: half or twice the smoothing shifts the time within its bar or the window",
    WITHIN_ERROR: "half filled: farther",
    DRIFTING: "open, dashed bar: one of them finds no time",
}
"""What the symbols of times mean, by the verdict on a series that is drawn alike."""


def yield_stress_of(cell: xr.Dataset, fits: xr.Dataset) -> tuple[float, str]:
    """Return the yield stress that stresses are counted from, and words for where it is from.

    It is that of the fit to all roughnesses together, or else to flow and slip together; where
    there is none and the material is the paper's, the paper's; otherwise NaN.
    """
    found = float(fitted_yield_stress(fits)[0].values.ravel()[0])
    if np.isfinite(found):
        return found, ""
    if unlike(cell):
        return np.nan, ""
    value = paper.YIELD_STRESS.value
    return value, rf"no fit: (d, e) count from the paper's $\sigma_y$ = {value:g}"


def decided(cell: xr.Dataset, name: str) -> NDArray[Any]:
    """Return how well a time is decided, raveled: the verdict that is drawn alike.

    A time has no verdict, as none of a steady state bears on it. Its bar is that of one smoothing
    of the series; what half and twice the smoothing change is the other part of its uncertainty.
    It counts where it exceeds both the bar and the width of the smoothing window, below which no
    time of a smoothed series has a meaning.

    Parameters
    ----------
    cell
        Averages over seeds.
    name
        A key of `SHOWN`.
    """
    ends = ("", "_smoothing", "_error")
    time, change, error = (cell[f"{name}{end}"].values.ravel() for end in ends)
    window = (10**SMOOTHING_WIDTH - 1) * time
    found = np.where(change <= np.fmax(error, window), STEADY, WITHIN_ERROR).astype(object)
    found[np.isinf(change)] = DRIFTING
    return found


def explained_times(seen: set[str]) -> str:
    """Say what the symbols of times mean that `draw_times` has drawn; just bars if all alike."""
    if not seen:
        return ""
    # The others are told beside the first.
    states = [words for state, words in DECIDED.items() if state in (STEADY, *seen)]
    return "(d, e) " + "; ".join([ALL_STEADY, *(states if seen != {STEADY} else [])])


def draw_times(
    axes: Axes,
    panel: str,
    cell: xr.Dataset,
    family: Family,
    name: str,
    yield_stress: float,
    laws: xr.Dataset | None = None,
) -> set[str]:
    """Draw a time against the stress above yield, with the fitted and the paper's power law.

    Parameters
    ----------
    axes, panel
        Where.
    cell
        Averages over seeds along ``stress`` and the family.
    family
        Whose members have a marker each.
    name
        A key of `SHOWN`.
    yield_stress
        σ_y [stress unit]; NaN leaves nothing to draw.
    laws
        From `analysis.fits.fit_laws`, with the fitted power.

    Returns
    -------
    set of str
        Which states of `DECIDED` were drawn.
    """
    label, words = SHOWN[name]
    axes.set(xscale="log", yscale="log", ylabel=label)
    axes.set(xlabel=r"$\sigma - \sigma_y$ [stress unit]", title=f"({panel}) {words}")
    found: dict[int, tuple[FloatArray, FloatArray]] = {}
    seen: set[str] = set()
    for number, _, line in family.members(cell):
        excess = (line["stress"] - yield_stress).broadcast_like(line[name]).values.ravel()
        time, error = (line[f"{name}{end}"].values.ravel() for end in ("", "_error"))
        known = np.isfinite(time) & (excess > 0)
        if not known.any():
            continue
        states = decided(line, name)[known]
        seen |= set(states.tolist())
        draw_points(axes, excess[known], time[known], error[known], states, family.look(number))
        points = {
            "stress": quantity(line["stress"], (excess + yield_stress)[known]),
            "stress_above_yield": Quantity(excess[known], "stress unit", "stress above yield"),
            name: quantity(line[name], time[known]),
            f"{name}_error": quantity(line[f"{name}_error"], error[known]),
            f"{name}_smoothing": quantity(
                line[f"{name}_smoothing"], line[f"{name}_smoothing"].values.ravel()[known]
            ),
        }
        show(axes, panel, name.replace("_", " "), points, place(line))
        found[number] = excess[known], time[known]
    if not found:
        reason = "none found" if np.isfinite(yield_stress) else r"$\sigma_y$ is not known"
        leave_empty(axes, reason)
        return seen
    x, y = np.concatenate([np.stack(each) for each in found.values()], axis=1)
    low, high = 0.6 * x.min(), 1.6 * x.max()
    axes.set_xlim(low, high)
    label_decades(axes.xaxis)
    label_decades(axes.yaxis)
    if laws is not None:
        draw_powers(axes, panel, EXPONENTS[name], found, laws, family)
    _draw_paper(axes, panel, name, (x, y), yield_stress if is_comparable(cell, family) else None)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower left", fontsize=WORDS)
        _make_room(axes)
    return seen


def _draw_paper(
    axes: Axes,
    panel: str,
    name: str,
    points: tuple[FloatArray, FloatArray],
    yield_stress: float | None,
) -> None:
    """Draw the paper's power and sample; keep the power alone for another material."""
    power = paper.YIELDING_EXPONENT
    if yield_stress is None:
        keep(axes, panel, "exponent", power)
        return
    guide(axes, panel, *points, power, rf"paper: power ${power.value:g}$")
    if name == "yielding_time":
        _mark_sample(axes, yield_stress)


def _make_room(axes: Axes) -> None:
    """Extend the axis of times downwards by the height of the legend."""
    low, high = np.log10(axes.get_ylim())
    axes.set_ylim(10 ** (low - LEGEND_ROOM * (high - low)), 10**high)
    label_decades(axes.yaxis)


def _mark_sample(axes: Axes, yield_stress: float) -> None:
    """Mark the sample that the paper shows as it yields."""
    sample = paper.YIELDING_SAMPLE
    label = rf"paper, Fig. 3 ($\beta$ = {sample.roughness:g})"
    look: dict[str, Any] = {
        "marker": "*",
        "markersize": 11,
        "markerfacecolor": "none",
        "color": "0.35",
        "zorder": 4,
    }
    axes.plot(sample.stress - yield_stress, sample.time, linestyle="none", label=label, **look)
