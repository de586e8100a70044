"""Structure beyond the paper's figures: shapes, films, fluidity and correlations of the flow.

Each is a mean over the snapshots, by the time that each stands for, or over the profiles of the
steady window, against the distance from the nearer wall: turning the channel by half a turn changes
nothing.
"""

import numpy as np
import xarray as xr
from scipy.optimize import curve_fit

from softslip.analysis.observables.contours import contours, film_thickness, shapes
from softslip.analysis.observables.series import (
    FloatArray,
    interval_means,
    parameters_of,
    profiles_from,
)
from softslip.analysis.observables.steady import steady_state, verdicts_of
from softslip.analysis.observables.tables import Runs, collect
from softslip.analysis.observables.time_weights import snapshots_from, weighted
from softslip.analysis.observables.velocity_fields import bulk_rows, non_affine_velocity
from softslip.errors import DatasetError
from softslip.files.quantities import described

BIN = 0.5
"""Width of a bin of distances from the wall in the flow, which resolves layers [mean radius]."""

PARTICLE_BIN = 2.0
"""Width of a bin of particles' distances from the wall: a layer [mean radius]. Narrower ones have
too few particles each in a box of a hundred."""

QUANTILES = (0.1, 0.5, 0.9)
"""Of the thickness of the film along a wall."""

SOLVENT = 1.0
"""Distance from the wall within which the fluidity is that of films, not of particles [mean
radius]."""

LEAST_BINS = 5
"""Bins that a cooperativity length is fitted to, at least."""

EVIDENCE = 9.2
"""Least gain in chi-square over a constant fluidity: the two parameters more gain it by chance in
one case of a hundred."""


def structure(runs: Runs) -> xr.Dataset:
    """Collect how particles and flow are arranged between the walls.

    Returns
    -------
    xr.Dataset
        Along ``particle_distance`` [mean radius], the middles of bins of centroids:
        ``deformation`` (of the mean stretch, see `contours.shapes`) and ``orientation`` (of its
        long axis to the flow). Along ``distance_from_wall`` [mean radius], narrower bins:
        ``fluidity`` (local shear rate over stress) and ``particle_stress`` (the stress that
        particles carry, by the balance of forces across the channel) [stress unit]. Along
        ``quantile``: ``wall_film`` [range of the repulsion]. One number a run:
        ``first_layer_gap`` [range of the repulsion], whose growth with the stress is the lift of
        the first layer, ``cooperativity_length``, ``correlation_length`` [mean radius],
        ``structure_snapshots``. Each with ``_error``: the standard error over snapshots
        or profiles, that of the fit for the cooperativity length. NaN where there is nothing.
        Beside them the rates of walls and bulk with their verdicts, see `verdicts_of`.
    """
    pairs = [(labels, run) for labels, run in runs]
    reach = [_half_height(run) for _, run in pairs if run is not None]
    if not reach:
        raise DatasetError(f"none of {len(pairs)} runs is done; run the shear stage first")
    edges, wide = (np.arange(0.0, max(reach) + width, width) for width in (BIN, PARTICLE_BIN))
    return collect(pairs, lambda run: _structure_of(run, edges, wide)).assign_attrs(
        title="Structure"
    )


def _half_height(run: xr.Dataset) -> float:
    given = parameters_of(run)
    return 0.5 * given.channel.height / given.suspension.mean_radius


def _structure_of(run: xr.Dataset, edges: FloatArray, wide: FloatArray) -> xr.Dataset:
    """Return all that `structure` says of one run, with bins for the flow and for particles."""
    given, steady = parameters_of(run), steady_state(run)
    start = float(steady["steady_from"])
    numbers, weights = snapshots_from(run, start)
    chosen = numbers.tolist()
    stretch = _over(
        [_stretch_profile(run, place, wide) for place in chosen], (len(wide) - 1, 2), weights
    )
    films = _over([_films(run, place) for place in chosen], (len(QUANTILES) + 1,), weights)
    bulk = chosen if given.recording.bulk_margin is not None else []
    lengths = _over([np.array(_correlation_length(run, place)) for place in bulk], (), weights)
    profiles = _fluidity_profiles(run, edges, start)
    flow = _over(profiles, (len(edges) - 1, 2), np.ones(len(profiles)))
    fluidity, carried = ([each[:, column] for each in flow] for column in (0, 1))
    middles, centroids = (0.5 * (ends[1:] + ends[:-1]) for ends in (edges, wide))
    cooperativity = cooperativity_length(middles, *fluidity)
    (mean, error), along = stretch, ("particle_distance",)
    size = np.hypot(mean[:, 0], mean[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        turn = np.degrees(
            0.5 * np.hypot(mean[:, 1] * error[:, 0], mean[:, 0] * error[:, 1]) / size**2
        )
        spread = np.hypot(mean[:, 0] * error[:, 0], mean[:, 1] * error[:, 1]) / size
    found = described(
        xr.Dataset(
            {
                "deformation": (along, size),
                "deformation_error": (along, spread),
                "orientation": (along, _angle(mean)),
                "orientation_error": (along, turn),
                "fluidity": (("distance_from_wall",), fluidity[0]),
                "fluidity_error": (("distance_from_wall",), fluidity[1]),
                "particle_stress": (("distance_from_wall",), carried[0]),
                "particle_stress_error": (("distance_from_wall",), carried[1]),
                "wall_film": (("quantile",), films[0][:-1]),
                "wall_film_error": (("quantile",), films[1][:-1]),
                "first_layer_gap": float(films[0][-1]),
                "first_layer_gap_error": float(films[1][-1]),
                "correlation_length": float(lengths[0]),
                "correlation_length_error": float(lengths[1]),
                "cooperativity_length": cooperativity[0],
                "cooperativity_length_error": cooperativity[1],
                "structure_snapshots": float(len(chosen)),
            },
            coords={
                "distance_from_wall": middles,
                "particle_distance": centroids,
                "quantile": list(QUANTILES),
            },
        )
    )
    return found.merge(verdicts_of(steady, "shear_rate_wall", "shear_rate_bulk"))


def _angle(stretch: FloatArray) -> FloatArray:
    """Return angles of long axes to the flow, −45 to 135 degrees: shear turns them towards 45."""
    angle = np.degrees(0.5 * np.arctan2(stretch[:, 1], stretch[:, 0]))
    return np.asarray(np.where(angle < -45, angle + 180, angle))


def _over(
    values: list[FloatArray], shape: tuple[int, ...], weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the mean over snapshots and its standard error; NaN counts as not there."""
    if not values:
        return np.full(shape, np.nan), np.full(shape, np.nan)
    mean, error, _ = weighted(np.array(values), weights)
    return mean, error


def _bin_means(distance: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Return means over bins of distance, NaN where a bin is empty; values along the first axis."""
    place = np.digitize(distance, edges) - 1
    means = np.full((len(edges) - 1, *values.shape[1:]), np.nan)
    for index in np.unique(place[(place >= 0) & (place < len(means))]):
        means[index] = values[place == index].mean(axis=0)
    return means


def _stretch_profile(run: xr.Dataset, snapshot: int, edges: FloatArray) -> FloatArray:
    """Return D (cos 2θ, sin 2θ) by the centroid's distance from the nearer wall, (bins, 2)."""
    given = parameters_of(run)
    particles, _ = contours(run, snapshot)
    centroids, stretch = shapes(particles)
    height = centroids[:, 1]
    distance = np.minimum(height, given.channel.height - height) / given.suspension.mean_radius
    return _bin_means(distance, stretch, edges)


def _films(run: xr.Dataset, snapshot: int) -> FloatArray:
    """Return quantiles of the thickness of both walls' films over the range of the repulsion.

    And at the end, the mean over the particles of the first layers, which are nearest to some part
    of a wall, of the least distance of each from it.
    """
    given = parameters_of(run)
    particles, walls = contours(run, snapshot)
    if not particles:
        return np.full(len(QUANTILES) + 1, np.nan)
    found = [film_thickness(wall, particles, given.channel.length) for wall in walls]
    films = np.concatenate([film for film, _ in found])
    gaps = [film[nearest == each].min() for film, nearest in found for each in np.unique(nearest)]
    return np.append(np.quantile(films, QUANTILES), np.mean(gaps)) / given.steric.length


def _correlation_length(run: xr.Dataset, snapshot: int) -> float:
    """Return where the correlation along x of the velocity across the flow falls to 1/e.

    In mean radii, over the bulk of the channel; NaN where it does not fall so far in half a
    period, and where nothing moves.
    """
    given = parameters_of(run)
    field = non_affine_velocity(run, snapshot)["non_affine_velocity"]
    across = field.transpose("field_y", "field_x", "axis").values[bulk_rows(run), :, 1]
    across = across - across.mean(axis=1, keepdims=True)
    power = (np.abs(np.fft.rfft(across, axis=1)) ** 2).sum(axis=0)
    correlation = np.fft.irfft(power, n=across.shape[1])[: across.shape[1] // 2 + 1]
    if not correlation[0] > 0:
        return float("nan")
    correlation = correlation / correlation[0]
    below = np.flatnonzero(correlation < np.exp(-1))
    if not len(below):
        return float("nan")
    last = int(below[0])
    share = (correlation[last - 1] - np.exp(-1)) / (correlation[last - 1] - correlation[last])
    spacing = given.channel.length / across.shape[1]
    return float((last - 1 + share) * spacing / given.suspension.mean_radius)


def _fluidity_profiles(run: xr.Dataset, edges: FloatArray, start: float) -> list[FloatArray]:
    """Return fluidity and particles' stress by distance from the nearer wall, one for a profile.

    Without inertia the shear stress is the same all across the channel: what the solvent does not
    carry of it, η times the local shear rate, particles do. Shape of each (bins, 2).
    """
    given = parameters_of(run)
    chosen, times = profiles_from(run, start)
    height = np.asarray(run["wall_distance"].values, dtype=np.float64)
    velocity = run["velocity_profile"].transpose("profile", "wall_distance").values
    radius, found = given.suspension.mean_radius, list[FloatArray]()
    for number in chosen:
        stress = float(interval_means(run, "stress", times[number : number + 2])[0])
        if stress == 0:
            continue
        rate = np.diff(velocity[number]) / np.diff(height)
        middle = 0.5 * (height[1:] + height[:-1])
        distance = np.minimum(middle, given.channel.height - middle) / radius
        local = _bin_means(distance, rate, edges)
        carried = stress - given.solvent.viscosity * local
        found.append(np.column_stack((local / stress, carried)))
    return found


def cooperativity_length(
    distance: FloatArray, fluidity: FloatArray, error: FloatArray
) -> tuple[float, float]:
    """Fit the length over which a wall changes the fluidity (Goyon et al. 2008).

    f(y) = f_b + (f_w − f_b) e^(−y/ξ), from one radius off the wall on, where particles flow and not
    the film of solvent.

    Parameters
    ----------
    distance, fluidity, error
        Middles of the bins [mean radius], the fluidity there and its standard error, (bins,).

    Returns
    -------
    tuple of float
        ξ [mean radius] and its standard error; NaN where there are too few bins, or they do not
        determine ξ: nothing speaks against a constant fluidity, its error is as large as itself, or
        it is beyond the bins.
    """
    used = (distance > SOLVENT) & np.isfinite(fluidity) & (error > 0)
    nothing = float("nan"), float("nan")
    if used.sum() < LEAST_BINS:
        return nothing
    y, f, s = distance[used], fluidity[used], error[used]
    scale = float(max(np.abs(f).max(), s.max()))

    def law(y: FloatArray, bulk: float, wall: float, length: float) -> FloatArray:
        return np.asarray(bulk + (wall - bulk) * np.exp(-y / length))

    first, least = (f[-1] / scale, f[0] / scale, 1.0), (-np.inf, -np.inf, 0.1 * BIN)
    try:
        best, covariance = curve_fit(
            law,
            y,
            f / scale,
            p0=first,
            sigma=s / scale,
            absolute_sigma=True,
            bounds=(least, np.inf),
        )
    except RuntimeError:
        return nothing
    length, width = float(best[2]), float(np.sqrt(covariance[2, 2]))
    level = np.average(f, weights=s**-2)
    gain = np.sum(((f - level) / s) ** 2) - np.sum(((f - scale * law(y, *best)) / s) ** 2)
    determined = gain > EVIDENCE and BIN < length < y[-1] and width < length
    return (length, width) if determined else nothing
