"""The fits in words, for a log or a terminal."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from softslip.analysis.fits.points import FITTED

_LAWS: dict[str, tuple[str, tuple[str, ...]]] = {
    "flow law, each roughness": ("fit_message", ("yield_stress", "consistency", "flow_index")),
    "flow law, roughnesses pooled": (
        "pooled_fit_message",
        ("pooled_yield_stress", "pooled_consistency", "pooled_flow_index"),
    ),
    "slip above yield": ("slip_coefficient_message", ("slip_coefficient",)),
    "slip below yield": ("newtonian_slip_coefficient_message", ("newtonian_slip_coefficient",)),
}


def _cells(message: xr.DataArray) -> Iterator[dict[str, Any]]:
    for place in np.ndindex(message.shape):
        yield {str(dim): number for dim, number in zip(message.dims, place, strict=True)}


def summary(fits: xr.Dataset) -> str:
    """Return one line for each fit: its parameters with errors, or why it was not made.

    Parameters
    ----------
    fits
        From `analysis.fits.fit_laws`.
    """
    lines = []
    for law, (message_name, names) in _LAWS.items():
        message = fits[message_name]
        for cell in _cells(message):
            here = message.isel(cell)
            said = str(here.item())
            if said.startswith(FITTED):
                values = (
                    f"{name} = {fits[name].isel(cell).item():.4g} "
                    f"± {fits[f'{name}_error'].isel(cell).item():.2g}"
                    for name in names
                )
                said = f"{said}: {', '.join(values)}"
            at = ", ".join(f"{dim} {here[dim].item()}" for dim in cell if dim in here.coords)
            lines.append(f"{law}{f' ({at})' if at else ''}: {said}")
    return "\n".join(lines)
