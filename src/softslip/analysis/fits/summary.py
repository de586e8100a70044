"""The fits in words, for a log or a terminal."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from softslip.analysis.fits.finite_size import (
    MISMATCH,
    MOONEY_BULK,
    MOONEY_SLIP,
    SIZES,
    trend_name,
)
from softslip.analysis.observables.master_curves import LEAST_CURVES, NAMES

_FLOW = ("yield_stress", "consistency", "flow_index")

_WITH_TRENDS = {"shear_rate_bulk": "bulk shear rate", "slip_velocity": "slip velocity"}

LAWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "flow law, each roughness": ("fit_message", _FLOW),
    "flow law, roughnesses pooled": (
        "pooled_fit_message",
        tuple(f"pooled_{name}" for name in _FLOW),
    ),
    "flow and slip with one yield stress": (
        "joint_fit_message",
        (
            *(f"joint_{name}" for name in _FLOW),
            "joint_slip_coefficient",
            "joint_newtonian_slip_coefficient",
            "joint_agreement",
        ),
    ),
    "slip above yield": ("slip_coefficient_message", ("slip_coefficient",)),
    "slip above yield, exponent free": (
        "slip_exponent_message",
        ("slip_exponent", "slip_linear_evidence"),
    ),
    "slip above yield, yield stress free": ("slip_yield_stress_message", ("slip_yield_stress",)),
    "slip below yield": ("newtonian_slip_coefficient_message", ("newtonian_slip_coefficient",)),
    "slip is suppressed": ("critical_roughness_message", ("critical_roughness",)),
    "heterogeneity, roughnesses pooled": (
        "pooled_heterogeneity_exponent_message",
        ("pooled_heterogeneity_exponent",),
    ),
    "yielding time, roughnesses pooled": (
        "pooled_yielding_exponent_message",
        ("pooled_yielding_exponent",),
    ),
    "slip time": ("slip_time_exponent_message", ("slip_time_exponent",)),
    "apparent shear rate over wall separations": (
        f"{MOONEY_SLIP}_message",
        (MOONEY_SLIP, MOONEY_BULK, MISMATCH),
    ),
    **{
        f"{quantity} over {words}": (f"{parameter}_message", (parameter,))
        for size, words in zip(SIZES, ("wall separations", "channel lengths"), strict=True)
        for name, quantity in _WITH_TRENDS.items()
        for parameter in (trend_name(name, size),)
    },
}
"""Laws by what they are called, their messages and their parameters."""


def _cells(message: xr.DataArray) -> Iterator[dict[str, Any]]:
    for place in np.ndindex(message.shape):
        yield {str(dim): number for dim, number in zip(message.dims, place, strict=True)}


def _told(fits: xr.Dataset, name: str, cell: dict[str, Any]) -> str:
    """Return a parameter with its error."""
    value = f"{name} = {fits[name].isel(cell).item():.4g}"
    if f"{name}_error" not in fits:
        return value
    return f"{value} ± {fits[f'{name}_error'].isel(cell).item():.2g}"


def _place(here: xr.DataArray, cell: dict[str, Any]) -> str:
    """Return where a cell is, in words."""
    return ", ".join(f"{dim} {here[dim].item()}" for dim in cell if dim in here.coords)


@dataclass(frozen=True)
class FitInWords:
    """One fit of a law.

    Attributes
    ----------
    law
        What it is called.
    place
        Where it was made, such as ``roughness 0.59``; empty where it is the only one.
    values
        Parameters with their errors; empty where there is none.
    message
        "fitted", or why it was not or what it does not determine.
    """

    law: str
    place: str
    values: tuple[str, ...]
    message: str


def fits_in_words(fits: xr.Dataset) -> Iterator[FitInWords]:
    """Yield every fit; one for all of a law where they say alike that there is none.

    Parameters
    ----------
    fits
        From `analysis.fits.fit_laws`.
    """
    for law, (message_name, names) in LAWS.items():
        message = fits[message_name]
        words = set(message.values.ravel().tolist())
        if len(words) == 1 and not np.isfinite(fits[names[0]]).any():
            yield FitInWords(law, "", (), words.pop())
            continue
        for cell in _cells(message):
            here = message.isel(cell)
            made = np.isfinite(fits[names[0]].isel(cell).item())
            values = tuple(_told(fits, name, cell) for name in names) if made else ()
            yield FitInWords(law, _place(here, cell), values, str(here.item()))


def _line(law: str, place: str, said: str) -> str:
    return f"{law} ({place}): {said}" if place else f"{law}: {said}"


def _collapse_lines(flow_curve: xr.Dataset) -> Iterator[str]:
    """Yield a line on how well the bulk's rates in time collapse over roughnesses."""
    law = "bulk shear rate in time, over roughnesses"
    curves = flow_curve["master_curves"]
    if int(curves.max()) < LEAST_CURVES:
        yield f"{law}: one roughness only: sweep wall.roughness"
        return
    for cell in _cells(curves):
        here = curves.isel(cell)
        spread, expected, ratio, chance = (
            float(flow_curve[NAMES[field]].isel(cell))
            for field in ("spread", "expected", "ratio", "chance")
        )
        if not np.isfinite(spread):
            said = f"runs at {here.item()} of at least {LEAST_CURVES} roughnesses"
        elif not np.isfinite(ratio):
            said = (
                f"spread = {spread:.2g} of the rate; sweep seed to tell whether that is its error"
            )
        else:
            said = (
                f"spread = {spread:.2g} of the rate, {ratio:.2g} times that of seeds, "
                f"{expected:.2g} (chance {chance:.2g}), {here.item()} roughnesses"
            )
        yield _line(law, _place(here, cell), said)


def summary(fits: xr.Dataset, flow_curve: xr.Dataset) -> str:
    """Return one line for each fit: its parameters with errors, or why it was not made.

    Where all fits of a law say alike why they were not made, one line says so. Last are lines on
    how well the bulk's shear rates in time collapse over roughnesses (`collapse`).

    Parameters
    ----------
    fits
        From `analysis.fits.fit_laws`.
    flow_curve
        From `analysis.observables.flow_curve`, which it was fitted to.
    """
    lines = [
        _line(fit.law, fit.place, ": ".join(filter(None, (fit.message, ", ".join(fit.values)))))
        for fit in fits_in_words(fits)
    ]
    return "\n".join([*lines, *_collapse_lines(flow_curve)])
