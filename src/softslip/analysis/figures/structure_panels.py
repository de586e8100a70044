"""Structure between the walls: fluidity, shapes of particles, films and correlations."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.analysis.figures.drawing import (
    LINES,
    WIDE,
    grid_of_panels,
    named,
    sequence,
    styled,
    symbol,
)
from softslip.analysis.figures.markers import (
    DRIFTING,
    MEANINGS,
    STEADY,
    WITHIN_ERROR,
    draw_points,
    verdicts,
)
from softslip.analysis.figures.panels import (
    ROUGHNESS,
    Family,
    above,
    facets,
    family_of,
    leave_empty,
    legend_above,
    note_missing,
    share_limits,
    with_dimensions,
)
from softslip.analysis.figures.shown import Quantity, place, quantity, show
from softslip.analysis.fits.points import DRIVES
from softslip.analysis.observables import mean_over_seeds

PROFILES = {
    "fluidity": ("a", r"fluidity $\dot\gamma/\sigma$ [1 / time unit / stress unit]"),
    "particle_stress": ("b", r"particles' stress $\sigma_p$ [stress unit]"),
    "deformation": ("c", r"deformation $D$ [1]"),
    "orientation": ("d", r"angle of long axis to $x$ [degree]"),
}
"""What is drawn against the distance from the wall: its panel and its axis."""

LENGTHS = {
    "wall_film": ("e", r"wall film [range of repulsion]", "steady_wall"),
    "first_layer_gap": ("f", r"gap of first layer [range of repulsion]", "steady_wall"),
    "correlation_length": ("g", r"velocity correlation $\xi_v/R$ [1]", "steady_bulk"),
    "cooperativity_length": ("h", r"cooperativity $\xi/R$ [1]", "steady_bulk"),
}
"""What is drawn against the drive: its panel, its axis, and the flag of its steady state."""

FROM_SNAPSHOTS = {
    "deformation",
    "orientation",
    "wall_film",
    "first_layer_gap",
    "correlation_length",
}
"""What is measured in snapshots of particles; all else is in profiles of the flow."""

STATES = {
    STEADY: "(e-h) filled: steady",
    WITHIN_ERROR: MEANINGS[WITHIN_ERROR],
    DRIFTING: "open, dashed bars: drifting",
}
"""What symbols mean whose bars do not span a drift."""

PAGE = 1.3 * WIDE
"""Width of the page, of four panels a row [inch]."""

FEWEST = 2
"""Fewest finite points that make a line."""


@styled
def structure_page(dataset: xr.Dataset) -> Figure:
    """Draw profiles of fluidity and shape from the wall inwards, and lengths against the drive.

    (a) Local shear rate over stress, (b) the stress that particles carry, (c) their deformation and
    (d) orientation against the distance from the nearer wall: a colour for each stress, solid
    between the first walls of the family, dashed between the last. (e) Median film along the
    walls, with a bar from the 10 % to the 90 % quantile; (f) mean gap between the wall and the
    particles of the first layer, which lift off as it grows; (g) length over which velocities
    across the flow are correlated along it; (h) length over which walls change the fluidity.
    Shades and the other bars are standard errors.
    Further dimensions get two rows of panels each.

    Parameters
    ----------
    dataset
        From `analysis.observables.structure`.
    """
    table = with_dimensions(mean_over_seeds(dataset), ROUGHNESS)
    drive = next((dim for dim in DRIVES if dim in table.dims), DRIVES[0])
    table = with_dimensions(table, drive)
    family = family_of(table, drive)
    known = (drive, family.dim)
    rows = facets(table, *known)
    columns = len(PROFILES)
    figure, panels = grid_of_panels(2 * len(rows), columns, width=PAGE, height=2.5)
    for number, (title, chosen) in enumerate(rows):
        top, bottom = panels[2 * number : 2 * number + 2]
        _draw_profiles(table.sel(chosen), drive, family, top)
        _draw_lengths(table.sel(chosen), drive, family, bottom)
        top[0].set_ylabel(above(title, top[0].get_ylabel()))
    for row in (0, 1):
        for column in range(columns):
            share_limits([each[column] for each in panels[row::2]])
    legend_above(figure, panels[1][0])
    note_missing(figure, dataset, _explained(table, drive, family), known=known)
    return figure


def _explained(table: xr.Dataset, drive: str, family: Family) -> str:
    """Say what colours and lines mean."""
    low, high = (f"{float(end):.3g}" for end in (table[drive].min(), table[drive].max()))
    words = f"(a-d) colour: {symbol(drive)} from {low} (light) to {high} (dark)"
    first, last = (named(family.dim, family.values[end]) for end in (0, -1))
    if len(family.values) > 1:
        words += f", solid: {first}, dashed: {last}"
    bars = "bars and bands: standard errors, (e) from the 10 % to the 90 % quantile along the walls"
    return f"{words}; {bars}; {_explained_states(table)}"


def _explained_states(table: xr.Dataset) -> str:
    """Say what the symbols mean that occur."""
    done = (table["status"] == "done").values.ravel()
    flags = {flag for _, _, flag in LENGTHS.values()}
    seen = {str(each) for flag in flags for each in verdicts(table, flag)[done]}
    return "; ".join(words for state, words in STATES.items() if state in seen)


def _why_empty(cell: xr.Dataset, name: str) -> str:
    """Return why nothing is drawn of some quantity."""
    if not (cell["status"] == "done").any():
        return "no run is done"
    if name == "cooperativity_length":
        return "no profile of the fluidity\ndetermines it"
    if name not in FROM_SNAPSHOTS:
        return "no profile in a steady window"
    if not (cell["structure_snapshots"] > 0).any():
        return "no snapshot in a steady window"
    return "not determined"


def _draw_profiles(cell: xr.Dataset, drive: str, family: Family, panels: list[Axes]) -> None:
    colours = sequence(cell.sizes[drive])
    styles = dict(zip((len(family.values) - 1, 0), (LINES[1], LINES[0]), strict=True))
    for axes, (name, (panel, label)) in zip(panels, PROFILES.items(), strict=True):
        for number, style in styles.items():
            member = cell.isel({family.dim: number})
            for index, colour in enumerate(colours):
                _draw_profile(axes, panel, name, member.isel({drive: index}), colour, style)
        axes.set(xlabel="distance from wall [mean radius]", ylabel=label)
        if axes.has_data():
            axes.axhline(0, color="0.8", linewidth=0.6, zorder=0)
            axes.set_xlim(left=0)
        else:
            leave_empty(axes, _why_empty(cell, name))
        axes.set_title(f"({panel})", loc="left")


def _draw_profile(
    axes: Axes, panel: str, name: str, line: xr.Dataset, colour: Any, style: Any
) -> None:
    values, error = line[name].values, line[f"{name}_error"].values
    known = np.isfinite(values)
    if known.sum() < FEWEST:
        return
    (dim,) = map(str, line[name].dims)
    distance = line[dim].values
    axes.plot(distance[known], values[known], color=colour, linestyle=style, linewidth=1.0)
    low, high = (values + sign * np.nan_to_num(error) for sign in (-1, 1))
    look = {"color": colour, "alpha": 0.15, "linewidth": 0}
    axes.fill_between(distance[known], low[known], high[known], **look)
    names = (dim, name, f"{name}_error")
    points = {key: quantity(line[key], line[key].values[known]) for key in names}
    show(axes, panel, name.replace("_", " "), points, place(line))


def _draw_lengths(cell: xr.Dataset, drive: str, family: Family, panels: list[Axes]) -> None:
    for axes, (name, (panel, label, flag)) in zip(panels, LENGTHS.items(), strict=True):
        found = False
        for number, named_so, line in family.members(cell):
            values, spread = _with_bars(line, name)
            known = np.isfinite(values)
            look = family.look(number)
            if panel == "e" and named_so:
                axes.plot([], [], linestyle="none", label=named_so, **look)
            if not known.any():
                continue
            found = True
            bars = np.nan_to_num([each[known] for each in spread])
            stress = line[drive].values[known]
            draw_points(axes, stress, values[known], bars, verdicts(line, flag)[known], look)
            points = {
                drive: quantity(line[drive], stress),
                name: quantity(line[name], values[known]),
            }
            for end, bar in zip(("low", "high"), bars, strict=True):
                unit = str(line[name].attrs.get("units", "1"))
                points[f"{name}_{end}"] = Quantity(bar, unit, f"length of the bar, {end} end")
            show(axes, panel, name.replace("_", " "), points, place(line))
        if not found:
            leave_empty(axes, _why_empty(cell, name))
        axes.set(xlabel=_drive_label(cell, drive), ylabel=label)
        axes.set_ylim(bottom=0)
        axes.set_title(f"({panel})", loc="left")


def _with_bars(line: xr.Dataset, name: str) -> tuple[Any, list[Any]]:
    """Return values and the lengths of their bars downwards and upwards."""
    if name != "wall_film":
        error = line[f"{name}_error"].values
        return line[name].values, [error, error]
    low, median, high = (line[name].isel(quantile=place).values for place in range(3))
    return median, [median - low, high - median]


def _drive_label(cell: xr.Dataset, drive: str) -> str:
    words = {"stress": "stress", "imposed_shear_rate": "shear rate"}[drive]
    return f"{words} {symbol(drive)} [{cell[drive].attrs.get('units', '1')}]"
