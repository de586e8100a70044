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
from softslip.analysis.figures.fitted import draw_powers, measured
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
from softslip.analysis.figures.published import WORDS, guide, keep, mark_place
from softslip.analysis.figures.shown import Quantity, along, place, quantity, show
from softslip.analysis.fits import FITTED, yield_stress_of
from softslip.analysis.fits.points import DRIVES, with_stress
from softslip.analysis.observables import mean_over_seeds

FloatArray = NDArray[np.float64]

ZOOM = 0.2
"""Stress up to which the second panel zooms in [stress unit], as in the paper."""

BELOW_LEGEND = 0.75
"""Height up to which critical roughnesses are marked, over that of the panel."""

ROOM, WORDS_ROOM = 0.05, 0.14
"""Room below what is drawn, and for words there, over its height."""

SPEED = "length unit / time unit"

BRANCHES: dict[str, tuple[Any, str]] = {
    "slip_coefficient": ("-", r"solid: fitted $\nu\,(\sigma - \sigma_y)$"),
    "newtonian_slip_coefficient": ((0, (1, 1)), r"dotted: fitted $\nu_N\,\sigma$"),
}
"""Line of each branch of the slip law by its coefficient, and what it is."""

CRITICAL_LINE = (0, (5, 1.5, 1, 1.5))
"""Line of the fitted critical roughness."""


@styled
def slip(dataset: xr.Dataset, fits: xr.Dataset) -> Figure:
    """Draw slip velocity against stress, its prefactor against roughness, and the heterogeneity.

    (a) V_s against σ with the lines ν (σ − σ_y) above the fitted yield stress and ν_N σ below it,
    up to where they cross;
    (b) the same at the smoothest walls and low stress; (c) ν against β, with the fitted β* and the
    paper's; (d) δ_het against σ with the fitted power and the paper's through it. Further
    dimensions are laid out as in `flow_curves`: each combination gets two rows of panels.

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
    words = explained(table, "steady_slip", "steady_bulk")
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
    _draw_prefactor(prefactor, cell, laws, family, comparable)
    _draw_heterogeneity(uneven, cell, laws, family, comparable)
    return _explained_lines(slipping, prefactor, uneven)


def _explained_lines(slipping: Axes, prefactor: Axes, uneven: Axes) -> list[str]:
    """Say what lines and bars of those panels mean that show anything."""
    drawn = {str(line.get_gid()) for line in slipping.lines}
    meanings = {name: words for name, (_, words) in BRANCHES.items() if name in drawn}
    fits = [f"(a, b) {', '.join(meanings.values())}"] if meanings else []
    prefactors = ["(c) bars: standard errors, line: joins points"] if prefactor.has_data() else []
    return [*fits, *prefactors, *(["(d) all bars: standard errors"] if uneven.has_data() else [])]


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
        "slip_coefficient": (np.array([offset, 1.05 * highest]), offset),
        "newtonian_slip_coefficient": (np.array([0.0, _crossing(laws, offset)]), 0.0),
    }
    for name, (stress, start) in branches.items():
        message = str(laws[f"{name}_message"].item())
        if not message.startswith(FITTED) or not np.isfinite(offset):
            continue
        velocity = float(laws[name]) * (stress - start)
        look = {"color": colour, "linewidth": 0.9, "linestyle": BRANCHES[name][0]}
        axes.plot(stress, velocity, zorder=1, gid=name, **look)
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
) -> None:
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
        return
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
        critical, words = paper.CRITICAL_ROUGHNESS, r"$\beta^* \approx 0.3$"
        mark_place(axes, "c", "critical_roughness", critical, words, BELOW_LEGEND)
    if family.dim == ROUGHNESS:
        _draw_critical(axes, laws)


def _draw_critical(axes: Axes, laws: xr.Dataset) -> None:
    """Mark the roughness at which the prefactor is half that of the smoothest wall."""
    name = "critical_roughness"
    if str(laws[f"{name}_message"].item()) != FITTED:
        return
    first, last = (f"{float(end):.3g}" for end in laws[f"{name}_bracket"])
    words = rf"fitted: $\beta^*$ = {measured(laws, name)}," + "\n"
    words += rf"$\nu$ halved on the line from $\beta$ = {first} to {last}"
    look: dict[str, Any] = {"color": "black", "linewidth": 0.9, "linestyle": CRITICAL_LINE}
    axes.axvline(float(laws[name]), ymax=BELOW_LEGEND, zorder=0.6, label=words, **look)
    axes.legend(loc="upper right", fontsize=WORDS)
    low, high = axes.get_ylim()
    axes.set_ylim(top=low + (high - low) / BELOW_LEGEND)
    kept = {key: quantity(laws[key], [float(laws[key])]) for key in (name, f"{name}_error")}
    show(axes, "c", "critical roughness", kept, place(laws))


def _unit_of(cell: xr.Dataset, family: Family) -> str:
    return f"[{cell[family.dim].attrs.get('units', '1')}]"


def _draw_heterogeneity(
    axes: Axes, cell: xr.Dataset, laws: xr.Dataset, family: Family, comparable: bool
) -> None:
    """Draw the heterogeneity of the bulk flow against the stress."""
    axes.set(xscale="log", yscale="log")
    axes.set(xlabel=r"stress $\sigma$ [stress unit]", ylabel=r"$\delta_\mathrm{het}$ [1]")
    axes.set_title("(d) heterogeneity of the bulk flow")
    every: dict[int, tuple[FloatArray, FloatArray]] = {}
    for number, _, line in family.members(cell):
        stress = line["stress"].broadcast_like(line["heterogeneity"]).values.ravel()
        value, error = (line[f"heterogeneity{end}"].values.ravel() for end in ("", "_error"))
        known = np.isfinite(value) & (value > 0) & (stress > 0)
        verdict = verdicts(line, "steady_bulk")[known]
        draw_points(axes, stress[known], value[known], error[known], verdict, family.look(number))
        every[number] = stress[known], value[known]
        columns = {name: line[name] for name in ("heterogeneity", "heterogeneity_error")}
        points = {
            name: quantity(each, each.values.ravel()[known]) for name, each in columns.items()
        }
        show(axes, "d", "heterogeneity", along(line["heterogeneity"], known) | points, place(line))
    x, y = np.concatenate([np.stack(each) for each in every.values()], axis=1)
    if not len(x):
        leave_empty(axes, "no snapshot in a steady window")
        return
    draw_powers(axes, "d", "heterogeneity_exponent", every, laws, family)
    power = paper.HETEROGENEITY_EXPONENT
    if comparable:
        guide(axes, "d", x, y, power, rf"paper: power ${power.value:g}$")
    else:
        keep(axes, "d", "exponent", power)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper right", fontsize=WORDS)
    for axis in (axes.xaxis, axes.yaxis):
        label_decades(axis)
