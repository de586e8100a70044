"""Error against cost of all settings, and rates against the regularisation length."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from softslip.analysis.figures.drawing import COLOURS, WIDE, grid_of_panels, note, sequence, styled
from softslip.analysis.figures.shown import Quantity, quantity, show, words

SYMBOLS = {
    "slip_velocity": r"V_\mathrm{s}",
    "shear_rate_wall": r"\dot\gamma_\mathrm{wall}",
    "shear_rate_bulk": r"\dot\gamma_\mathrm{bulk}",
}
"""How quantities are written."""

DRAWN = ("slip_velocity", "shear_rate_bulk")
"""Quantities that are drawn over the regularisation length."""

MARKERS = {"mesh": "s", "other": "x"}
"""Markers of the variants: meshes, and all others."""

SHOWN = (0.0, 1.3)
"""Rates over their limit that are shown; coarse meshes may be far outside."""


@styled
def tradeoff(dataset: xr.Dataset) -> Figure:
    """Draw error against cost: with what regularisation does, and without.

    Left, the error against the limit of no regularisation; right, what nodes, steps and scheme
    have in it, against the finest member of the same regularisation length.

    Parameters
    ----------
    dataset
        Of `studies.tradeoff.table.gather`.
    """
    figure, ((left, right),) = grid_of_panels(1, 2, width=WIDE, height=3.6)
    for axes, name, panel in ((left, "total_error", "a"), (right, "numerical_error", "b")):
        _draw_members(axes, dataset, name, panel)
        axes.set(xscale="log", yscale="log", xlabel="cost over that of fidelity standard")
        axes.margins(0.15, 0.12)
        axes.grid(alpha=0.2, linewidth=0.4)
    _draw_front(left, dataset)
    band = _draw_scatter(left, dataset)
    floor = float(dataset["floor"].max())
    said = ""
    if np.isfinite(floor) and floor > 0:
        points = {"floor": quantity(dataset["floor"], [floor])}
        show(left, "", "by which trajectories of displaced nodes part", points)
        said = f"trajectories of displaced nodes part by {floor:.0e} only"
    left.set(ylabel=r"largest error against $\varepsilon\to0$")
    left.set_title("(a) all errors")
    right.set(ylabel=r"largest error at the same $\varepsilon$")
    right.set_title("(b) nodes, steps and scheme")
    for axes in (left, right):
        # Costs may span less than two decades, of which powers of ten alone would label one place.
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    note(figure, band, said)
    return figure


def _keep_members(
    axes: Axes, dataset: xr.Dataset, panel: str, series: str, name: str, here: NDArray[Any]
) -> None:
    """Keep cost and error of some members."""
    chosen = {key: dataset[key] for key in ("cost_ratio", name, "regularisation")}
    points = {key: quantity(each, each.values[here]) for key, each in chosen.items()}
    member = Quantity(words(dataset["member"].values[here]), "1", "name of the settings")
    show(axes, panel, series, {"member": member} | points)


def _draw_members(axes: Axes, dataset: xr.Dataset, name: str, panel: str) -> None:
    """Draw the grid in the colours of ε, levels with their names, variants in grey."""
    cost, error = dataset["cost_ratio"].values, dataset[name].values
    kinds, spreads = dataset["kind"].values, dataset["regularisation"].values
    grid = np.isin(kinds, ("factorial", "finest"))
    shown = np.unique(np.round(spreads[grid & np.isfinite(spreads)], 9))
    for colour, spread in zip(sequence(len(shown)), shown, strict=True):
        here = grid & np.isclose(spreads, spread) & (error > 0)
        axes.plot(
            cost[here],
            error[here],
            "o",
            color=colour,
            markersize=3.5,
            markeredgewidth=0,
            label=rf"$\varepsilon$ = {spread:.2g} dx",
        )
        _keep_members(axes, dataset, panel, "grid of settings", name, here)
    names = dataset["member"].values
    for mesh, marker in ((False, MARKERS["other"]), (True, MARKERS["mesh"])):
        here = (kinds == "variant") & (error > 0)
        here &= np.array([("mesh" in str(each)) == mesh for each in names])
        label = "the paper's scheme" if mesh else "variants of a level"
        axes.plot(
            cost[here],
            error[here],
            marker,
            color="0.55",
            fillstyle="none",
            markersize=4,
            linestyle="none",
            label=label if here.any() else None,
        )
        _keep_members(axes, dataset, panel, label, name, here)
        if mesh:
            for x, y, each in zip(cost[here], error[here], names[here], strict=True):
                _label(axes, x, y, str(each).replace("mesh-", "1/"), "0.4", left=True)
    levels = np.flatnonzero((kinds == "level") & (error > 0))
    _keep_members(axes, dataset, panel, "levels of fidelity", name, levels)
    for place, number in enumerate(levels[np.argsort(cost[levels])]):
        x, y = cost[number], error[number]
        axes.plot(x, y, "D", color=COLOURS[1], markersize=6, fillstyle="none")
        text = str(names[number]).removeprefix("level-")
        # Levels of about the same cost would write over one another, the last one over the edge.
        _label(axes, x, y, text, COLOURS[1], left=place % 3 == 0)


def _label(
    axes: Axes, x: float, y: float, text: str, colour: str, *, rise: float = 5, left: bool = False
) -> None:
    """Write a name beside a point, higher or lower by some points."""
    axes.annotate(
        text,
        (x, y),
        xytext=(-5 if left else 5, rise),
        textcoords="offset points",
        ha="right" if left else "left",
        fontsize=7.5,
        color=colour,
    )


def _draw_front(axes: Axes, dataset: xr.Dataset) -> None:
    """Join the members that no other one beats in both error and cost."""
    best = np.flatnonzero(dataset["pareto"].values == 1)
    best = best[np.argsort(dataset["cost_ratio"].values[best])]
    axes.step(
        dataset["cost_ratio"].values[best],
        dataset["total_error"].values[best],
        where="post",
        color="0.2",
        linewidth=0.8,
        zorder=1,
        label="best for its cost",
    )
    _keep_members(axes, dataset, "a", "best for its cost", "total_error", best)


def _draw_scatter(axes: Axes, dataset: xr.Dataset) -> str:
    """Draw what two packings differ by as a band; return what it is, in words."""
    if "seed_scatter" not in dataset:
        return ""
    stress = float(dataset["steady_stress"].max())
    here = dataset.sel(quantity=list(DRAWN), steady_stress=stress, steady_roughness=0.0)
    means = abs(here["steady_mean"].mean("steady_regularisation"))
    shares = (here["seed_scatter"] / means).values
    shares = shares[np.isfinite(shares)]
    if not shares.size:
        return ""
    axes.axhspan(float(shares.min()), float(shares.max()), color="0.5", alpha=0.15, linewidth=0)
    meaning = "standard deviation between packings over the mean of steady rates"
    ends = {"scatter_low": shares.min(), "scatter_high": shares.max()}
    points = {key: Quantity([float(end)], "1", meaning) for key, end in ends.items()}
    show(axes, "a", "scatter between packings", points, {"stress": _stress(stress)})
    return (
        "band: standard deviation between packings of steady "
        rf"$V_\mathrm{{s}}$ and $\dot\gamma_\mathrm{{bulk}}$, smooth walls, $\sigma$ = {stress:g}"
    )


@styled
def extrapolation(dataset: xr.Dataset) -> Figure:
    """Draw V_s and γ̇_bulk over the regularisation length, with their limits and mesh schemes.

    Above, short windows from one state; below, if there are any, steady averages.

    Parameters
    ----------
    dataset
        Of `studies.tradeoff.table.gather`.
    """
    rows = 2 if "steady_mean" in dataset else 1
    figure, panels = grid_of_panels(rows, len(DRAWN), width=WIDE, height=2.4)
    outside: list[str] = []
    for column, name in enumerate(DRAWN):
        outside += _draw_short(panels[0][column], dataset.sel(quantity=name), "ab"[column], name)
        title = rf"({'ab'[column]}) ${SYMBOLS[name]}$, from one state"
        panels[0][column].set_title(title)
        if rows == 2:
            _draw_steady(panels[1][column], dataset.sel(quantity=name), "cd"[column], name)
            title = rf"({'cd'[column]}) ${SYMBOLS[name]}$, steady"
            panels[1][column].set_title(title)
        for row in panels:
            row[column].set(
                ylabel=rf"${SYMBOLS[name]}$ over its limit",
                xlabel=r"$\varepsilon$ [mesh size of the paper]",
            )
            row[column].set_xlim(left=0.0)
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    paper = float(dataset.attrs["paper_regularisation"])
    show(panels[0][0], "", "mesh of the paper", {"regularisation": _regularisation([paper])})
    for row in panels:
        for axes in row:
            axes.set_ylim(*SHOWN)
            axes.axvline(paper, color="0.6", linewidth=0.6, linestyle=(0, (1, 1)), zorder=0)
            axes.axhline(1.0, color="0.6", linewidth=0.6, zorder=0)
    counts = ", ".join(f"{outside.count(name)} of {name}" for name in sorted(set(outside)))
    said = f"points outside the panels: {counts}" if outside else ""
    figure_note = (
        rf"dotted: the paper's mesh of 1/8192, $\varepsilon$ = {paper:.2g}; "
        "open in (a, b): meshes, below: not all runs steady"
    )
    note(figure, figure_note, said)
    return figure


def _stress(stress: float) -> Quantity:
    return Quantity(stress, "stress unit", "imposed shear stress")


def _regularisation(values: Any) -> Quantity:
    return Quantity(values, "1", "regularisation length over the mesh size of the paper")


def _over_limit(name: str, values: Any) -> dict[str, Quantity]:
    key = f"{name}_over_limit"
    return {key: Quantity(values, "1", f"{name.replace('_', ' ')} over its limit at no length")}


def _scene(place: dict[str, Any]) -> dict[str, Quantity]:
    """Return stress and roughness of a scene, whatever its dimensions are called."""
    stress, roughness = place.values()
    return {
        "stress": _stress(stress),
        "roughness": Quantity(roughness, "1", "roughness of the walls"),
    }


def _scenes(dataset: xr.Dataset, prefix: str = "") -> list[tuple[dict[str, Any], str, Any, str]]:
    """Return each scene's place, words, colour and marker."""
    stresses = dataset[f"{prefix}stress"].values
    roughnesses = dataset[f"{prefix}roughness"].values
    return [
        (
            {f"{prefix}stress": stress, f"{prefix}roughness": roughness},
            rf"$\sigma$ = {stress:g}, $\beta$ = {roughness:g}",
            COLOURS[(row * len(roughnesses) + column) % len(COLOURS)],
            "os^D"[column % 4],
        )
        for row, stress in enumerate(stresses)
        for column, roughness in enumerate(roughnesses)
    ]


def _draw_short(axes: Axes, dataset: xr.Dataset, panel: str, name: str) -> list[str]:
    """Draw the finest members with the tangent of their fit at ε = 0, and the meshes.

    Returns the names of meshes outside of what is shown, one for each point.
    """
    outside: list[str] = []
    kinds = dataset["kind"].values
    spreads = dataset["regularisation"].values
    names = np.array([str(name) for name in dataset["member"].values])
    finest = np.flatnonzero(kinds == "finest")
    finest = finest[np.argsort(spreads[finest])]
    meshes = np.flatnonzero(np.char.startswith(names, "mesh"))
    for place, label, colour, marker in _scenes(dataset):
        here = dataset.sel(place)
        limit, slope = float(here["limit"]), float(here["limit_slope"])
        if not abs(limit) > 0:
            continue
        values = here["mean"].values / limit
        axes.plot(spreads[finest], values[finest], marker, color=colour, label=label)
        reach = np.array([0.0, float(spreads[finest].max())])
        for series, chosen in (("finest settings", finest), ("meshes", meshes)):
            member = {"member": Quantity(words(names[chosen]), "1", "name of the settings")}
            points = member | {"regularisation": _regularisation(spreads[chosen])}
            points |= _over_limit(name, values[chosen])
            show(axes, panel, series, points, _scene(place))
        if np.isfinite(slope):
            axes.plot(reach, 1 + slope / limit * reach, color=colour, linewidth=0.7)
            points = _over_limit(name, 1 + slope / limit * reach)
            points = {"regularisation": _regularisation(reach)} | points
            show(axes, panel, "tangent at no length", points, _scene(place))
        axes.plot(
            spreads[meshes], values[meshes], marker, color=colour, fillstyle="none", markersize=6
        )
        outside += [
            str(names[mesh])
            for mesh in meshes
            if np.isfinite(values[mesh]) and not SHOWN[0] <= values[mesh] <= SHOWN[1]
        ]
    return outside


def _draw_steady(axes: Axes, dataset: xr.Dataset, panel: str, name: str) -> None:
    """Draw steady averages with their errors and the line through them; open: not all steady."""
    spreads = dataset["steady_regularisation"].values
    order = np.argsort(spreads)
    for place, label, colour, marker in _scenes(dataset, "steady_"):
        here = dataset.sel(place)
        limit, slope = float(here["steady_limit"]), float(here["steady_slope"])
        error = float(here["steady_limit_error"])
        if not (np.isfinite(limit) and abs(limit) > 2 * error):
            continue  # A ratio to what may be zero says nothing.
        steady = here["steady_runs"].values[order] >= here["packings"].values
        for some, filled in ((steady, "full"), (~steady, "none")):
            ratio = here["steady_mean"].values[order][some] / limit
            own = here["steady_error"].values[order][some] / abs(limit)
            series = "all runs steady" if filled == "full" else "not all runs steady"
            _keep_steady(axes, panel, series, name, (spreads[order][some], ratio, own), place)
            axes.errorbar(
                spreads[order][some],
                ratio,
                own,
                fmt=marker,
                fillstyle=filled,
                color=colour,
                linewidth=0.8,
            )
        reach = np.array([0.0, float(spreads.max())])
        axes.plot(reach, 1 + slope / limit * reach, color=colour, linewidth=0.7)
        axes.errorbar(0.0, 1.0, error / abs(limit), color=colour, capsize=3, linewidth=0.8)
        straight = (reach, 1 + slope / limit * reach, np.full(2, np.nan))
        _keep_steady(axes, panel, "line through the averages", name, straight, place)
        end = tuple(np.array([each]) for each in (0.0, 1.0, error / abs(limit)))
        _keep_steady(axes, panel, "limit at no length", name, end, place)
        axes.plot([], [], marker, color=colour, label=label)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="lower left")


def _keep_steady(
    axes: Axes,
    panel: str,
    series: str,
    name: str,
    columns: tuple[NDArray[Any], ...],
    place: dict[str, Any],
) -> None:
    """Keep lengths, ratios and their errors."""
    spread, ratio, error = columns
    points = {"regularisation": _regularisation(spread)} | _over_limit(name, ratio)
    points[f"{name}_over_limit_error"] = Quantity(error, "1", "its standard error")
    show(axes, panel, series, points, _scene(place))
