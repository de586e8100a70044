"""Flow curves (Fig. 5)."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from softslip.analysis import paper
from softslip.analysis.figures.drawing import (
    COLOURS,
    MARKERS,
    WIDE,
    facets,
    grid_of_panels,
    named,
    note_missing,
    styled,
    with_dimensions,
)
from softslip.analysis.figures.shown import Quantity, along, place, quantity, show
from softslip.analysis.fits import FITTED, flow_law
from softslip.analysis.fits.points import DRIVES
from softslip.analysis.observables import mean_over_seeds

FloatArray = NDArray[np.float64]

RATES = {
    "shear_rate_wall": ("steady_wall", r"apparent shear rate $\dot\gamma_\mathrm{wall}$"),
    "shear_rate_bulk": ("steady_bulk", r"bulk shear rate $\dot\gamma_\mathrm{bulk}$"),
}
"""Series of each panel, the flag that fills its symbols, and how its axis is called."""

LEAST_DECADES = 2.2
"""Least range of the axis of rates."""

LEAST_SHARE = 1e-2
"""Lower end of an error bar that reaches zero, over its value, on the logarithmic axis."""

LARGEST, SHRINK = 6.5, 0.88
"""Size of the first marker [point], and by how much each next is smaller: points that coincide,
as the bulk's do, stay visible."""

EDGE = 0.07
"""Share of the axis that is kept for arrows at the left."""


@styled
def flow_curves(dataset: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw shear stress against apparent and bulk shear rate, with the Herschel-Bulkley fit.

    Filled symbols are steady; open ones with dashed bars are not, and their bars span the drift.
    Rates that are not positive cannot stand on a logarithmic axis: an arrow at the left edge
    shows each. The line is the fit to all roughnesses together with its band of one standard
    error; the grey line and band are the paper's yield stress. Further dimensions get a row of
    panels each.

    Parameters
    ----------
    dataset
        From `analysis.observables.flow_curve`.
    fits
        Its `analysis.fits.herschel_bulkley`.
    """
    table = with_dimensions(mean_over_seeds(dataset), "roughness")
    rows = facets(table, *DRIVES, "roughness")
    figure, panels = grid_of_panels(len(rows), 2, width=WIDE, height=3.3)
    arrows = 0
    for (title, chosen), axes in zip(rows, panels, strict=True):
        cell = table.sel(chosen)
        for (name, (flag, label)), panel in zip(RATES.items(), axes, strict=True):
            arrows += _draw_curves(panel, cell, name, flag)
            panel.set_xlabel(f"{label} [1 / time unit]")
            _draw_yield_stress(panel, name)
        _share_stresses(axes)
        for panel in axes:
            _widen(panel)
        there = {dim: value for dim, value in chosen.items() if dim in fits.dims}
        _draw_fit(axes[1], fits.sel(there), place(cell))
        axes[0].set_ylabel(f"{title}\n" * bool(title) + r"shear stress $\sigma$ [stress unit]")
        if axes[1].get_legend_handles_labels()[1]:
            axes[1].legend(loc="upper left")
    handles, labels = panels[0][0].get_legend_handles_labels()
    if labels:
        figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), 8))
    left = "arrows at the left: rate not positive" if arrows else ""
    note_missing(figure, dataset, left, _open_note(table))
    return figure


def _open_note(table: xr.Dataset) -> str:
    done = table["status"] == "done"
    every = all(bool((table[flag] | ~done).all()) for flag, _ in RATES.values())
    return "" if every else "open symbols: not steady, bars span the drift"


def _draw_curves(axes: Axes, cell: xr.Dataset, name: str, flag: str) -> int:
    """Draw one series for all roughnesses; return how many of its rates are not positive."""
    axes.set(xscale="log", yscale="log")
    hidden = 0
    for number, roughness in enumerate(cell["roughness"].values):
        line = cell.isel(roughness=number)
        columns = [line[key] for key in ("shear_stress", name, f"{name}_error", flag)]
        stress, rate, error, steady = (each.values.ravel() for each in columns)
        look: dict[str, Any] = {
            "color": COLOURS[number % len(COLOURS)],
            "marker": MARKERS[number % len(MARKERS)],
            "markersize": LARGEST * SHRINK**number,
        }
        with np.errstate(invalid="ignore"):
            shown = (rate > 0) & (stress > 0)
            below = (rate <= 0) & (stress > 0)
        _keep_points(axes, line, name, steady, shown, below)
        _draw_points(axes, stress[shown], rate[shown], error[shown], steady[shown], look)
        if name == "shear_rate_wall" and named("roughness", roughness):
            axes.plot([], [], linestyle="none", label=named("roughness", roughness), **look)
        hidden += int(below.sum())
        if name == "shear_rate_wall" and number == 0:
            axes.plot(rate[shown], stress[shown], color=look["color"], linewidth=0.7, zorder=2)
        for height in stress[below]:
            axes.annotate(
                "",
                (0.005, height),
                (EDGE, height),
                xycoords=axes.get_yaxis_transform(),
                arrowprops={"arrowstyle": "-|>", "color": look["color"], "linewidth": 0.9},
            )
            axes.update_datalim([(np.nan, height)], updatex=False)
    if hidden:
        low, high = axes.get_xlim()
        axes.set_xlim(low * (low / high) ** EDGE, high)
    return hidden


def _keep_points(
    axes: Axes,
    line: xr.Dataset,
    name: str,
    steady: NDArray[np.bool_],
    shown: NDArray[np.bool_],
    below: NDArray[np.bool_],
) -> None:
    """Keep the numbers of one series for one roughness; errors as they are, not as bars."""
    kinds = {
        "steady": shown & steady,
        "not steady": shown & ~steady,
        "rate not positive": below,
    }
    for words, chosen in kinds.items():
        columns = {key: line[key] for key in (name, f"{name}_error", "shear_stress")}
        points = {key: quantity(each, each.values.ravel()[chosen]) for key, each in columns.items()}
        show(axes, name, words, along(line[name], chosen) | points, place(line))


def _draw_points(
    axes: Axes,
    stress: FloatArray,
    rate: FloatArray,
    error: FloatArray,
    steady: NDArray[np.bool_],
    look: dict[str, Any],
) -> None:
    size = np.nan_to_num(error)
    bars = np.stack((np.minimum(size, (1 - LEAST_SHARE) * rate), size))
    for chosen, filled in ((steady, True), (~steady, False)):
        if not chosen.any():
            continue
        drawn = axes.errorbar(
            rate[chosen],
            stress[chosen],
            xerr=bars[:, chosen],
            linestyle="none",
            elinewidth=0.8,
            markerfacecolor=look["color"] if filled else "white",
            zorder=3 if filled else 2.5,
            **look,
        )
        if not filled:
            for collection in drawn.lines[2]:
                collection.set_linestyle((0, (2, 1.5)))


def _draw_yield_stress(axes: Axes, panel: str) -> None:
    """Mark the paper's yield stress, which only a bulk rate should feel."""
    value, error = paper.YIELD_STRESS.value, paper.YIELD_STRESS.uncertainty or 0.0
    known = {"yield_stress": value, "yield_stress_error": error}
    points = {key: Quantity([each], "stress unit", key) for key, each in known.items()}
    show(axes, panel, "yield stress of the paper", _told(points))
    axes.axhspan(value - error, value + error, color="0.85", linewidth=0, zorder=0)
    axes.axhline(value, color="0.45", linewidth=0.8, linestyle=(0, (4, 2)), zorder=0.5)
    axes.annotate(
        rf"paper: $\sigma_y = {value:g} \pm {error:g}$",
        (0.98, value + error),
        xycoords=axes.get_yaxis_transform(),
        xytext=(0, 1.5),
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=7.5,
        color="0.35",
    )


def _share_stresses(axes: list[Axes]) -> None:
    """Give both panels one range of stresses, with room around the yield stress's label."""
    limits = np.array([panel.get_ylim() for panel in axes])
    low = min(float(limits[:, 0].min()), 0.7 * paper.YIELD_STRESS.value)
    high = max(1.15 * float(limits[:, 1].max()), 2 * paper.YIELD_STRESS.value)
    for panel in axes:
        panel.set_ylim(low, high)


def _widen(axes: Axes) -> None:
    """Show at least two decades of rates, so that no point fills the panel with its error."""
    low, high = np.log10(axes.get_xlim())
    missing = max(LEAST_DECADES - (high - low), 0.0)
    axes.set_xlim(10 ** (low - 0.5 * missing), 10 ** (high + 0.5 * missing))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _told(points: dict[str, Quantity]) -> dict[str, Quantity]:
    """Return quantities with their names as their meanings."""
    return {key: each._replace(meaning=key.replace("_", " ")) for key, each in points.items()}


def _draw_fit(axes: Axes, fits: xr.Dataset, cell: dict[str, Quantity]) -> None:
    """Draw the pooled fit over the range of the panel, or say why there is none."""
    message = str(fits["pooled_fit_message"].item())
    if not message.startswith(FITTED):
        axes.set_title(f"no fit: {message}", fontsize=8, color="0.35")
        return
    low, high = axes.get_xlim()
    rate = np.geomspace(low, high, 200)
    yield_stress, consistency, index = (
        float(fits[f"pooled_{name}"]) for name in ("yield_stress", "consistency", "flow_index")
    )
    stress = flow_law(rate, yield_stress, consistency, index)
    slope = np.stack((np.ones_like(rate), rate**index, consistency * rate**index * np.log(rate)))
    variance = np.einsum("ir,ij,jr->r", slope, fits["pooled_covariance"].values, slope)
    bottom = top = np.full_like(rate, np.nan)
    if np.isfinite(variance).all():
        error = np.sqrt(np.maximum(variance, 0.0))
        bottom, top = np.maximum(stress - error, 0.01 * stress), stress + error
        axes.fill_between(rate, bottom, top, color="black", alpha=0.15, linewidth=0, zorder=1)
    words = "\n".join(
        [
            r"$\sigma_y + k\,\dot\gamma^n$, all roughnesses:",
            rf"$\sigma_y$ = {_measured(fits, 'yield_stress')}",
            rf"$n$ = {_measured(fits, 'flow_index')}",
        ]
    )
    axes.plot(rate, stress, color="black", linewidth=1.0, zorder=2, label=words)
    axes.set_xlim(low, high)
    _keep_fit(axes, fits, cell, rate, stress, bottom, top)


def _keep_fit(
    axes: Axes,
    fits: xr.Dataset,
    cell: dict[str, Quantity],
    rate: FloatArray,
    stress: FloatArray,
    bottom: FloatArray,
    top: FloatArray,
) -> None:
    """Keep the numbers of the fitted curve and its band, and what the legend says of it."""
    law = "flow law fitted to all roughnesses"
    curve = {
        "shear_rate_bulk": Quantity(rate, "1 / time unit"),
        "shear_stress": Quantity(stress, "stress unit"),
        "shear_stress_low": Quantity(bottom, "stress unit"),
        "shear_stress_high": Quantity(top, "stress unit"),
    }
    show(axes, "shear_rate_bulk", law, _told(curve), cell)
    names = [f"{name}{end}" for name in ("yield_stress", "flow_index") for end in ("", "_error")]
    said = {name: quantity(fits[f"pooled_{name}"]) for name in names}
    points = {name: each._replace(values=[float(each.values)]) for name, each in said.items()}
    show(axes, "shear_rate_bulk", f"{law}: parameters", _told(points), cell)


def _measured(fits: xr.Dataset, name: str) -> str:
    """Write a parameter with its error to the error's first two digits."""
    value, error = float(fits[f"pooled_{name}"]), float(fits[f"pooled_{name}_error"])
    if not np.isfinite(error) or error <= 0:
        return f"{value:.3g} (error not known)"
    digits = max(1 - int(np.floor(np.log10(error))), 0)
    return rf"{value:.{digits}f} $\pm$ {error:.{digits}f}"
