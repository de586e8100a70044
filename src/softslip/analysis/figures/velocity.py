"""Normalised velocity profiles (Fig. 4)."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.analysis import paper
from softslip.analysis.figures.drawing import (
    COLOURS,
    LINES,
    WIDE,
    grid_of_panels,
    named,
    sequence,
    styled,
)
from softslip.analysis.figures.markers import DRIFTING, STEADY, WITHIN_ERROR, verdicts
from softslip.analysis.figures.panels import (
    above,
    facets,
    legend_above,
    note_missing,
    with_dimensions,
)
from softslip.analysis.figures.shown import place, quantity, show
from softslip.analysis.observables import mean_over_seeds

STATES: dict[str, tuple[Any, str]] = {
    STEADY: (LINES[0], "solid: walls steady"),
    WITHIN_ERROR: (LINES[1], "dashed: walls without a trend, but with a large standard error"),
    DRIFTING: (LINES[2], "dotted: walls drift"),
}
"""Line of each verdict on the walls, and what it means."""

ZOOM = 4.0
"""Width of the inset in thicknesses of the paper's solvent layer."""

WIDEST, SHRINK = 1.9, 0.82
"""Width of the first roughness's line [point], and by how much each next is thinner: lines that
coincide stay visible."""


@styled
def profiles(dataset: xr.Dataset, stress: float | None = None) -> Figure:
    """Draw profiles for all stresses at the smoothest wall, and all roughnesses at one stress.

    Lines are solid where the walls reached a steady speed, dashed where they did so only within
    their error, and dotted where they drift; the thin grey one is flow without slip. The inset
    zooms in on the lower wall. Further dimensions get a row of panels each.

    Parameters
    ----------
    dataset
        From `analysis.observables.profiles`.
    stress
        Stress of the right panel [stress unit], or the one there is that is nearest to it; by
        default the paper's 0.15.
    """
    table = with_dimensions(mean_over_seeds(dataset), "stress", "roughness")
    found = verdicts(table, "steady_wall").reshape(table["steady_wall"].shape)
    table = table.assign(walls=table["steady_wall"].copy(data=found))
    rows = facets(table, "stress", "roughness")
    figure, panels = grid_of_panels(len(rows), 2, width=WIDE, height=3.0)
    wanted = paper.PROFILE_STRESS.value if stress is None else stress
    for (title, chosen), (left, right) in zip(rows, panels, strict=True):
        _draw_row(table.sel(chosen), wanted, left, right)
        left.set_ylabel(above(title, r"$v_\mathrm{norm}$ [1]"))
        right.tick_params(labelleft=False)
    legend_above(figure, panels[0][0], most=7)
    note_missing(figure, dataset, _explained(table), known=("stress", "roughness"))
    return figure


def _explained(table: xr.Dataset) -> str:
    """Say what the lines mean that occur, and the bands where there are any."""
    seen = set(table["walls"].values[table["status"].values == "done"].tolist())
    words = [meaning for state, (_, meaning) in STATES.items() if state in seen]
    if np.isfinite(table["normalised_velocity_error"]).any():
        words.append("bands: standard errors")
    return "; ".join([*words, "thin grey: no slip", "inset: at the lower wall"])


def _draw_row(cell: xr.Dataset, wanted: float, left: Axes, right: Axes) -> None:
    smooth = cell.isel(roughness=int(np.argmin(np.nan_to_num(cell["roughness"].values))))
    stresses = smooth["stress"].values
    inset = left.inset_axes((0.60, 0.10, 0.37, 0.32))
    for axes in (left, inset):
        for number, colour in enumerate(sequence(len(stresses))):
            label = named("stress", stresses[number])
            _draw_profile(axes, smooth.isel(stress=number), colour, label)
    for number in range(len(stresses)):
        _keep_profile(left, "left", smooth.isel(stress=number))
    _draw_zoom(inset, smooth)
    known = np.where(stresses > 0, stresses, np.inf)
    nearest = int(np.argmin(np.abs(np.log(known / wanted))))
    driven = cell.isel(stress=nearest)
    for number, roughness in enumerate(driven["roughness"].values):
        colour = COLOURS[number % len(COLOURS)]
        line = driven.isel(roughness=number)
        _draw_profile(right, line, colour, named("roughness", roughness), WIDEST * SHRINK**number)
        _keep_profile(right, "right", line)
    titles = (
        (left, named("roughness", smooth["roughness"].item())),
        (right, named("stress", stresses[nearest])),
    )
    for axes, title in titles:
        frame_profiles(axes)
        axes.set_title(title)
    if right.get_legend_handles_labels()[1]:
        right.legend(loc="upper left")


def _draw_profile(
    axes: Axes, line: xr.Dataset, colour: Any, label: str, width: float = 1.1
) -> None:
    if not np.isfinite(line["normalised_velocity"].values).any():
        return
    style, _ = STATES[line["walls"].item()]
    draw_normalised(axes, line, colour, linestyle=style, linewidth=width, label=label or None)


def frame_profiles(axes: Axes) -> None:
    """Give a panel of normalised profiles its limits and the dotted line of flow without slip."""
    axes.plot([0, 1], [0, 1], color="0.5", linestyle=":", linewidth=0.8, zorder=0)
    axes.set(xlim=(0, 1), ylim=(-0.02, 1.02), xlabel=r"$y_\mathrm{norm} = y/H$ [1]")


def draw_normalised(axes: Axes, profile: xr.Dataset, colour: Any, **look: Any) -> None:
    """Draw a normalised profile with a band of its standard error.

    Parameters
    ----------
    axes
        Where.
    profile
        From `analysis.observables.mean_profile`, or one of a table of them.
    colour, look
        Of the line.
    """
    names = ("normalised_position", "normalised_velocity", "normalised_velocity_error")
    position, velocity, error = (profile[name].values for name in names)
    axes.plot(position, velocity, color=colour, **look)
    if np.isfinite(error).any():
        low, high = velocity - error, velocity + error
        axes.fill_between(position, low, high, color=colour, alpha=0.2, linewidth=0)


def _keep_profile(axes: Axes, panel: str, line: xr.Dataset) -> None:
    """Keep the numbers of a profile, where there is one."""
    if np.isfinite(line["normalised_velocity"].values).any():
        kind = f"walls {line['walls'].item()}"
        names = ("normalised_position", "normalised_velocity", "normalised_velocity_error")
        show(axes, panel, kind, {name: quantity(line[name]) for name in names}, place(line))


def _draw_zoom(inset: Axes, smooth: xr.Dataset) -> None:
    """Show the solvent layer at the lower wall."""
    height = float(smooth["wall_separation"]) if "wall_separation" in smooth.coords else np.nan
    reach = ZOOM * paper.SOLVENT_LAYER.value / height if np.isfinite(height) else 0.05
    near = smooth["normalised_position"].values <= reach
    shown = smooth["normalised_velocity"].values[..., near]
    top = float(np.nanmax(shown)) if np.isfinite(shown).any() else 1.0
    inset.set(xlim=(0, reach), ylim=(-0.03 * top, max(1.08 * top, 1e-3)))
    inset.tick_params(labelsize=7)
    inset.patch.set_alpha(0.9)
