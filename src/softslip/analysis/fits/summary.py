"""The fits in words, for a log or a terminal."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

_FLOW = ("yield_stress", "consistency", "flow_index")

LAWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "flow law, each roughness": ("fit_message", _FLOW),
    "flow law, roughnesses pooled": (
        "pooled_fit_message",
        tuple(f"pooled_{name}" for name in _FLOW),
    ),
    "slip above yield": ("slip_coefficient_message", ("slip_coefficient", "slip_linear_evidence")),
    "slip above yield, exponent free": ("slip_exponent_message", ("slip_exponent",)),
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


def summary(fits: xr.Dataset) -> str:
    """Return one line for each fit: its parameters with errors, or why it was not made.

    Parameters
    ----------
    fits
        From `analysis.fits.fit_laws`.
    """
    lines = []
    for law, (message_name, names) in LAWS.items():
        message = fits[message_name]
        for cell in _cells(message):
            here = message.isel(cell)
            said = str(here.item())
            if np.isfinite(fits[names[0]].isel(cell).item()):
                said = f"{said}: {', '.join(_told(fits, name, cell) for name in names)}"
            at = ", ".join(f"{dim} {here[dim].item()}" for dim in cell if dim in here.coords)
            lines.append(f"{law}{f' ({at})' if at else ''}: {said}")
    return "\n".join(lines)
