"""From the trade-off dataset to settings for a wanted accuracy."""

import json
import math
from typing import Any

import numpy as np
import xarray as xr

WIDEST_SPACING = 6.0
"""Node spacing over the paper's mesh size beyond which tight packings and rough channels that
were not measured here may let films collapse."""

LEAST_REGULARISATION = 0.05
"""Regularisation length over the paper's mesh size below which nothing was measured."""


def choices(tradeoff: xr.Dataset) -> list[dict[str, Any]]:
    """Return what a user may choose from, cheapest first, as JSON can hold it.

    These are members of the grid that ran on every scene, whose settings are safe in scenes that
    were not measured, and that none of the others beats in both error and cost.

    The error is that against the physics without regularisation: the largest relative error of
    slip velocity, γ̇_wall and γ̇_bulk, rms over scenes and records. What regularisation causes,
    what nodes and steps cause, the uncertainty of the limit and the finest member's own error from
    its nodes are added up, as if none cancelled another. Averages over a run of finite length have
    a statistical error on top, which no settings remove.

    Parameters
    ----------
    tradeoff
        Of `studies.tradeoff.table.gather`.

    Returns
    -------
    list of dict
        ``settings`` by group and key, ``error`` [1] and ``cost`` over that of 'standard' [1], as
        `config.accuracy.Choice` takes them.
    """
    doubt = doubts(tradeoff)
    rows = [
        {
            "settings": json.loads(str(tradeoff["settings"].values[number])),
            "error": _rounded_up(_error(tradeoff, number, doubt)),
            "cost": float(f"{float(tradeoff['cost_ratio'].values[number]):.3g}"),
        }
        for number in range(tradeoff.sizes["member"])
        if _safe(tradeoff, number)
    ]
    rows.sort(key=lambda row: (row["cost"], row["error"]))
    found: list[dict[str, Any]] = []
    for row in rows:
        if not found or row["error"] < found[-1]["error"]:
            found.append(row)
    return found


def doubts(tradeoff: xr.Dataset) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return what is not known of each quantity's error: of the limit and of the finest nodes."""
    parts = [tradeoff[name].values for name in ("limit_error", "closer_error")]
    return np.asarray(np.sqrt(np.sum(np.nan_to_num(np.stack(parts)) ** 2, axis=0)))


def _error(
    tradeoff: xr.Dataset, number: int, doubt: np.ndarray[Any, np.dtype[np.float64]]
) -> float:
    parts = [tradeoff[name].values[number] for name in ("regularisation_error", "same_error")]
    return float((parts[0] + parts[1] + doubt).max())


def _rounded_up(value: float) -> float:
    """Return a value rounded up to two digits: what is promised must hold."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / unit * (1 - 1e-12)) * unit:.2g}")


def _safe(tradeoff: xr.Dataset, number: int) -> bool:
    """Return whether a member is one that others may use for other scenes."""

    def of(name: str) -> Any:
        return tradeoff[name].values[number]

    return bool(
        of("kind") in ("factorial", "finest")
        and of("status") == "done"
        and np.isfinite(of("total_error"))
        and np.isfinite(of("cost_ratio"))
        and of("node_spacing") <= WIDEST_SPACING
        and of("regularisation") >= LEAST_REGULARISATION
    )
