"""A result and its rerun: equal, equal within stated tolerances, or different."""

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from softslip.files.layout import DATASET
from softslip.files.stamps import check_figure
from softslip.files.storage import CONTENT_DIGEST, read_dataset
from softslip.provenance.product_labels import PASSING, Product, read_product
from softslip.provenance.verification.pictures import drawing, figure_differences
from softslip.provenance.verification.tolerances import (
    EARLY_STRAIN,
    EXACT,
    GROWN,
    MEASURED,
    TOLERANCES,
    Difference,
    Tolerance,
    different,
)
from softslip.solver.geometry import BoolArray, FloatArray

EQUAL, WITHIN, DIFFERS = "equal", "within tolerance", "differs"
"""What a comparison can find."""

LATE_SHARE = 0.5
"""Share of a run, at its end, whose means are compared where the runs have parted."""

BATCHES = 10
"""Equal parts whose scatter gives the error of a mean."""

MOST_ERRORS = 4.0
"""Standard errors by which two means may differ: by chance, more come once in three hundred times
with ten batches each."""

MACHINE = ("processor", "environment", "fingerprint")
"""What must be the same for the same bytes, besides the release."""


EFFORT = (
    *("steps", "evaluations", "rejections"),
    *("steps_set_by_error", "steps_set_by_film", "steps_set_by_motion"),
    *("steps_set_by_record", "steps_set_by_longest", "steps_set_by_stiffness"),
)
"""Attributes that say how much work a run was, which rounding may change."""

RELEASE = ("source", "product_version")
"""Attributes that name the release."""


@dataclass(frozen=True)
class Agreement:
    """What was found by comparing a result with its rerun.

    Attributes
    ----------
    verdict
        `EQUAL`, `WITHIN` or `DIFFERS`.
    other
        What differs about how they were made: keys of `MACHINE`, or "release".
    quantities
        Compared where they are not equal, the worst first.
    """

    verdict: str
    other: tuple[str, ...]
    quantities: tuple[Difference, ...]


def compare(recorded: Path, rerun: Path) -> Agreement:
    """Compare a result with its rerun.

    Parameters
    ----------
    recorded, rerun
        Files of the same stage and run, whose digests are recomputed.

    Raises
    ------
    DatasetError
        When one of them is damaged.
    """
    products = read_product(recorded), read_product(rerun)
    if recorded.suffix == DATASET:
        first, second = (read_dataset(each.path, stage=each.stage) for each in products)
        same = first.attrs[CONTENT_DIGEST] == second.attrs[CONTENT_DIGEST]
        other = _other(products, first.attrs["source"] != second.attrs["source"])
        found: list[Difference] = []
        if not same:
            found += _attribute_quantities(recorded, rerun, "release" in other)
            found += _number_quantities(first, second)
    else:
        labels = check_figure(recorded), check_figure(rerun)
        # Of a figure that has no pixels the digest is of those that it was drawn with.
        same = labels[0][CONTENT_DIGEST] == labels[1][CONTENT_DIGEST]
        same = same and drawing(recorded) == drawing(rerun)
        other = _other(products, False)
        found = [] if same else list(figure_differences(recorded, rerun, labels))
    if same:
        return Agreement(EQUAL, other, ())
    ordered = sorted(found, key=lambda each: (each.fits, -each.difference, each.name))
    allowed = bool(other) and bool(found) and all(each.fits for each in found)
    return Agreement(WITHIN if allowed else DIFFERS, other, tuple(ordered))


def _other(products: tuple[Product, Product], other_release: bool) -> tuple[str, ...]:
    first, second = (each.provenance for each in products)
    keys = tuple(key for key in MACHINE if first.get(key) != second.get(key))
    return (*keys, "release") if other_release else keys


def _attribute_quantities(recorded: Path, rerun: Path, other_release: bool) -> Iterator[Difference]:
    """Compare the attributes of two files, as they are there and not as they are in memory."""
    passing = {*PASSING, *EFFORT}
    passing |= set(RELEASE) if other_release else set()
    options: dict[str, Any] = {"engine": "netcdf4", "decode_cf": False}
    with xr.open_dataset(recorded, **options) as first, xr.open_dataset(rerun, **options) as second:
        for key in MEASURED.keys() & first.attrs.keys() & second.attrs.keys():
            passing.add(key)
            apart = abs(float(first.attrs[key]) - float(second.attrs[key]))
            yield Difference(f"{key} (attribute)", apart, MEASURED[key], GROWN.reason)
        yield from _attributes("", first.attrs, second.attrs, passing)
        for name in sorted(map(str, first.variables.keys() & second.variables.keys())):
            ours, theirs = first.variables[name], second.variables[name]
            yield from _attributes(f"{name}.", ours.attrs, theirs.attrs, set())


def _number_quantities(first: xr.Dataset, second: xr.Dataset) -> Iterator[Difference]:
    """Compare the variables of two datasets of the same run."""
    for name in sorted(map(str, {*first.variables, *second.variables})):
        if name not in first.variables or name not in second.variables:
            yield different(f"{name} (is in one of them only)")
            continue
        ours, theirs = first[name], second[name]
        if ours.dims != theirs.dims or ours.shape != theirs.shape or _kind(ours) != _kind(theirs):
            yield different(f"{name} (its dimensions or type)")
        elif ours.dtype.kind != "f":
            yield Difference(name, _unequal(ours, theirs), EXACT.tolerance, EXACT.reason)
        else:
            yield from _numbers(name, first, second)


def _kind(variable: xr.DataArray) -> str:
    return "text" if variable.dtype.kind in "OUT" else variable.dtype.kind


def _attributes(
    prefix: str,
    first: Mapping[Hashable, Any],
    second: Mapping[Hashable, Any],
    passing: set[str],
) -> Iterator[Difference]:
    for key in sorted(map(str, {*first, *second})):
        if key in passing:
            continue
        # As text, in which a fill value that is no number is like itself.
        ours, theirs = (repr(np.asarray(each.get(key)).tolist()) for each in (first, second))
        if ours != theirs:
            yield different(f"{prefix}{key} (attribute)")


def _unequal(first: xr.DataArray, second: xr.DataArray) -> float:
    """Return the share of values that differ."""
    apart = np.asarray(first.values != second.values)
    return float(apart.mean()) if apart.size else 0.0


def _numbers(name: str, first: xr.Dataset, second: xr.Dataset) -> Iterator[Difference]:
    """Compare floating-point numbers by the allowed of their stage."""
    usual, own = TOLERANCES.get(str(first.attrs["stage"]), (EXACT, {}))
    allowed = own.get(name, usual)
    ours, theirs = first[name].values, second[name].values
    early = _early(name, first, second) if allowed.chaotic else None
    part = name if early is None else f"{name} (up to a strain of {EARLY_STRAIN:g})"
    scale = _scale(allowed, name, first)
    kept = ... if early is None else early
    yield Difference(
        part, _apart(ours[kept], theirs[kept]) / scale, allowed.tolerance, allowed.reason
    )
    if early is not None and not early.all() and first[name].dims[0] in ("time", "profile"):
        yield _late(name, first, second, allowed.tolerance * scale)


def _apart(first: FloatArray, second: FloatArray) -> float:
    """Return the largest difference, infinite where only one is known or they are not finite."""
    finite = np.isfinite(first)
    if not np.array_equal(first[~finite], second[~finite], equal_nan=True):
        return np.inf
    return float(np.abs(first[finite] - second[finite]).max(initial=0.0))


def _scale(allowed: Tolerance, name: str, dataset: xr.Dataset) -> float:
    """Return what a difference is relative to; 1 where that is nothing."""
    if allowed.scale in dataset.attrs:
        return float(dataset.attrs[allowed.scale])
    values = dataset[name if allowed.scale == "own" else allowed.scale].values
    known = values[np.isfinite(values)]
    size = float(np.sqrt(np.mean(known**2))) if known.size else 0.0
    return size or 1.0


_TIMES = {"time": "time", "profile": "profile_time", "snapshot": "snapshot_time"}
"""Dimensions along time, and the variables that say when."""


def _early(name: str, first: xr.Dataset, second: xr.Dataset) -> BoolArray | None:
    """Return which rows of a series are early, None where there is no such dimension."""
    dims = first[name].dims
    if "strain" not in first or not dims or dims[0] not in _TIMES:
        return None
    moved = np.maximum(
        *(np.maximum.accumulate(np.abs(each["strain"].values)) for each in (first, second))
    )
    parted = first["time"].values[moved > EARLY_STRAIN]
    times = first[_TIMES[str(dims[0])]].values
    return np.asarray(times < parted[0] if parted.size else np.full(times.shape, True))


def _late(name: str, first: xr.Dataset, second: xr.Dataset, least: float) -> Difference:
    """Compare the means of the end of two series, in standard errors of their difference.

    Each mean is over time or, of profiles, also over the heights of the absolute difference. An
    error is never less than what the early part may differ by.
    """
    dim = str(first[name].dims[0])
    times = first[_TIMES[dim]].values
    late = times > (1 - LATE_SHARE) * times[-1]
    width = np.diff(times, prepend=0.0)[late]
    ours, theirs = (_batches(each[name].values[late], width) for each in (first, second))
    apart = ours.mean(axis=0) - theirs.mean(axis=0)
    errors = [each.var(axis=0, ddof=1) / len(each) for each in (ours, theirs) if len(each) > 1]
    error = np.sqrt(np.sum(errors, axis=0) + least**2)
    known = np.isfinite(apart)
    if not known.any():
        return Difference(name, 0.0, MOST_ERRORS, "unknown in both")
    ratio = np.sqrt(
        np.sum(apart[known] ** 2) / np.sum(np.broadcast_to(error, apart.shape)[known] ** 2)
    )
    reason = "standard errors of the means' difference, from the scatter of ten parts of the series"
    return Difference(f"{name} (mean of the second half)", float(ratio), MOST_ERRORS, reason)


def _batches(values: FloatArray, width: FloatArray) -> FloatArray:
    """Return the means of up to `BATCHES` stretches of a series, weighted by their intervals."""
    parts = np.array_split(np.arange(len(values)), min(BATCHES, len(values)))
    return np.array([np.average(values[part], axis=0, weights=width[part]) for part in parts])
