"""Slip lengths: of the solvent film at the wall, and of all that slips (Sec. III, Fig. 7)."""

import numpy as np
import xarray as xr

from softslip.analysis.observables.correlation import MeanEstimate, mean_of
from softslip.analysis.observables.series import (
    FloatArray,
    equal_bins,
    interval_means,
    parameters_of,
    profiles_from,
)
from softslip.analysis.observables.steady import steady_state
from softslip.config.parameters import Parameters
from softslip.files.quantities import described

LAYER = (1.0, 3.0)
"""Distance from the tops of the bumps, over the mean radius, between which the first layers are."""

LEAST_ROWS = 3
"""Fewest rows of a profile in these layers."""

KNOWN_RATE = 2.0
"""Errors by which a bulk rate must differ from zero for a slip length over it to be known."""

UNKNOWN = MeanEstimate(float("nan"), float("nan"), float("nan"))
"""A length that a run does not tell."""


def slip_lengths(run: xr.Dataset) -> xr.Dataset:
    """Measure the Newtonian and the total slip length of a run over its steady window.

    The total slip length is the distance behind the wall at which the bulk's profile reaches the
    velocity of the wall, V_s/γ̇_bulk, of the means over the window. Its error is that of the series
    (V_s − l γ̇_bulk)/γ̇_bulk, so that the correlation of both counts. It is known only where bulk
    and slip are steady; without an end, and its error infinite, where the bulk rate is within two
    errors of zero.

    The Newtonian slip length is the thickness of the film of solvent at the wall. The paper takes
    the point of largest curvature of v̄, where its third derivative is zero, which noise does not
    survive. Here a line is fitted to v̄(y) in the first layers of particles, one to three mean radii
    from the tops of the bumps: its intercept at the wall is what the film slips, V_f, and its slope
    the shear rate γ̇_l of these layers. In the film there are no membranes, so that the solvent
    alone carries the stress, at the shear rate σ/η; the film that leads to V_f is

        l_s^newton = V_f / (σ/η − γ̇_l),

    exact for a profile of two straight pieces. It is the mean of both walls over the profiles of
    the window, with the standard error of these.

    Returns
    -------
    xr.Dataset
        Scalars ``total_slip_length`` and ``newtonian_slip_length`` [length unit], each with
        ``_error`` and ``_freedom``; NaN where a run does not tell them.
    """
    steady = steady_state(run)
    found = {
        "total_slip_length": _total(run, steady),
        "newtonian_slip_length": _newtonian(run, steady, parameters_of(run)),
    }
    told = xr.Dataset()
    for name, length in found.items():
        told[name] = length.value
        told[f"{name}_error"] = length.error
        told[f"{name}_freedom"] = length.freedom
    return described(told)


def _total(run: xr.Dataset, steady: xr.Dataset) -> MeanEstimate:
    if not (bool(steady["steady_bulk"]) and bool(steady["steady_slip"])):
        return UNKNOWN
    edges = equal_bins(run)
    edges = edges[edges >= float(steady["steady_from"])]
    speeds, rates = (interval_means(run, n, edges) for n in ("slip_velocity", "shear_rate_bulk"))
    rate = mean_of(rates)
    if rate.value == 0:
        return UNKNOWN
    length = float(speeds.mean()) / rate.value
    spread = mean_of((speeds - length * rates) / rate.value)
    known = abs(rate.value) > KNOWN_RATE * rate.error
    return MeanEstimate(length, spread.error if known else float("inf"), spread.freedom)


def _newtonian(run: xr.Dataset, steady: xr.Dataset, given: Parameters) -> MeanEstimate:
    radius = given.suspension.mean_radius
    low, high = (given.wall.roughness * radius + each * radius for each in LAYER)
    distance = run["wall_distance"].values.astype(np.float64)
    height = given.channel.height
    rows = (distance >= low) & (distance <= high)
    above = (height - distance >= low) & (height - distance <= high)
    if min(rows.sum(), above.sum()) < LEAST_ROWS or high > 0.5 * height:
        return UNKNOWN
    chosen, edges = profiles_from(run, float(steady["steady_from"]))
    if len(chosen) < 2:
        return UNKNOWN
    velocity = run["velocity_profile"].transpose("profile", "wall_distance").values
    lengths = []
    for number in chosen:
        interval = edges[number : number + 2]
        walls = interval_means(run, "wall_velocity", interval)[0]
        rate = float(interval_means(run, "stress", interval)[0]) / given.solvent.viscosity
        lower = _film(distance[rows], velocity[number][rows] - walls[0], rate)
        upper = _film(height - distance[above], walls[1] - velocity[number][above], rate)
        lengths.append(0.5 * (lower + upper))
    return mean_of(np.array(lengths))


def _film(distance: FloatArray, velocity: FloatArray, rate: float) -> float:
    """Return the thickness of a film at a shear rate that slips by the intercept of a line."""
    slope, slip = np.polyfit(distance, velocity, 1)
    return float(slip / (rate - slope)) if rate != slope else float("nan")
