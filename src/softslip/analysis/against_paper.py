"""The paper's numbers and ours, with the difference in standard errors: Dataset → Dataset."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from softslip.analysis import paper
from softslip.analysis.comparable import unlike
from softslip.analysis.fits.finite_size import SEPARATION
from softslip.analysis.fits.points import DRIVES, FITTED, with_stress
from softslip.analysis.observables import mean_over_seeds
from softslip.analysis.paper import Reported
from softslip.files.quantities import JOINT, POOLED, described

POOLED_DIMENSIONS = (*DRIVES, "roughness", "seed")
"""Dimensions over which the paper's numbers are meant; every other one stays."""

ROUNDING = 0.01
"""Relative difference up to which a stress or roughness is the paper's."""

LEAST_VALUES = 2
"""Fewest values whose scatter is looked at."""


@dataclass(frozen=True)
class FoundNumber:
    """Our value of one of the paper's numbers, and why there is none where it is NaN."""

    value: float
    error: float
    remark: str = ""


Measurement = Callable[[xr.Dataset, xr.Dataset], FoundNumber]
"""Takes the averages over seeds and the fits of one cell."""


@dataclass(frozen=True)
class ComparedNumber:
    """One of the paper's numbers, and where ours is.

    Attributes
    ----------
    reported
        As the paper gives it.
    measured
        What finds ours.
    pooled
        Dimensions that it is about, besides `POOLED_DIMENSIONS`.
    """

    reported: Reported
    measured: Measurement
    pooled: tuple[str, ...] = ()


def _none(remark: str) -> FoundNumber:
    return FoundNumber(np.nan, np.nan, remark)


def _fitted(name: str, message: str) -> Measurement:
    """Return what takes a fitted parameter, at the smoothest wall where it depends on that."""

    def taken(curve: xr.Dataset, fits: xr.Dataset) -> FoundNumber:
        here = _at_smoothest(fits)
        said = str(here[message].item())
        if said != FITTED:
            return _none(said)
        return FoundNumber(float(here[name]), float(here[f"{name}_error"]))

    return taken


def _pooled(name: str) -> Measurement:
    return _fitted(f"{POOLED}{name}", f"{POOLED}{name}_message")


def _at_smoothest(dataset: xr.Dataset) -> xr.Dataset:
    if "roughness" not in dataset.dims:
        return dataset
    return dataset.isel(roughness=int(np.argmin(dataset["roughness"].values)))


def _mean(values: xr.DataArray, errors: xr.DataArray, remark: str) -> FoundNumber:
    """Return the mean of values weighted by their errors; its error counts how they scatter."""
    known = np.isfinite(values.values) & np.isfinite(errors.values) & (errors.values > 0)
    if not known.any():
        return _none(remark)
    found, weights = values.values[known], 1 / errors.values[known] ** 2
    mean = float(np.average(found, weights=weights))
    error = float(weights.sum() ** -0.5)
    if len(found) >= LEAST_VALUES:
        scatter = float((weights * (found - mean) ** 2).sum()) / (len(found) - 1)
        error *= max(1.0, scatter) ** 0.5
    return FoundNumber(mean, error)


def _critical_roughness(curve: xr.Dataset, fits: xr.Dataset) -> FoundNumber:
    """Return β*, as well as the roughnesses tell: it is anywhere between the two around it."""
    found = _fitted("critical_roughness", "critical_roughness_message")(curve, fits)
    if not np.isfinite(found.value):
        return found
    low, high = _at_smoothest(fits)["critical_roughness_bracket"].values
    return replace(found, error=float(np.hypot(found.error, (high - low) / 12**0.5)))


def _newtonian_length(curve: xr.Dataset, fits: xr.Dataset) -> FoundNumber:
    """Return the thickness of the film of solvent at smooth walls, over all stresses."""
    smoothest = _at_smoothest(curve)
    roughness = smoothest.coords.get("roughness")
    if roughness is not None and float(roughness) > 0:
        return _none("no run with smooth walls")
    length = smoothest["newtonian_slip_length"]
    remark = "no steady profiles at smooth walls"
    return _mean(length, smoothest["newtonian_slip_length_error"], remark)


def _yielding_sample(curve: xr.Dataset, fits: xr.Dataset) -> FoundNumber:
    """Return the yielding time at the stress and roughness of the paper's sample."""
    sample = paper.YIELDING_SAMPLE
    for name, wanted in (("stress", sample.stress), ("roughness", sample.roughness or 0.0)):
        if name not in curve.coords or curve[name].ndim > 1:
            return _none(f"no run at {name} {wanted:g}")
        near = np.isclose(np.atleast_1d(curve[name].values), wanted, rtol=ROUNDING)
        if not near.any():
            return _none(f"no run at {name} {wanted:g}")
        if name in curve.dims:
            curve = curve.isel({name: int(np.flatnonzero(near)[0])})
    if "imposed_shear_rate" in curve.dims:
        return _none("no run at an imposed stress")
    value, error = float(curve["yielding_time"]), float(curve["yielding_time_error"])
    return FoundNumber(value, error) if np.isfinite(value) else _none("did not yield")


def _separation_effect(curve: xr.Dataset, fits: xr.Dataset) -> FoundNumber:
    """Return by how much the bulk rate differs between the least and the largest separation."""
    if SEPARATION not in curve.dims:
        return _none("one wall separation only")
    heights = curve[SEPARATION].values
    wide = np.flatnonzero(heights >= paper.LEAST_SEPARATION.value * (1 - ROUNDING))
    if len(wide) < LEAST_VALUES:
        return _none(f"fewer than two wall separations from {paper.LEAST_SEPARATION.value:g} on")
    ordered = wide[np.argsort(heights[wide])]
    rate = curve["shear_rate_bulk"].where(curve["steady_bulk"].astype(bool))
    error = curve["shear_rate_bulk_error"]
    small, large = (rate.isel({SEPARATION: int(place)}) for place in (ordered[0], ordered[-1]))
    near, far = (error.isel({SEPARATION: int(place)}) for place in (ordered[0], ordered[-1]))
    ratio = large.drop_vars(SEPARATION) / small.drop_vars(SEPARATION)
    relative = (
        (near / small).drop_vars(SEPARATION) ** 2 + (far / large).drop_vars(SEPARATION) ** 2
    ) ** 0.5
    # A rate within two errors of zero has no ratio.
    told = (relative > 0) & (relative < 0.5)
    remark = "no condition with a steady bulk at both wall separations"
    return _mean((ratio - 1).where(told), abs(ratio) * relative, remark)


COMPARED: Mapping[str, ComparedNumber] = {
    "yield_stress": ComparedNumber(
        paper.YIELD_STRESS, _fitted("pooled_yield_stress", "pooled_fit_message")
    ),
    "flow_index": ComparedNumber(
        paper.FLOW_INDEX, _fitted("pooled_flow_index", "pooled_fit_message")
    ),
    "joint_yield_stress": ComparedNumber(
        paper.YIELD_STRESS, _fitted(f"{JOINT}yield_stress", f"{JOINT}fit_message")
    ),
    "joint_flow_index": ComparedNumber(
        paper.FLOW_INDEX, _fitted(f"{JOINT}flow_index", f"{JOINT}fit_message")
    ),
    "slip_exponent": ComparedNumber(
        paper.SLIP_EXPONENT, _fitted("slip_exponent", "slip_exponent_message")
    ),
    "critical_roughness": ComparedNumber(paper.CRITICAL_ROUGHNESS, _critical_roughness),
    "heterogeneity_exponent": ComparedNumber(
        paper.HETEROGENEITY_EXPONENT, _pooled("heterogeneity_exponent")
    ),
    "newtonian_slip_length": ComparedNumber(paper.CONTACT_LENGTH, _newtonian_length),
    "yielding_exponent": ComparedNumber(paper.YIELDING_EXPONENT, _pooled("yielding_exponent")),
    "yielding_time": ComparedNumber(paper.YIELDING_SNAPSHOT_TIME, _yielding_sample),
    "separation_effect": ComparedNumber(paper.SEPARATION_EFFECT, _separation_effect, (SEPARATION,)),
}
"""The paper's numbers by the names of `files.quantities`."""


def against_paper(flow_curve: xr.Dataset, fits: xr.Dataset) -> xr.Dataset:
    """Hold the numbers of a scenario against the paper's (Secs. III and IV).

    Parameters
    ----------
    flow_curve
        From `analysis.observables.flow_curve`.
    fits
        Its `analysis.fits.fit_laws`.

    Returns
    -------
    xr.Dataset
        For each number of `COMPARED` and every combination of the dimensions other than stress,
        roughness and seed, and those that it is about: ours under its name with ``_error``; the
        paper's with the ends ``_reported`` and ``_reported_error`` (NaN where it gives none);
        ``_difference``, ours less the paper's over the standard errors of both, or over ours where
        the paper gives none, NaN where there is no number of ours or the material is another one;
        ``_remark``, why there is no number or no difference. ``runs_done`` is the number of
        finished runs of the combination.
    """
    averaged = mean_over_seeds(with_stress(flow_curve))
    done = flow_curve["status"] == "done"
    counted = done.sum([dim for dim in done.dims if dim in POOLED_DIMENSIONS])
    result = xr.Dataset(attrs={"title": "Comparison with the paper"})
    result["runs_done"] = counted.astype(np.int64)
    for name, number in COMPARED.items():
        result = result.assign(_variables(name, number, averaged, fits))
    return described(result)


def _variables(
    name: str, number: ComparedNumber, curve: xr.Dataset, fits: xr.Dataset
) -> dict[str, xr.DataArray]:
    """Return the variables of one number."""
    pooled = (*POOLED_DIMENSIONS, *number.pooled)
    dims = [str(dim) for dim in curve["status"].dims if dim not in pooled]
    sizes = tuple(curve.sizes[dim] for dim in dims)
    coords = {dim: curve[dim] for dim in dims}
    cells = [
        _cell(number, curve, fits, dict(zip(dims, place, strict=True)))
        for place in np.ndindex(*sizes)
    ]
    theirs = number.reported.uncertainty
    columns: dict[str, list[float] | list[str]] = {
        name: [ours.value for ours, _ in cells],
        f"{name}_error": [ours.error for ours, _ in cells],
        f"{name}_reported": [number.reported.value] * len(cells),
        f"{name}_reported_error": [np.nan if theirs is None else theirs] * len(cells),
        f"{name}_difference": [gap for _, gap in cells],
        f"{name}_remark": [ours.remark for ours, _ in cells],
    }
    return {
        key: xr.DataArray(
            np.reshape(np.array(values, dtype=object if key.endswith("_remark") else float), sizes),
            coords,
            dims,
        )
        for key, values in columns.items()
    }


def _cell(
    number: ComparedNumber, averaged: xr.Dataset, fits: xr.Dataset, at: Mapping[str, int]
) -> tuple[FoundNumber, float]:
    """Return ours in one cell, and its difference from the paper's."""
    curve = averaged.isel(at)
    laws = fits.isel({dim: place for dim, place in at.items() if dim in fits.dims})
    ours = number.measured(curve, laws)
    if not np.isfinite(ours.value):
        return ours, np.nan
    if not 0 < ours.error < np.inf:
        return FoundNumber(ours.value, np.nan, "its error is not known"), np.nan
    departures = unlike(curve.assign_attrs(averaged.attrs))
    if departures:
        other = ", ".join(f"{label} {value}" for label, value in departures)
        return FoundNumber(ours.value, ours.error, f"{other} is not the paper's"), np.nan
    error = float(np.hypot(ours.error, number.reported.uncertainty or 0.0))
    return ours, (ours.value - number.reported.value) / error
