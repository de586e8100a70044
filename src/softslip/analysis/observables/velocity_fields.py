"""Velocity profiles and how far the flow is from an affine one (Sec. III)."""

import numpy as np
import xarray as xr

from softslip.analysis.observables.series import (
    FloatArray,
    interval_means,
    parameters_of,
    profiles_from,
)
from softslip.analysis.observables.steady import steady_state
from softslip.analysis.observables.time_weights import snapshots_from, weighted
from softslip.errors import DatasetError
from softslip.files.quantities import described

LEAST_ROWS = 3
"""Fewest rows of a velocity field in the reduced gap to which a line is fitted."""


def mean_profile(run: xr.Dataset) -> xr.Dataset:
    """Average the normalised velocity profile over the steady window (Fig. 4, Sec. III).

    v_norm = (v̄ − V_lower)/(V_upper − V_lower) against y_norm = y/H. The profiles used are those
    whose whole interval lies in the window of `steady_state`; where there is none, the last one.

    Returns
    -------
    xr.Dataset
        ``normalised_velocity`` and ``normalised_velocity_error`` (standard error over the
        profiles, NaN for a single one) along ``wall_distance`` [length unit], the coordinate
        ``normalised_position`` there, and the scalar ``profiles_used``. All NaN where the walls
        do not move.
    """
    height = parameters_of(run).channel.height
    chosen, edges = profiles_from(run, float(steady_state(run)["steady_from"]))
    chosen = chosen if len(chosen) else np.array([len(edges) - 2])
    walls = np.stack([interval_means(run, "wall_velocity", edges[i : i + 2])[0] for i in chosen])
    velocity = run["velocity_profile"].transpose("profile", "wall_distance").values[chosen]
    weight = np.diff(edges)[chosen] / np.sum(np.diff(edges)[chosen])
    mean = _normalised(weight @ velocity, weight @ walls)
    each = np.stack([_normalised(v, w) for v, w in zip(velocity, walls, strict=True)])
    count = len(chosen)
    error = each.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full_like(mean, np.nan)
    distance = run["wall_distance"]
    return described(
        xr.Dataset(
            {
                "normalised_velocity": ("wall_distance", mean),
                "normalised_velocity_error": ("wall_distance", error),
                "profiles_used": float(count),
            },
            coords={
                "wall_distance": distance,
                "normalised_position": ("wall_distance", distance.values / height),
            },
        )
    )


def _normalised(velocity: FloatArray, walls: FloatArray) -> FloatArray:
    lower, upper = walls
    if upper == lower:
        return np.full_like(velocity, np.nan)
    return np.asarray((velocity - lower) / (upper - lower))


def bulk_rows(run: xr.Dataset) -> FloatArray:
    """Tell which rows of a snapshot's field lie in the reduced gap, shape (field_y,).

    Raises
    ------
    DatasetError
        When the run has no bulk, or too coarse a field in it.
    """
    parameters = parameters_of(run)
    margin = parameters.recording.bulk_margin
    name = run.attrs.get("run", "?")
    if margin is None:
        raise DatasetError(
            f"run {name}: has no bulk to fit a line to; set recording.bulk_margin, for example 5"
        )
    reach = margin * parameters.suspension.mean_radius
    y = run["field_y"].values
    inside = (y > reach) & (y < parameters.channel.height - reach)
    if inside.sum() < LEAST_ROWS:
        raise DatasetError(
            f"run {name}: its velocity field has {int(inside.sum())} rows in the bulk, of at "
            f"least {LEAST_ROWS}; use a smaller recording.field_spacing or recording.bulk_margin"
        )
    return np.asarray(inside)


def _snapshot(run: xr.Dataset, snapshot: int) -> xr.Dataset:
    count = run.sizes.get("snapshot", 0)
    if not 0 <= snapshot < count:
        raise DatasetError(
            f"run {run.attrs.get('run', '?')}: has {count} snapshots, so there is none of number "
            f"{snapshot}; ask for times in recording.snapshots"
        )
    return run.isel(snapshot=snapshot)


def non_affine_velocity(run: xr.Dataset, snapshot: int) -> xr.Dataset:
    """Subtract the affine flow of the bulk from the velocity field of a snapshot (Eq. 29).

    v_na = [v − v_fit(y) x̂]/(γ̇_bulk H), where v_fit is the line fitted to the x-averaged field in
    the reduced gap and γ̇_bulk its slope, both of this snapshot.

    Returns
    -------
    xr.Dataset
        ``non_affine_velocity`` with the dimensions of the field (NaN where γ̇_bulk = 0), and the
        scalars ``heterogeneity`` (Eq. 30, over the field's points in the reduced gap) and
        ``shear_rate_bulk`` [1 / time unit].

    Raises
    ------
    DatasetError
        When there is no such snapshot, no bulk, or too coarse a field in it.
    """
    velocity = _snapshot(run, snapshot)["velocity"].transpose("field_y", "field_x", "axis")
    rows = bulk_rows(run)
    y = run["field_y"].values.astype(np.float64)
    along = velocity.values[..., 0].mean(axis=1)
    rate, offset = np.polyfit(y[rows], along[rows], 1)
    difference = velocity.values.astype(np.float64)
    difference[..., 0] -= (offset + rate * y)[:, None]
    speed = rate * parameters_of(run).channel.height
    scaled = difference / speed if speed != 0 else np.full_like(difference, np.nan)
    heterogeneity = float(np.sqrt(np.mean(scaled[rows, :, 0] ** 2)))
    return described(
        xr.Dataset(
            {
                "non_affine_velocity": (velocity.dims, scaled),
                "heterogeneity": heterogeneity,
                "shear_rate_bulk": float(rate),
            },
            coords={"field_y": run["field_y"], "field_x": run["field_x"]},
        )
    )


def heterogeneity(run: xr.Dataset) -> xr.Dataset:
    """Average the heterogeneity δ_het of the bulk flow over snapshots (Eq. 30, Fig. 6d).

    Each snapshot's δ_het is that of its own field and shear rate. The mean is over the snapshots
    within the window of `steady_state`, by the time that each stands for; below yield it is
    stationary although the shear rate is not. The fields are kept on coarse points, so that
    structure finer than ``recording.field_spacing`` is sampled, not averaged: the mean is unbiased,
    but a single snapshot of a small box scatters.

    Returns
    -------
    xr.Dataset
        Scalars ``heterogeneity``, ``heterogeneity_error`` (standard error over the snapshots,
        NaN for a single one), ``heterogeneity_freedom`` and ``snapshots_used``. NaN where the run
        kept none in the window or has no bulk.
    """
    values, weights = np.empty(0), np.empty(0)
    if run.sizes.get("snapshot", 0) and parameters_of(run).recording.bulk_margin is not None:
        numbers, weights = snapshots_from(run, float(steady_state(run)["steady_from"]))
        found = [float(non_affine_velocity(run, int(i))["heterogeneity"]) for i in numbers]
        values = np.array(found)
    mean, error, count = weighted(values, weights)
    return described(
        xr.Dataset(
            {
                "heterogeneity": float(mean),
                "heterogeneity_error": float(error),
                "heterogeneity_freedom": max(float(count) - 1.0, 0.0),
                "snapshots_used": float(len(values)),
            }
        )
    )
