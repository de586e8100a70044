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
    WIDE,
    grid_of_panels,
    label_decades,
    named,
    styled,
    symbol,
)
from softslip.analysis.figures.fitted import measured
from softslip.analysis.figures.markers import draw_points, explained, verdicts
from softslip.analysis.figures.panels import (
    ROUGHNESS,
    Family,
    above,
    facets,
    family_of,
    is_comparable,
    legend_above,
    note_missing,
    selected,
    with_dimensions,
)
from softslip.analysis.figures.published import WORDS, as_text, keep, mark_level
from softslip.analysis.figures.shown import Quantity, along, place, quantity, show
from softslip.analysis.fits import FITTED, flow_law, law_in_use
from softslip.analysis.fits.points import DRIVES
from softslip.analysis.observables import mean_over_seeds
from softslip.files.quantities import JOINT, POOLED

FloatArray = NDArray[np.float64]

RATES = {
    "shear_rate_wall": ("steady_wall", r"apparent shear rate $\dot\gamma_\mathrm{wall}$"),
    "shear_rate_bulk": ("steady_bulk", r"bulk shear rate $\dot\gamma_\mathrm{bulk}$"),
}
"""Series of each panel, the flag of its steady state, and how its axis is called."""

WITH_SLIP = {POOLED: "", JOINT: ", and slip"}
"""What a fitted law is of besides the bulk."""

LEAST_DECADES = 2.2
"""Least range of the axis of rates."""

EDGE = 0.07
"""Share of the axis that is kept for arrows at the left."""


@styled
def flow_curves(dataset: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw shear stress against apparent and bulk shear rate, with the Herschel-Bulkley fit.

    Filled symbols are steady, half filled ones steady within their error; open ones with dashed
    bars drift, and their bars span the drift. Rates that are not positive cannot stand on a
    logarithmic axis: an arrow at the left edge shows each. The line is the fit to all roughnesses
    together with its band of one standard error, or that to flow and slip together where the bulk
    alone does not determine it; the grey line and band are the paper's yield
    stress, where the material is the paper's. Of further dimensions each combination gets a row
    of panels; the first is the family of colours where there is one roughness.

    Parameters
    ----------
    dataset
        From `analysis.observables.flow_curve`.
    fits
        Its `analysis.fits.fit_laws`.
    """
    table = with_dimensions(mean_over_seeds(dataset), ROUGHNESS)
    family = family_of(table, *DRIVES)
    known = (*DRIVES, family.dim)
    rows = facets(table, *known)
    figure, panels = grid_of_panels(len(rows), 2, width=WIDE, height=3.3)
    arrows = 0
    for (title, chosen), axes in zip(rows, panels, strict=True):
        cell = table.sel(chosen)
        comparable = is_comparable(cell, family)
        for (name, (flag, label)), panel in zip(RATES.items(), axes, strict=True):
            arrows += _draw_curves(panel, cell, family, name, flag)
            panel.set_xlabel(f"{label} [1 / time unit]")
            if comparable:
                words = f"{as_text(paper.YIELD_STRESS)}\n{as_text(paper.FLOW_INDEX)}"
                written = words if name == "shear_rate_bulk" else ""
                mark_level(panel, name, "yield_stress", paper.YIELD_STRESS, written)
        if comparable:
            keep(axes[1], "shear_rate_bulk", "flow_index", paper.FLOW_INDEX)
        axes[0].set_ylabel(above(title, r"shear stress $\sigma$ [stress unit]"))
    _share_axes(panels)
    for (_, chosen), axes in zip(rows, panels, strict=True):
        _draw_fits(axes[1], selected(fits, chosen), family, place(table.sel(chosen)))
    legend_above(figure, panels[0][0])
    left = "arrows at the left: rate not positive" if arrows else ""
    states = explained(table, *(flag for flag, _ in RATES.values()))
    fitted = any(axes[1].get_legend() for axes in panels)
    note_missing(figure, dataset, states, left, _explained_lines(family, fitted), known=known)
    return figure


def _explained_lines(family: Family, fitted: bool) -> str:
    """Say what lines and bands mean that no legend names."""
    thin = "" if 0 in family.missing else "thin line: joins the points of one wall"
    band = "band of the fit: its standard error" if fitted else ""
    return "; ".join(filter(None, (thin, band)))


def _draw_curves(axes: Axes, cell: xr.Dataset, family: Family, name: str, flag: str) -> int:
    """Draw one series for all members; return how many of its rates are not positive."""
    axes.set(xscale="log", yscale="log")
    hidden = 0
    for number, label, line in family.members(cell):
        columns = [line[key] for key in ("shear_stress", name, f"{name}_error")]
        stress, rate, error = (each.values.ravel() for each in columns)
        verdict, look = verdicts(line, flag), family.look(number)
        with np.errstate(invalid="ignore"):
            shown = (rate > 0) & (stress > 0)
            below = (rate <= 0) & (stress > 0)
        _keep_points(axes, line, name, verdict, shown, below)
        points = (rate[shown], stress[shown], error[shown], verdict[shown])
        draw_points(axes, *points, look, along="x")
        if name == "shear_rate_wall" and label:
            axes.plot([], [], linestyle="none", label=label, **look)
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
    verdict: NDArray[Any],
    shown: NDArray[np.bool_],
    below: NDArray[np.bool_],
) -> None:
    """Keep the numbers of one series of one member; errors as they are, not as bars."""
    kinds = {str(each): shown & (verdict == each) for each in sorted(set(verdict))}
    for words, chosen in {**kinds, "rate not positive": below}.items():
        columns = {key: line[key] for key in (name, f"{name}_error", "shear_stress")}
        points = {key: quantity(each, each.values.ravel()[chosen]) for key, each in columns.items()}
        show(axes, name, words, along(line[name], chosen) | points, place(line))


def _share_axes(panels: list[list[Axes]]) -> None:
    """Give all panels one range of stresses, and those of a column one of rates.

    It spans two decades of rates at least, so that no point fills the panel with its error.
    """
    every = [panel for row in panels for panel in row]
    limits = np.array([panel.get_ylim() for panel in every])
    low, high = float(limits[:, 0].min()), 1.15 * float(limits[:, 1].max())
    bottom, top = 0.7 * paper.YIELD_STRESS.value, 2 * paper.YIELD_STRESS.value
    for panel in every:
        panel.set_ylim(min(low, bottom), max(high, top))
    for column in zip(*panels, strict=True):
        ends = np.log10([panel.get_xlim() for panel in column])
        left, right = float(ends[:, 0].min()), float(ends[:, 1].max())
        missing = max(LEAST_DECADES - (right - left), 0.0)
        for panel in column:
            panel.set_xlim(10 ** (left - 0.5 * missing), 10 ** (right + 0.5 * missing))
            panel.xaxis.set_minor_formatter(NullFormatter())
    for row in panels:
        for panel in row:
            label_decades(panel.yaxis)
        for panel in row[1:]:
            panel.tick_params(labelleft=False)


def _draw_fits(axes: Axes, fits: xr.Dataset, family: Family, cell: dict[str, Quantity]) -> None:
    """Draw the fit to all roughnesses together, or one of each member of another family."""
    message = fits["pooled_fit_message"]
    if family.dim not in message.dims:
        _draw_fit(axes, fits, "black", f"all {symbol(ROUGHNESS)}", cell)
    else:
        for number, value in enumerate(family.values):
            here = fits.isel({family.dim: number})
            words = named(family.dim, value)
            _draw_fit(axes, here, family.colour(number), words, cell | place(here))
    if axes.get_legend_handles_labels()[1]:
        look: dict[str, Any] = {"fontsize": WORDS, "alignment": "left"}
        axes.legend(loc="upper left", title=r"$\sigma_y + k\,\dot\gamma^n$", **look)


def _draw_fit(
    axes: Axes, fits: xr.Dataset, colour: Any, whose: str, cell: dict[str, Quantity]
) -> None:
    """Draw a fit over the range of the panel, or say why there is none."""
    prefix = law_in_use(fits)
    message = str(fits[f"{prefix}fit_message"].item())
    if not message.startswith(FITTED):
        said = axes.get_title()
        axes.set_title(said or f"no fit: {message}", fontsize=8, color="0.35")
        return
    low, high = axes.get_xlim()
    rate = np.geomspace(low, high, 200)
    yield_stress, consistency, index = (
        float(fits[f"{prefix}{name}"]) for name in ("yield_stress", "consistency", "flow_index")
    )
    stress = flow_law(rate, yield_stress, consistency, index)
    slope = np.stack((np.ones_like(rate), rate**index, consistency * rate**index * np.log(rate)))
    variance = np.einsum("ir,ij,jr->r", slope, fits[f"{prefix}covariance"].values, slope)
    bottom = top = np.full_like(rate, np.nan)
    if np.isfinite(variance).all():
        error = np.sqrt(np.maximum(variance, 0.0))
        bottom, top = np.maximum(stress - error, 0.01 * stress), stress + error
        axes.fill_between(rate, bottom, top, color=colour, alpha=0.15, linewidth=0, zorder=1)
    words = (
        f"{whose}{WITH_SLIP[prefix]}:\n"
        rf"$\sigma_y$ = {measured(fits, f'{prefix}yield_stress')}, "
        rf"$n$ = {measured(fits, f'{prefix}flow_index')}"
    )
    axes.plot(rate, stress, color=colour, linewidth=1.0, zorder=2, label=words)
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
    prefix = law_in_use(fits)
    law = f"flow law fitted to all roughnesses{WITH_SLIP[prefix]}"
    curve = {
        "shear_rate_bulk": Quantity(rate, "1 / time unit"),
        "shear_stress": Quantity(stress, "stress unit"),
        "shear_stress_low": Quantity(bottom, "stress unit"),
        "shear_stress_high": Quantity(top, "stress unit"),
    }
    show(axes, "shear_rate_bulk", law, _labelled(curve), cell)
    names = [f"{name}{end}" for name in ("yield_stress", "flow_index") for end in ("", "_error")]
    said = {name: quantity(fits[f"{prefix}{name}"]) for name in names}
    points = {name: each._replace(values=[float(each.values)]) for name, each in said.items()}
    show(axes, "shear_rate_bulk", f"{law}: parameters", _labelled(points), cell)


def _labelled(points: dict[str, Quantity]) -> dict[str, Quantity]:
    """Return quantities with their names as their meanings."""
    return {key: each._replace(meaning=key.replace("_", " ")) for key, each in points.items()}
