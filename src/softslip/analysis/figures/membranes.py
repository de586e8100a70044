"""A snapshot of particles, walls and flow (Figs. 1 and 3)."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from numpy.typing import ArrayLike

from softslip.analysis.figures.drawing import NARROW, WIDE, named, note, styled
from softslip.analysis.figures.periodic_outlines import FloatArray, images, tiled, wall_bodies
from softslip.analysis.figures.shown import Quantity, show
from softslip.analysis.observables import non_affine_velocity, parameters_of
from softslip.analysis.observables.contours import contours
from softslip.config.parameters import Parameters
from softslip.errors import DatasetError

LENGTH_UNIT = "length unit"

PARTICLE, OUTLINE, WALL, ARROW = "#8FBBDD", "#1F5A8C", "black", "black"
"""Colours of a particle's inside, its membrane, the walls and the arrows."""

ARROW_DISTANCE = 1.0
"""Least distance between arrows [mean radius]."""

MOST_ARROWS = 36
"""Most arrows along either side of the channel."""

ARROW_LENGTH = 1.1
"""Length of a long arrow (95th percentile) over the distance between arrows."""

WALL_DEPTH = 0.6
"""Thickness of a wall as drawn [mean radius]."""

MARGINS = 0.75
"""Height of the figure above and below the channel [inch]."""

KEY_HEIGHT = 0.1
"""Height of the arrow that tells the scale above the channel [inch]."""


@styled
def snapshot(
    run: xr.Dataset,
    snapshot: int | None = None,
    time: float | None = None,
    *,
    window: float | None = None,
    remark: str = "",
) -> Figure:
    """Draw particles, walls and the non-affine velocity (Eq. 29) at one moment.

    Particles that cross the periodic boundary are drawn at both ends. Arrows are drawn at the
    points of the kept velocity field, thinned to one a radius; a run without bulk observables
    has none, and the figure says so.

    Parameters
    ----------
    run
        A shear run with snapshots.
    snapshot
        Which of them; the last by default.
    time
        If given, the snapshot nearest to this time [time unit] is drawn instead.
    window
        If given, the side of the part in the middle of the channel that is drawn [mean radius],
        with an arrow at every point of the kept field.
    remark
        Said below the figure.

    Raises
    ------
    DatasetError
        When the run has no such snapshot.
    """
    count = run.sizes.get("snapshot", 0)
    if snapshot is None:
        snapshot = max(count - 1, 0)
    if time is not None and count:
        snapshot = int(np.argmin(np.abs(run["snapshot_time"].values - time)))
    if not 0 <= snapshot < count:
        raise DatasetError(
            f"run {run.attrs.get('run', '?')}: has {count} snapshots, so there is none of number "
            f"{snapshot}; ask for times in recording.snapshots"
        )
    given = parameters_of(run)
    length, height = given.channel.length, given.channel.height
    depth = WALL_DEPTH * given.suspension.mean_radius
    (left, right), (bottom, top) = _part(given, depth, window)
    width = float(np.clip(5.0 * (right - left) / (top - bottom), 0.95 * NARROW, WIDE))
    size = (width, 0.85 * width * (top - bottom) / (right - left) + MARGINS)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    particles, walls = contours(run, snapshot)
    at = moment_shown(run, snapshot)
    _draw_particles(axes, particles, length, at)
    _draw_walls(axes, walls, length, height, depth)
    for name, wall in zip(("lower wall", "upper wall"), walls, strict=True):
        _keep_wall(axes, name, tiled(wall, length), length, at)
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    missing = _draw_arrows(figure, axes, run, snapshot, walls, whole=window is None)
    name_axes(axes)
    moment = float(run["snapshot_time"][snapshot])
    axes.set_title(", ".join([*conditions(run), f"$t$ = {moment:.4g}"]), loc="left")
    note(figure, missing, remark)
    return figure


def _part(
    given: Parameters, depth: float, window: float | None
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ends of the part that is drawn along x and y: all, or a square in the middle."""
    length, height = given.channel.length, given.channel.height
    if window is None:
        return (0.0, length), (-depth, height + depth)
    half = 0.5 * min(window * given.suspension.mean_radius, length, height)
    return (
        (0.5 * length - half, 0.5 * length + half),
        (0.5 * height - half, 0.5 * height + half),
    )


def name_axes(axes: Axes) -> None:
    """Name the axes along the channel and across it."""
    axes.set(xlabel=r"$x$ [length unit]", ylabel=r"$y$ [length unit]")
    axes.tick_params(which="both", direction="out", top=False, right=False)


def conditions(run: xr.Dataset) -> list[str]:
    """Return what drives a run and its roughness, in symbols."""
    given = parameters_of(run)
    drive = ("stress", given.rheometer.stress)
    if drive[1] is None:
        drive = ("imposed_shear_rate", given.rheometer.shear_rate)
    return [named(*drive), named("roughness", given.wall.roughness)]


def moment_shown(run: xr.Dataset, snapshot: int) -> dict[str, Quantity]:
    """Return what all that is shown of a snapshot has in common."""
    given = parameters_of(run)
    found = {
        "stress": Quantity(given.rheometer.stress, "stress unit", "imposed shear stress"),
        "imposed_shear_rate": Quantity(
            given.rheometer.shear_rate, "1 / time unit", "imposed shear rate"
        ),
        "roughness": Quantity(given.wall.roughness, "1", "roughness of the walls"),
        "snapshot_time": Quantity(
            float(run["snapshot_time"][snapshot]), "time unit", "time of the snapshot"
        ),
    }
    return {name: each for name, each in found.items() if each.values is not None}


def _points(x: ArrayLike, y: ArrayLike) -> dict[str, Quantity]:
    return {
        "x": Quantity(x, LENGTH_UNIT, "place along the flow"),
        "y": Quantity(y, LENGTH_UNIT, "height above the flat part of the lower wall"),
    }


def _keep_wall(
    axes: Axes, name: str, contour: FloatArray, length: float, at: dict[str, Quantity]
) -> None:
    """Keep the part of a wall's contour that lies in the channel."""
    x, y = contour.T
    inside = (x >= 0) & (x <= length)
    show(axes, "", name, _points(x[inside], y[inside]), at)


def _draw_particles(
    axes: Axes, particles: list[FloatArray], length: float, at: dict[str, Quantity]
) -> None:
    outlines = []
    for number, contour in enumerate(particles):
        for image, outline in images(contour, length):
            outlines.append(outline)
            whose = {
                "particle": Quantity(number, "1", "number of the particle"),
                "image": Quantity(image, "1", "number of its periodic image"),
            }
            show(axes, "", "particle", _points(*outline.T), at | whose)
    axes.add_collection(
        PolyCollection(outlines, facecolors=PARTICLE, edgecolors=OUTLINE, linewidths=0.6, zorder=1)
    )


def _draw_walls(
    axes: Axes, walls: list[FloatArray], length: float, height: float, depth: float
) -> None:
    for body in wall_bodies(walls, length, height, depth):
        axes.add_collection(PolyCollection([body], facecolors=WALL, zorder=3))


def _draw_arrows(
    figure: Figure,
    axes: Axes,
    run: xr.Dataset,
    snapshot: int,
    walls: list[FloatArray],
    *,
    whole: bool,
) -> str:
    """Draw the non-affine velocity; return what to say where there is none."""
    given = parameters_of(run)
    if given.recording.bulk_margin is None:
        return "no arrows: the run records no bulk"
    flow = non_affine_velocity(run, snapshot)
    if not np.isfinite(float(flow["heterogeneity"])):
        return "no arrows: the bulk does not flow"
    radius, length = given.suspension.mean_radius, given.channel.length
    distance = max(ARROW_DISTANCE * radius, max(length, given.channel.height) / MOST_ARROWS)
    spacing = {dim: float(np.diff(flow[dim].values).mean()) for dim in ("field_x", "field_y")}
    if not whole:
        distance = max(spacing.values())
    steps = {dim: max(round(distance / each), 1) for dim, each in spacing.items()}
    chosen = flow.isel({dim: slice(step // 2, None, step) for dim, step in steps.items()})
    x, y = np.meshgrid(chosen["field_x"].values, chosen["field_y"].values)
    velocity = chosen["non_affine_velocity"].transpose("field_y", "field_x", "axis").values
    low, high = (_height_at(wall, x, length) for wall in walls)
    fluid = (y > low) & (y < high)
    for place, ends in ((x, axes.get_xlim()), (y, axes.get_ylim())):
        fluid &= (place >= ends[0]) & (place <= ends[1])
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    long = float(np.quantile(speed[fluid], 0.95)) if fluid.any() else 0.0
    if long == 0:
        return "no arrows: the flow is affine"
    arrows = axes.quiver(
        x[fluid],
        y[fluid],
        velocity[..., 0][fluid],
        velocity[..., 1][fluid],
        angles="xy",
        scale_units="xy",
        scale=long / (ARROW_LENGTH * distance),
        color=ARROW,
        units="xy",
        width=0.065 * distance,
        headwidth=4.0,
        headlength=4.5,
        headaxislength=4.0,
        minlength=0.5,
        pivot="middle",
        zorder=2,
    )
    _add_key(figure, axes, arrows, long, ARROW_LENGTH * distance / np.ptp(axes.get_xlim()))
    meaning = "non-affine velocity over the bulk shear rate and H, along"
    velocities = {
        f"non_affine_velocity_{name}": Quantity(
            velocity[..., axis][fluid], "1", f"{meaning} {name}"
        )
        for axis, name in enumerate("xy")
    }
    show(axes, "", "arrow", _points(x[fluid], y[fluid]) | velocities, moment_shown(run, snapshot))
    return ""


def _add_key(figure: Figure, axes: Axes, arrows: Quiver, long: float, share: float) -> None:
    """Add an arrow of a round length above the channel, right-aligned with it.

    ``share`` is the length of an arrow of size ``long`` over that of the channel.
    """
    size = float(f"{long:.0e}")
    above = 1 + KEY_HEIGHT / (float(figure.get_size_inches()[1]) - MARGINS)
    words = rf"$v_\mathrm{{na}}$ = {size:g}"
    x = 1 - share * size / long
    axes.quiverkey(arrows, x, above, size, words, labelpos="W", labelsep=0.05)


def _height_at(wall: FloatArray, x: FloatArray, length: float) -> FloatArray:
    contour = tiled(wall, length)
    return np.asarray(np.interp(x, contour[:, 0], contour[:, 1]))
