"""Slip velocity and heterogeneity against stress (Fig. 6)."""

import itertools
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
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
from softslip.analysis.figures.markers import draw_points, explained, verdicts
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
from softslip.analysis.figures.published import guide, keep, mark_place
from softslip.analysis.figures.shown import Quantity, along, place, quantity, show
from softslip.analysis.fits import FITTED, yield_stress_of
from softslip.analysis.fits.points import DRIVES, with_stress
from softslip.analysis.observables import mean_over_seeds

FloatArray = NDArray[np.float64]

ZOOM = 0.2
"""Stress up to which the second panel zooms in [stress unit], as in the paper."""

ROOM, WORDS_ROOM = 0.05, 0.14
"""Room below what is drawn, and for words there, over its height."""

SPEED = "length unit / time unit"


@styled
def slip(dataset: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw slip velocity against stress, its prefactor against roughness, and the heterogeneity.

    (a) V_s against σ with the lines ν (σ − σ_y) above the fitted yield stress and ν_N σ below it,
    up to where they cross;
    (b) the same at the smoothest walls and low stress; (c) ν against β; (d) δ_het against σ with
    the paper's power through it. Further dimensions are laid out as in `flow_curves`: each
    combination gets two rows of panels.

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
    figure, panels = grid_of_panels(2 * len(rows), 2, width=WIDE, height=2.7)
    notes: list[str] = []
    for number, (title, chosen) in enumerate(rows):
        cell, laws = table.sel(chosen), selected(fits, chosen)
        top, bottom = panels[2 * number : 2 * number + 2]
        notes += _draw_block(cell, laws, family, [*top, *bottom])
        top[0].set_ylabel(above(title, top[0].get_ylabel()))
    for row, column in itertools.product((0, 1), (0, 1)):
        share_limits([each[column] for each in panels[row::2]])
    legend_above(figure, panels[0][0])
    words = explained(table, "steady_slip")
    note_missing(figure, dataset, words, *dict.fromkeys(notes), known=known)
    return figure


def _draw_block(
    cell: xr.Dataset, laws: xr.Dataset, family: Family, panels: list[Axes]
) -> list[str]:
    """Draw the four panels of one combination; return what needs saying below the figure."""
    comparable = is_comparable(cell, family)
    slipping, zoomed, prefactor, uneven = panels
    _draw_slip(slipping, "a", cell, laws, family, range(len(family.values)))
    roughnesses = np.atleast_1d(cell[ROUGHNESS].values)
    smoothest = int(np.argmin(np.nan_to_num(roughnesses)))
    shown = [smoothest] if family.dim == ROUGHNESS else range(len(family.values))
    _draw_slip(zoomed, "b", cell, laws, family, shown)
    zoomed.set_xlim(0, 1.05 * ZOOM)
    _fit_height(zoomed, cell, family, shown)
    low = named(ROUGHNESS, roughnesses[smoothest])
    zoomed.set_title(f"(b) {low}, low stress" if low else "(b) low stress")
    slipping.set_title("(a) slip velocity")
    notes = [_draw_prefactor(prefactor, cell, laws, family, comparable)]
    notes.append(_draw_heterogeneity(uneven, cell, family, comparable))
    return [each for each in notes if each]


def _draw_slip(
    axes: Axes, panel: str, cell: xr.Dataset, laws: xr.Dataset, family: Family, shown: Any
) -> None:
    """Draw the slip velocity of some members with the lines that were fitted to it."""
    for number, label, line in family.members(cell):
        if number not in shown:
            continue
        stress = line["stress"].broadcast_like(line["slip_velocity"]).values.ravel()
        slip, error = (line[f"slip_velocity{end}"].values.ravel() for end in ("", "_error"))
        verdict, look = verdicts(line, "steady_slip"), family.look(number)
        draw_points(axes, stress, slip, error, verdict, look)
        if panel == "a" and label:
            axes.plot([], [], linestyle="none", label=label, **look)
        for state in sorted(set(verdict)):
            chosen = (verdict == state) & np.isfinite(slip)
            names = ("slip_velocity", "slip_velocity_error")
            points = {"stress": Quantity(stress[chosen], "stress unit", "shear stress")}
            points |= {
                name: quantity(line[name], line[name].values.ravel()[chosen]) for name in names
            }
            show(axes, panel, state, points, place(line))
        here = family.laws_of(laws, number)
        _draw_lines(axes, panel, here, look["color"], place(line), float(np.nanmax(stress)))
    axes.set(xlabel=r"stress $\sigma$ [stress unit]", ylabel=rf"$V_s$ [{SPEED}]")
    axes.set_xlim(left=0)
    axes.axhline(0, color="0.8", linewidth=0.6, zorder=0)


def _draw_lines(
    axes: Axes,
    panel: str,
    laws: xr.Dataset,
    colour: Any,
    cell: dict[str, Quantity],
    highest: float,
) -> None:
    """Draw the laws above and below yield, the latter up to where the former is faster."""
    offset = float(yield_stress_of(laws)[0])
    branches = {
        "slip_coefficient": (np.array([offset, 1.05 * highest]), offset, "-"),
        "newtonian_slip_coefficient": (np.array([0.0, _crossing(laws, offset)]), 0.0, (0, (1, 1))),
    }
    for name, (stress, start, style) in branches.items():
        message = str(laws[f"{name}_message"].item())
        if not message.startswith(FITTED) or not np.isfinite(offset):
            continue
        velocity = float(laws[name]) * (stress - start)
        axes.plot(stress, velocity, color=colour, linewidth=0.9, linestyle=style, zorder=1)
        points = {
            "stress": Quantity(stress, "stress unit", "shear stress"),
            "slip_velocity": Quantity(velocity, SPEED, "slip velocity"),
        }
        show(axes, panel, name.replace("_", " "), points, cell)


def _crossing(laws: xr.Dataset, offset: float) -> float:
    """Return the stress from which slip in the stress above yield is faster than by a film."""
    above, below = (float(laws[n]) for n in ("slip_coefficient", "newtonian_slip_coefficient"))
    return offset * above / (above - below) if above > max(below, 0.0) else offset


def _fit_height(axes: Axes, cell: xr.Dataset, family: Family, shown: Any) -> None:
    """Fit the vertical axis to what is within the range of stresses."""
    low = cell.isel({family.dim: list(shown)})
    stress = low["stress"].broadcast_like(low["slip_velocity"])
    reach = (low["slip_velocity"] + low["slip_velocity_error"].fillna(0.0)).where(stress <= ZOOM)
    top = float(reach.max())
    if np.isfinite(top) and top > 0:
        axes.set_ylim(-ROOM * top, (1 + 2 * ROOM) * top)


def _draw_prefactor(
    axes: Axes, cell: xr.Dataset, laws: xr.Dataset, family: Family, comparable: bool
) -> str:
    """Draw the prefactor of the slip law against the roughness, or against another family."""
    name = "slip_coefficient"
    values, error = (laws[f"{name}{end}"] for end in ("", "_error"))
    unit = "length unit / time unit / stress unit"
    axes.set(xlabel=f"{symbol(family.dim)} {_unit_of(cell, family)}", ylabel=rf"$\nu$ [{unit}]")
    axes.set_title(r"(c) $V_s = \nu\,(\sigma - \sigma_y)$")
    fitted = np.isfinite(values.values).ravel()
    if family.dim not in values.dims or not fitted.any():
        message = str(laws[f"{name}_message"].values.ravel()[0])
        leave_empty(axes, f"no fit: {message}")
        return ""
    places = np.asarray(family.values)[fitted]
    at = places if places.dtype.kind == "f" or places.dtype.kind == "i" else np.arange(len(places))
    columns = [each.values.ravel()[fitted] for each in (values, error)]
    for number, (x, y, size) in enumerate(zip(at, *columns, strict=True)):
        member = int(np.flatnonzero(fitted)[number])
        axes.errorbar(x, y, yerr=np.nan_to_num(size), elinewidth=0.8, **family.look(member))
    axes.plot(at, columns[0], color="0.6", linewidth=0.8, zorder=1)
    if at is not places:
        axes.set_xticks(at, [str(each) for each in places])
    points = {family.dim: Quantity(places), name: quantity(values, columns[0])}
    points[f"{name}_error"] = quantity(error, columns[1])
    show(axes, "c", "slip coefficient", points, place(cell))
    axes.axhline(0, color="0.8", linewidth=0.6, zorder=0)
    least = min(0.0, float((columns[0] - np.nan_to_num(columns[1])).min()))
    axes.set_ylim(bottom=least - WORDS_ROOM * (axes.get_ylim()[1] - least))
    if comparable and family.dim == ROUGHNESS:
        axes.set_xlim(-0.05, max(1.05 * float(at.max()), 0.7))
        critical = paper.CRITICAL_ROUGHNESS
        mark_place(axes, "c", "critical_roughness", critical, r"$\beta^* \approx 0.3$")
    return ""


def _unit_of(cell: xr.Dataset, family: Family) -> str:
    return f"[{cell[family.dim].attrs.get('units', '1')}]"


def _draw_heterogeneity(axes: Axes, cell: xr.Dataset, family: Family, comparable: bool) -> str:
    """Draw the heterogeneity of the bulk flow against the stress."""
    axes.set(xscale="log", yscale="log")
    axes.set(xlabel=r"stress $\sigma$ [stress unit]", ylabel=r"$\delta_\mathrm{het}$ [1]")
    axes.set_title("(d) heterogeneity of the bulk flow")
    every: list[FloatArray] = []
    for number, _, line in family.members(cell):
        stress = line["stress"].broadcast_like(line["heterogeneity"]).values.ravel()
        value, error = (line[f"heterogeneity{end}"].values.ravel() for end in ("", "_error"))
        known = np.isfinite(value) & (value > 0) & (stress > 0)
        verdict = verdicts(line, "steady_bulk")[known]
        draw_points(axes, stress[known], value[known], error[known], verdict, family.look(number))
        every.append(np.stack((stress[known], value[known])))
        columns = {name: line[name] for name in ("heterogeneity", "heterogeneity_error")}
        points = {
            name: quantity(each, each.values.ravel()[known]) for name, each in columns.items()
        }
        show(axes, "d", "heterogeneity", along(line["heterogeneity"], known) | points, place(line))
    x, y = np.concatenate(every, axis=1)
    if not len(x):
        leave_empty(axes, "no snapshot in a steady window")
        return ""
    power = paper.HETEROGENEITY_EXPONENT
    if comparable:
        guide(axes, "d", x, y, power, rf"paper: $\sigma^{{{power.value:g}}}$")
        axes.legend(loc="upper right")
    else:
        keep(axes, "d", "exponent", power)
    for axis in (axes.xaxis, axes.yaxis):
        label_decades(axis)
    return ""
