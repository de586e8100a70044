"""A movie of a sample: its particles by how fast they rearrange, and the rates in time."""

from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from softslip.analysis.figures.drawing import COLOURS, NARROW, label_decades, styled
from softslip.analysis.figures.membranes import (
    LENGTH_UNIT,
    WALL,
    WALL_DEPTH,
    conditions,
    moment_shown,
    name_axes,
)
from softslip.analysis.figures.movie import Movie, even_pixels
from softslip.analysis.figures.panels import leave_empty
from softslip.analysis.figures.periodic_outlines import FloatArray, images, wall_bodies
from softslip.analysis.figures.shown import Quantity, quantity, show
from softslip.analysis.observables import parameters_of
from softslip.analysis.observables.contours import contours
from softslip.analysis.observables.non_affine_motion import non_affine_motion
from softslip.errors import DatasetError
from softslip.files.products import MOVIE_SNAPSHOTS

RESOLUTION = 160
"""Pixels an inch."""

WIDEST, TALLEST = 5.2, 4.8
"""Room for the channel [inch]."""

BESIDE, AROUND, STRIP = 1.85, 1.15, 1.2
"""Width beside the channel, height around the panels, and that of the rates [inch]."""

COLOUR_MAP = "viridis"
"""Perceptually uniform, and told apart by the colour-blind."""

UNKNOWN = "0.8"
"""Colour of a particle whose non-affine speed is not known: it has too few neighbours."""

EXTREMES = (0.05, 0.99)
"""Quantiles of the non-affine speeds of all snapshots that the colours span."""

RATES = {
    "shear_rate_wall": ("0.55", r"$\dot\gamma_\mathrm{wall}$"),
    "shear_rate_bulk": (COLOURS[0], r"$\dot\gamma_\mathrm{bulk}$"),
}
"""The rates below the channel: their colours and symbols."""


@styled
def moving_sample(run: xr.Dataset) -> Movie:
    """Show a sample at every snapshot that was kept, one after the other.

    Particles have the colour of their non-affine speed: how much their neighbours depart from
    affine motion, by the least-squares measure of Falk and Langer
    (`observables.non_affine_motion`). It is taken from the velocities at the moment that is shown,
    not from displacements between snapshots: these are the same where snapshots are near each other
    and mean nothing where neighbours have changed in between, as they do in all flow. Over the mean
    radius it has the unit of the shear rate, with which it is to be compared: well below that,
    particles move affinely, as in an elastic solid. The colours are those of one logarithmic scale
    for the whole movie.

    Positions are as they were kept, and nothing is shown between snapshots. Below, the shear rates
    of the whole run, with a line at the moment that is shown.

    Parameters
    ----------
    run
        A shear run with snapshots: that of a scenario that is nearest to the paper's.

    Raises
    ------
    DatasetError
        When it has fewer than `files.products.MOVIE_SNAPSHOTS`.
    """
    count = run.sizes.get("snapshot", 0)
    if count < MOVIE_SNAPSHOTS:
        raise DatasetError(
            f"run {run.attrs.get('run', '?')}: has {count} snapshots, and a movie takes "
            f"{MOVIE_SNAPSHOTS} or more; ask for more times in recording.snapshots"
        )
    run = run.load()
    motion = [non_affine_motion(run, number) for number in range(count)]
    figure, axes, below = _panels(run)
    colours = _colours(np.concatenate([speeds for _, speeds in motion]))
    label = r"non-affine speed$/R$ [1 / time unit]"
    bar = figure.colorbar(colours, ax=axes, label=label, extend="both", aspect=30, pad=0.02)
    label_decades(bar.ax.yaxis)
    mark = _draw_rates(run, below)
    for number, (centroids, speeds) in enumerate(motion):
        _keep_particles(axes, run, number, centroids, speeds)
    particles = PolyCollection(
        [], edgecolors="black", linewidths=0.4, cmap=colours.cmap, norm=colours.norm, zorder=1
    )
    walls = PolyCollection([], facecolors=WALL, zorder=3)
    axes.add_collection(particles)
    axes.add_collection(walls)
    clock = figure.suptitle(" ", x=0.02, ha="left")

    def turn_to(number: int) -> None:
        moment = float(run["snapshot_time"][number])
        clock.set_text(", ".join([*conditions(run), rf"$t$ = {moment:.4g} time units"]))
        outlines, speeds, bodies = _shapes(run, number, motion[number][1])
        particles.set_verts(outlines)
        particles.set_array(speeds)
        walls.set_verts(bodies)
        # There is no place for time 0 on a logarithmic axis.
        mark.set_xdata([moment, moment])
        mark.set_visible(moment > 0)

    turn_to(count - 1)
    figure.draw_without_rendering()
    # From now on nothing moves but what is shown.
    figure.set_layout_engine("none")
    edges = axes.spines.values()
    return Movie(figure, count, (particles, walls, *edges, mark, clock), turn_to)


def _panels(run: xr.Dataset) -> tuple[Figure, Axes, Axes]:
    """Return a figure with a panel for the channel and one for the rates."""
    given = parameters_of(run)
    length, depth = given.channel.length, WALL_DEPTH * given.suspension.mean_radius
    bottom, top = -depth, given.channel.height + depth
    scale = min(WIDEST / length, TALLEST / (top - bottom))
    tall = scale * (top - bottom)
    width = even_pixels(max(scale * length + BESIDE, NARROW), RESOLUTION)
    total = even_pixels(tall + STRIP + AROUND, RESOLUTION)
    figure = Figure(figsize=(width, total), dpi=RESOLUTION, layout="constrained")
    axes, below = figure.subplots(2, 1, height_ratios=(tall, STRIP))
    axes.set(xlim=(0.0, length), ylim=(bottom, top), aspect="equal")
    name_axes(axes)
    return figure, axes, below


def _colours(speeds: FloatArray) -> ScalarMappable:
    """Return the colours of speeds, of which some may not be known."""
    known = speeds[np.isfinite(speeds) & (speeds > 0)]
    low, high = np.quantile(known, EXTREMES) if known.size else (0.1, 1.0)
    shades = matplotlib.colormaps[COLOUR_MAP].with_extremes(bad=UNKNOWN)
    # One speed alone has no scale.
    return ScalarMappable(LogNorm(low, max(high, 1.01 * low)), shades)


def _shapes(
    run: xr.Dataset, number: int, speeds: FloatArray
) -> tuple[list[FloatArray], FloatArray, list[FloatArray]]:
    """Return outlines of particles with their images, a speed for each, and the walls' outlines."""
    given = parameters_of(run)
    length, depth = given.channel.length, WALL_DEPTH * given.suspension.mean_radius
    membranes, walls = contours(run, number)
    outlines: list[FloatArray] = []
    owners: list[int] = []
    for owner, membrane in enumerate(membranes):
        seen = [outline for _, outline in images(membrane, length)]
        outlines += seen
        owners += [owner] * len(seen)
    return outlines, speeds[owners], wall_bodies(walls, length, given.channel.height, depth)


def _draw_rates(run: xr.Dataset, axes: Axes) -> Line2D:
    """Draw the shear rates in time, and return the line that marks a moment."""
    axes.set(xscale="log", yscale="log", xlabel=r"time $t$ [time unit]")
    axes.set_ylabel("shear rate\n[1 / time unit]")
    time = run["time"].values
    look: dict[str, Any] = {"linewidth": 1.2}
    for name, (colour, words) in RATES.items():
        if name not in run:
            continue
        rate = run[name].values
        positive = np.where(rate > 0, rate, np.nan)
        if np.isfinite(positive).any():
            axes.plot(time, positive, color=colour, label=words, **look)
            points = {"time": quantity(run["time"]), name: quantity(run[name], positive)}
            show(axes, "", name.replace("_", " "), points)
    if axes.lines:
        axes.legend(loc="lower left")
        axes.set_xlim(time[0], time[-1])
    else:
        leave_empty(axes, "no positive rate")
    return axes.axvline(time[-1], color="black", linewidth=0.8)


def _keep_particles(
    axes: Axes, run: xr.Dataset, number: int, centroids: FloatArray, speeds: FloatArray
) -> None:
    """Keep where particles are at a snapshot, and their colours' numbers."""
    points = {
        "particle": Quantity(np.arange(len(speeds)), "1", "number of the particle"),
        "x": Quantity(centroids[:, 0], LENGTH_UNIT, "place along the flow"),
        "y": Quantity(centroids[:, 1], LENGTH_UNIT, "height above the flat part of the lower wall"),
        "non_affine_speed": Quantity(
            speeds, "1 / time unit", "departure of neighbours from affine motion over mean radius"
        ),
    }
    show(axes, "", "particle", points, moment_shown(run, number))
