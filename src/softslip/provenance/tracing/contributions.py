"""Which runs a value was computed from, from the table of runs that it goes back to."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from softslip.analysis.fits import FITTED, yield_stress_of
from softslip.analysis.fits.finite_size import refusal
from softslip.analysis.fits.points import with_stress
from softslip.analysis.fits.slip import CLEAR, least_flowing_stress
from softslip.analysis.observables import mean_over_seeds
from softslip.errors import DatasetError
from softslip.provenance.tracing.fitted_laws import Law, law_of, laws_of
from softslip.provenance.tracing.targets import Values, value_at

RUN = "run_id"
"""Variable of a table of runs that says which run each cell comes from."""

ENTERED = ""
"""Reason of a run that was not left out."""


@dataclass(frozen=True)
class Part:
    """What a run has in a value.

    Attributes
    ----------
    run
        Of the shear stage; empty where it is missing.
    coordinates
        Where the run lies in the table.
    of
        What of it is used: a variable of the table, empty where a cell is the run's alone.
    left_out
        Why it is not used; `ENTERED` where it is.
    """

    run: str
    coordinates: Mapping[str, Any]
    of: str
    left_out: str


def fit_message(values: Values) -> str:
    """Return what a fit says of one of its outcomes, nothing for several or for other values."""
    law = law_of(values.variable) if values.product.stage == "fits" else None
    if law is None or law.message not in values.dataset or values.data.ndim:
        return ""
    message = values.dataset[law.message]
    return str(message.isel({dim: values.places[str(dim)] for dim in message.dims}).item())


def cells_of(table: xr.Dataset, variable: str, places: Mapping[str, int]) -> list[Part]:
    """Return the runs behind a variable of a table of runs.

    Parameters
    ----------
    table
        With `RUN`, from `analysis.observables`.
    variable
        Its dimensions that `RUN` has too tell the runs apart; along others all are one run's.
    places
        Index along each dimension along which one was chosen.

    Raises
    ------
    DatasetError
        When the table does not say which runs it is of.
    """
    shared = {dim: place for dim, place in places.items() if dim in _runs(table).dims}
    return [Part(run, at, "", ENTERED if run else "missing") for run, at in _each(table, shared)]


def fitted_parts(
    fits: xr.Dataset, curve: xr.Dataset, variable: str, places: Mapping[str, int]
) -> list[Part]:
    """Return the runs of the points that a fitted variable was fitted to, and the others.

    A run enters with its point, the mean over its seeds, as in `analysis.fits`: where that is
    steady, of known error and positive stress, and on the law's side of the yield stress. That
    yield stress is fitted to the runs of all roughnesses, which enter by it.

    Parameters
    ----------
    fits, curve
        The fits, and the flow curve that they were fitted to.
    variable
        Of the fits.
    places
        Index along each dimension along which one was chosen.

    Raises
    ------
    DatasetError
        When the curve does not say which runs it is of.
    """
    laws, chosen = laws_of(variable), _shared(fits, curve, places)
    if not laws:
        return cells_of(curve, variable, chosen)
    parts = []
    for law in laws:
        reasons = _reasons(fits, curve, law).isel(chosen)
        parts += [
            Part(run, at, law.series, str(reason) if run else "missing")
            for (run, at), reason in zip(_each(curve, chosen), reasons.values.ravel(), strict=True)
        ]
        if law.side:
            pooled = {dim: place for dim, place in places.items() if dim != "roughness"}
            prefix = _prefix_in_use(fits, law, pooled)
            parts += fitted_parts(fits, curve, f"{prefix}yield_stress", pooled)
    return parts


def _prefix_in_use(fits: xr.Dataset, law: Law, places: Mapping[str, int]) -> str:
    """Return the beginning of the name of the yield stress that tells sides, at one place."""
    for prefix in law.prefixes:
        message = fits[f"{prefix}fit_message"]
        here = message.isel({dim: place for dim, place in places.items() if dim in message.dims})
        if (here == FITTED).any():
            return prefix
    return law.prefixes[0]


def miscounted(
    fits: xr.Dataset, curve: xr.Dataset, variable: str, places: Mapping[str, int]
) -> str:
    """Return what is wrong with the number of points that fits state, nothing where it is right."""
    laws = laws_of(variable)
    if not laws or laws[0].points not in fits:
        return ""
    law, averaged = laws[0], mean_over_seeds(curve)
    stated = fits[law.points]
    found = xr.zeros_like(stated, dtype=int)
    for each in laws:
        usable = _tested(fits, averaged, each) == ENTERED
        found = found + usable.sum([dim for dim in usable.dims if dim not in stated.dims])
    at = {dim: place for dim, place in places.items() if dim in stated.dims}
    counted, noted = found.isel(at).values, stated.transpose(*found.dims).isel(at).values
    if np.array_equal(counted, noted):
        return ""
    return (
        f"{law.points} is {int(noted.sum())} where the flow curve has {int(counted.sum())} usable "
        f"points of {law.series}: other code has fitted it"
    )


def _runs(table: xr.Dataset) -> xr.DataArray:
    if RUN not in table:
        raise DatasetError(
            f"{table.attrs.get('stage')} {table.attrs.get('run')}: has no {RUN}, so that its "
            "values cannot be traced to runs; rerun its gathering"
        )
    return table[RUN]


def _shared(fits: xr.Dataset, curve: xr.Dataset, places: Mapping[str, int]) -> dict[str, int]:
    """Return the places along the dimensions that the curve's runs have."""
    return {dim: place for dim, place in places.items() if dim in _runs(curve).dims}


def _each(table: xr.Dataset, places: Mapping[str, int]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the run in each cell and the cell's coordinates, in the order of the table."""
    runs = _runs(table)
    kept = [np.atleast_1d(places.get(str(dim), np.arange(runs.sizes[dim]))) for dim in runs.dims]
    for inside in np.ndindex(*(len(each) for each in kept)):
        place = tuple(int(each[number]) for each, number in zip(kept, inside, strict=True))
        at = {
            str(dim): value_at(table, str(dim), number)
            for dim, number in zip(runs.dims, place, strict=True)
        }
        yield str(runs.values[place]), at


def _reasons(fits: xr.Dataset, curve: xr.Dataset, law: Law) -> xr.DataArray:
    """Return why each run is left out, shaped as `RUN`; its own reason before that of its point."""
    runs = _runs(curve)
    point = _tested(fits, mean_over_seeds(curve), law).broadcast_like(runs)
    if "seed" not in runs.dims:
        return point.transpose(*runs.dims)
    own = _tested(fits, curve, law)
    alone = own.where(own != ENTERED, point + " with its other seeds")
    # The mean over seeds goes by those that have a value.
    known = point.where(curve[law.series].notnull(), "not known")
    return known.where(point == ENTERED, alone).transpose(*runs.dims)


def _tested(fits: xr.Dataset, curve: xr.Dataset, law: Law) -> xr.DataArray:
    """Return why each point cannot be fitted, `ENTERED` where it can."""
    value, error = curve[law.series], curve[f"{law.series}_error"]
    reasons: dict[str, xr.DataArray] = {
        "not steady": curve[law.flag] if law.flag else value.notnull(),
        "of unknown error": (abs(error) < np.inf) & ((error > 0) | (value != 0)),
    }
    if law.size:
        unfit = refusal(curve, law.size)
        reasons |= {unfit: xr.full_like(value, False, dtype=bool)} if unfit else {}
    else:
        curve = with_stress(curve)
        reasons["not at a positive stress"] = curve["stress"] > 0
    if law.side:
        reasons |= _on_side(fits, curve, law)
    if law.smoothest and "roughness" in value.dims:
        reasons["not at the smoothest wall"] = curve["roughness"] == curve["roughness"].min()
    verdicts = xr.full_like(value, ENTERED, dtype=object)
    for reason, passed in reasons.items():
        verdicts = verdicts.where((verdicts != ENTERED) | passed, reason)
    return verdicts


def _on_side(fits: xr.Dataset, curve: xr.Dataset, law: Law) -> dict[str, xr.DataArray]:
    """Return which points are on the law's side of the yield stress, by what they lack if not."""
    value, error = yield_stress_of(fits, law.prefixes)
    known = value.notnull() & (error < np.inf)
    clear = law.side * (curve["stress"] - value) > CLEAR * error
    if law.film:
        clear = clear | fits[law.film]
    word = "above" if law.side > 0 else "below"
    if not law.alone:
        return {"without a yield stress": known, f"not {word} the yield stress": clear}
    flows = curve["stress"] >= least_flowing_stress(curve)
    by_verdict = flows if law.side > 0 else ~flows
    if law.film:
        by_verdict = by_verdict | fits[law.film]
    return {f"not {word} the yield stress": clear.where(known, by_verdict).astype(bool)}
