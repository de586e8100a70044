"""Slip lengths against stress and roughness (Fig. 7)."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from softslip.analysis import paper
from softslip.analysis.figures.drawing import (
    MARKERS,
    WIDE,
    grid_of_panels,
    label_decades,
    named,
    sequence,
    styled,
    symbol,
)
from softslip.analysis.figures.markers import draw_points, explained, verdicts, worse
from softslip.analysis.figures.panels import (
    ROUGHNESS,
    Family,
    above,
    facets,
    family_of,
    is_comparable,
    leave_empty,
    legend_above,
    note_missing,
    selected,
    share_limits,
    with_dimensions,
)
from softslip.analysis.figures.published import (
    DASHED,
    GREY,
    WORDS,
    keep,
    mark_level,
    mark_place,
)
from softslip.analysis.figures.shown import Quantity, along, place, quantity, show
from softslip.analysis.fits import FITTED, law_in_use
from softslip.analysis.fits.flow import flow_rate
from softslip.analysis.fits.points import DRIVES, with_stress
from softslip.analysis.observables import mean_over_seeds

FloatArray = NDArray[np.float64]

NEWTONIAN, TOTAL = "newtonian_slip_length", "total_slip_length"

SYMBOLS = {NEWTONIAN: r"$l_s^\mathrm{newton}$", TOTAL: r"$l_s^\mathrm{tot}$"}
"""How the lengths are written."""

TITLES = {
    NEWTONIAN: "Newtonian slip length: film of solvent",
    TOTAL: r"total slip length, $V_s/\dot\gamma_\mathrm{bulk}$",
}
"""What they are."""

LAWS = r"fitted laws: $\nu\,(\sigma - \sigma_y)/\dot\gamma(\sigma)$"
"""What the curves of the total length are."""

MARKER_SIZE = 5.5
"""Of the lengths against the roughness [point]."""

MOST_STRESSES = 12
"""Most stresses that a legend names."""

LEGEND_ROOM, LOWER_ROOM = 0.45, 0.12
"""Shares of an axis that are kept for a legend above, and for words below."""

BELOW_LEGEND = 0.58
"""Height up to which marks of the paper reach under a legend, over that of the panel."""


@styled
def lengths(dataset: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw the Newtonian and the total slip length against stress and against roughness.

    (a) The Newtonian slip length against σ, beside the paper's σ_LJ + βR of each roughness; (b) the
    total one, with the line V_s/γ̇_bulk of the fitted laws of slip and flow, and beside the paper's
    power (σ − σ_y)^(p − 1/n); (c, d) both against the roughness, or against another family, a
    colour for each stress. Lengths that are not above zero cannot stand on the logarithmic axes of
    (b, d): triangles at the lower edge show them. A total length whose bulk rate is within two
    errors of zero has no upper end and is not drawn. Further dimensions get two rows of panels for
    each combination.

    Parameters
    ----------
    dataset
        From `analysis.observables.flow_curve`.
    fits
        Its `analysis.fits.fit_laws`.
    """
    table = with_dimensions(with_stress(mean_over_seeds(dataset)), ROUGHNESS)
    family = family_of(table, *DRIVES)
    known = (*DRIVES, family.dim)
    rows = facets(table, *known)
    figure, panels = grid_of_panels(2 * len(rows), 2, width=WIDE, height=2.8)
    below = 0
    for number, (title, chosen) in enumerate(rows):
        top, bottom = panels[2 * number : 2 * number + 2]
        cell = table.sel(chosen)
        comparable = is_comparable(cell, family)
        below += _draw_against_stress(top, cell, family, comparable)
        _draw_laws(top[1], cell, selected(fits, chosen), family, comparable)
        below += _draw_against_family(bottom, cell, family, comparable)
        top[0].set_ylabel(above(title, top[0].get_ylabel()))
    for column in (0, 1):
        for upper in (0, 1):
            alike = [each[column] for each in panels[upper::2]]
            share_limits(alike)
            for axes in alike:
                _make_room(axes, LEGEND_ROOM if upper else 0.05)
    _share_stresses([axes for row in panels[::2] for axes in row])
    legend_above(figure, panels[0][0])
    endless = int(np.isinf(table[f"{TOTAL}_error"]).sum())
    note_missing(
        figure,
        dataset,
        explained(table, "steady_slip", "steady_bulk"),
        "(c, d) lines join the points of one stress",
        "triangles at the lower edge: not above zero" if below else "",
        f"total lengths without an upper end, not drawn: {endless}" if endless else "",
        known=known,
    )
    return figure


def _make_room(axes: Axes, top: float) -> None:
    """Extend the vertical axis by a share of its range at the top, and a little below."""
    if not axes.has_data():
        return
    log = axes.get_yscale() == "log"
    low, high = np.log10(axes.get_ylim()) if log else np.array(axes.get_ylim())
    ends = low - LOWER_ROOM * (high - low), high + top * (high - low)
    axes.set_ylim(*(np.power(10.0, ends) if log else ends))


def _share_stresses(panels: list[Axes]) -> None:
    """Give panels that show anything the same range of stresses."""
    full = [axes for axes in panels if axes.has_data()]
    if full:
        limits = np.array([axes.get_xlim() for axes in full])
        for axes in full:
            axes.set_xlim(limits[:, 0].min(), limits[:, 1].max())
            label_decades(axes.xaxis)


def _verdicts(line: xr.Dataset, name: str) -> NDArray[Any]:
    """Return the verdict on each length: the worse one of what it is measured from."""
    slip = verdicts(line, "steady_slip")
    return slip if name == NEWTONIAN else worse(slip, verdicts(line, "steady_bulk"))


def _draw_lengths(
    axes: Axes, panel: str, line: xr.Dataset, name: str, x: FloatArray, look: dict[str, Any]
) -> int:
    """Draw lengths along x; return how many are shown by a triangle at the lower edge."""
    value, error = (line[f"{name}{end}"].values.ravel() for end in ("", "_error"))
    known = np.isfinite(value) & np.isfinite(x) & ~np.isinf(error)
    verdict = _verdicts(line, name)
    with np.errstate(invalid="ignore"):
        hidden = known & (value <= 0) & (axes.get_yscale() == "log")
    shown = known & ~hidden
    draw_points(axes, x[shown], value[shown], error[shown], verdict[shown], look)
    axes.plot(
        x[hidden],
        np.full(int(hidden.sum()), 0.03),
        linestyle="none",
        transform=axes.get_xaxis_transform(),
        **(look | {"marker": "v", "markerfacecolor": "none"}),
    )
    for state in sorted(set(verdict)):
        chosen = (verdict == state) & known
        columns = {key: line[key] for key in (name, f"{name}_error")}
        kept = {key: quantity(each, each.values.ravel()[chosen]) for key, each in columns.items()}
        show(axes, panel, state, along(line[name], chosen) | kept, place(line))
    return int(hidden.sum())


def _draw_against_stress(
    panels: list[Axes], cell: xr.Dataset, family: Family, comparable: bool
) -> int:
    """Draw both lengths against the stress, a marker for each member of the family."""
    below = 0
    for panel, axes, name in zip("ab", panels, (NEWTONIAN, TOTAL), strict=True):
        axes.set(xscale="log", yscale="log" if name == TOTAL else "linear")
        axes.set(xlabel=r"stress $\sigma$ [stress unit]", ylabel=f"{SYMBOLS[name]} [length unit]")
        axes.set_title(f"({panel}) {TITLES[name]}")
        found = False
        for number, label, line in family.members(cell):
            stress = line["stress"].broadcast_like(line[name]).values.ravel()
            look = family.look(number)
            below += _draw_lengths(axes, panel, line, name, stress, look)
            found |= bool(np.isfinite(line[name]).any())
            if panel == "a" and label:
                axes.plot([], [], linestyle="none", label=label, **look)
        if not found:
            leave_empty(axes, _reason(name))
            continue
        _finish(axes)
        if panel == "a" and comparable:
            _draw_paper_levels(axes, family)
    return below


def _finish(axes: Axes) -> None:
    if axes.get_yscale() == "log":
        label_decades(axes.yaxis)
    else:
        axes.axhline(0, color="0.8", linewidth=0.6, zorder=0)


def _reason(name: str) -> str:
    if name == NEWTONIAN:
        return "no profiles of the first layers in a steady window"
    return "nowhere are both slip and bulk steady"


def _draw_paper_levels(axes: Axes, family: Family) -> None:
    """Draw the Newtonian slip length that the paper reports, of each roughness where there is."""
    below = family.dim == ROUGHNESS
    for number, value in enumerate(family.values if below else (0.0,)):
        shown = not (below and number in family.missing)
        if not (shown and value < paper.CRITICAL_ROUGHNESS_ABOVE.value):
            continue
        reported = paper.newtonian_slip_length(value * paper.MEAN_RADIUS.value)
        keep(axes, "a", f"newtonian_slip_length at roughness {value:g}", reported)
        colour = family.colour(number) if below else GREY
        axes.axhline(reported.value, color=colour, linewidth=0.9, linestyle=DASHED, zorder=1)
    words = r"paper: $\sigma_\mathrm{LJ} + \beta R$"
    axes.plot([], [], color=GREY, linewidth=0.9, linestyle=DASHED, label=words)


def _draw_laws(
    axes: Axes, cell: xr.Dataset, laws: xr.Dataset, family: Family, comparable: bool
) -> None:
    """Draw the total length of the fitted laws, and that of the paper's exponents."""
    if not axes.has_data():
        return
    limits = axes.get_xlim()
    for number, _, line in family.members(cell):
        curve = _law_of(family.laws_of(laws, number), limits)
        if curve is None:
            continue
        named_yet = LAWS in axes.get_legend_handles_labels()[1]
        look = {"color": family.colour(number), "label": None if named_yet else LAWS}
        axes.plot(*curve, linewidth=0.9, zorder=1, **look)
        points = {
            "stress": Quantity(curve[0], "stress unit", "shear stress"),
            TOTAL: Quantity(curve[1], "length unit", "slip velocity over bulk rate, by the laws"),
        }
        show(axes, "b", "laws of slip and flow", points, place(line))
    if comparable:
        smoothest = int(np.argmin(np.nan_to_num(family.values))) if family.dim == ROUGHNESS else 0
        _draw_paper_power(axes, cell.isel({family.dim: smoothest}))
    axes.set_xlim(*limits)
    if axes.get_legend_handles_labels()[1]:
        # Where slip lengths, which fall with the stress, leave room.
        axes.legend(loc="upper right", fontsize=WORDS)


def _law_of(laws: xr.Dataset, limits: tuple[float, float]) -> tuple[FloatArray, FloatArray] | None:
    """Return stresses above yield and ν (σ − σ_y)/γ̇(σ); nothing where a law is not fitted."""
    prefix = law_in_use(laws)
    names = (f"{prefix}fit_message", "slip_coefficient_message")
    if any(str(laws[name].item()) != FITTED for name in names):
        return None
    coefficient = float(laws["slip_coefficient"])
    flow = [
        float(laws[f"{prefix}{name}"]) for name in ("yield_stress", "consistency", "flow_index")
    ]
    if coefficient <= 0 or limits[1] <= flow[0]:
        return None
    stress = flow[0] + np.geomspace(0.03 * flow[0], limits[1] - flow[0], 100)
    return stress, coefficient * (stress - flow[0]) / flow_rate(stress, *flow)


def _draw_paper_power(axes: Axes, cell: xr.Dataset) -> None:
    """Draw (σ − σ_y)^(p − 1/n) with the paper's numbers through the middle of one member."""
    power = paper.SLIP_EXPONENT.value - 1 / paper.FLOW_INDEX.value
    keep(axes, "b", "yield_stress", paper.YIELD_STRESS)
    keep(axes, "b", "flow_index", paper.FLOW_INDEX)
    keep(axes, "b", "slip_exponent", paper.SLIP_EXPONENT)
    value = cell[TOTAL].values.ravel()
    excess = (cell["stress"] - paper.YIELD_STRESS.value).broadcast_like(cell[TOTAL]).values.ravel()
    with np.errstate(invalid="ignore"):
        usable = (value > 0) & (excess > 0) & np.isfinite(cell[f"{TOTAL}_error"].values.ravel())
    if usable.any():
        middle = np.exp(np.mean(np.log([excess[usable], value[usable]]), axis=1))
        ends = np.geomspace(0.75 * excess[usable].min(), 1.3 * excess[usable].max(), 50)
        words = rf"paper: $(\sigma - \sigma_y)^{{{power:.2f}}}$"
        line: dict[str, Any] = {"color": GREY, "linewidth": 0.9, "linestyle": DASHED, "zorder": 1}
        curve = middle[1] * (ends / middle[0]) ** power
        axes.plot(ends + paper.YIELD_STRESS.value, curve, label=words, **line)
    layer = paper.FLUIDISED_LAYER
    low, high = axes.get_ylim()
    if low < layer.value < high:
        mark_level(axes, "b", "fluidised_layer", layer)
        at = (0.02, layer.value)
        words = f"paper: fluidised layer {layer.value:g}"
        known: dict[str, Any] = {"fontsize": WORDS, "color": "0.35", "va": "bottom"}
        axes.text(*at, words, transform=axes.get_yaxis_transform(), **known)


def _draw_against_family(
    panels: list[Axes], cell: xr.Dataset, family: Family, comparable: bool
) -> int:
    """Draw both lengths against the roughness or another family, a colour for each stress."""
    below = 0
    values = np.asarray(family.values)
    at = values if values.dtype.kind in "if" else np.arange(len(values))
    curves = list(_by_stress(cell))
    colours = sequence(len(curves))
    for panel, axes, name in zip("cd", panels, (NEWTONIAN, TOTAL), strict=True):
        axes.set(yscale="log" if name == TOTAL else "linear")
        unit = cell[family.dim].attrs.get("units", "1")
        axes.set(xlabel=f"{symbol(family.dim)} [{unit}]", ylabel=f"{SYMBOLS[name]} [length unit]")
        axes.set_title(f"({panel}) the same, against {symbol(family.dim)}")
        if not np.isfinite(cell[name]).any() or not np.isfinite(at.astype(np.float64)).any():
            leave_empty(axes, _reason(name))
            continue
        for number, (label, line) in enumerate(curves):
            look = {"color": colours[number], "marker": MARKERS[number % len(MARKERS)]}
            look["markersize"] = MARKER_SIZE
            column = line[name].transpose(family.dim, ...)
            known = line.assign({name: column})
            below += _draw_lengths(axes, panel, known, name, at.astype(np.float64), look)
            shown = np.isfinite(column.values.ravel())
            shown &= (column.values.ravel() > 0) | (name == NEWTONIAN)
            axes.plot(at[shown], column.values.ravel()[shown], color=colours[number], linewidth=0.6)
            if panel == "d" and label and len(curves) <= MOST_STRESSES:
                axes.plot([], [], linestyle="none", label=label, **look)
        if at is not values:
            axes.set_xticks(at, [str(each) for each in values])
        _finish(axes)
        if comparable and family.dim == ROUGHNESS:
            _mark_roughness(axes, panel, at.astype(np.float64))
    if panels[1].get_legend_handles_labels()[1]:
        panels[1].legend(loc="upper right", fontsize=WORDS, ncols=2)
    return below


def _by_stress(cell: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the label and the data of each imposed stress or rate; one of all without any."""
    drive = next((dim for dim in DRIVES if dim in cell.dims), None)
    if drive is None:
        yield "", cell
        return
    for number, value in enumerate(cell[drive].values.tolist()):
        yield named(drive, value), cell.isel({drive: number})


def _mark_roughness(axes: Axes, panel: str, roughness: FloatArray) -> None:
    """Mark the paper's critical roughness, and its Newtonian slip length up to there."""
    critical = paper.CRITICAL_ROUGHNESS_ABOVE
    axes.set_xlim(-0.05, max(1.05 * float(np.nanmax(roughness)), 0.68))
    words = rf"$\beta^*$ < {critical.value:g}"
    mark_place(axes, panel, "critical_roughness", critical, words, BELOW_LEGEND)
    if panel == "c":
        ends = np.array([0.0, critical.value])
        length = paper.CONTACT_LENGTH.value + ends * paper.MEAN_RADIUS.value
        words = r"paper: $\sigma_\mathrm{LJ} + \beta R$"
        axes.plot(ends, length, color=GREY, linewidth=0.9, linestyle=DASHED, label=words)
        axes.legend(loc="upper right", fontsize=WORDS)
