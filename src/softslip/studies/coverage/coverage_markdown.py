"""Tables of verdicts and coverage in Markdown, for the document, from the dataset alone."""

import numpy as np
import xarray as xr

from softslip.studies.coverage.made_up_curves import CURVES
from softslip.studies.coverage.made_up_series import KINDS
from softslip.studies.markdown import LEFT, RIGHT, markdown_table

FEWEST_INTERVALS = 30
"""Intervals from which a share of them is told."""


def coverage_tables(coverage: xr.Dataset) -> str:
    """Return how often verdicts err, and how often intervals hold the truth.

    Parameters
    ----------
    coverage
        From `studies.coverage.measure_coverage`.
    """
    return f"{_series(coverage)}\n\n{_estimates(coverage)}"


def _percent(share: float, count: float = np.inf) -> str:
    return f"{100 * share:.0f} %" if np.isfinite(share) and count >= FEWEST_INTERVALS else ""


def _heads(coverage: xr.Dataset) -> list[str]:
    return [f"{100 * float(c):.0f} % hold" for c in coverage["confidence"].values]


def _series(coverage: xr.Dataset) -> str:
    """Return a table with a row for each kind of series, noise and memory."""
    rows = []
    for number in range(coverage.sizes["series"]):
        row = coverage.isel(series=number)
        shares = [_percent(float(share)) for share in row["verdict_share"].values[:3]]
        count = int(row["series_intervals"])
        held = [_percent(float(each), count) for each in row["series_coverage"].values]
        words = KINDS[str(row["kind"].item())].words
        noise, memory = f"{100 * float(row['noise']):.0f} %", f"{float(row['memory']):g}"
        rows.append([words, noise, memory, *shares, *held])
    header = ["Series", "Noise", "Memory", "Steady", "Within its error", "Drifting"]
    alignment = [LEFT] + [RIGHT] * 7
    return (
        f"{coverage.attrs['draws']} series of each kind, of {coverage.attrs['records']} records; "
        "the correlation of the noise decays by e within its memory [records].\n\n"
        + markdown_table([*header, *_heads(coverage)], rows, alignment)
    )


def _estimates(coverage: xr.Dataset) -> str:
    """Return a table with a row for each kind of flow curve and parameter."""
    rows = []
    for number in range(coverage.sizes["estimate"]):
        row = coverage.isel(estimate=number)
        count = int(row["estimate_intervals"])
        held = [_percent(float(each), count) for each in row["estimate_coverage"].values]
        fitted = _percent(float(row["fitted_share"]))
        curve, truth = CURVES[str(row["curve"].item())].words, float(row["truth"])
        name = str(row["parameter"].item())
        known = f"{truth:.3g}" if np.isfinite(truth) else "none"
        rows.append([curve, f"`{name}`", known, fitted, *held])
    header = ["Flow curve", "Estimate", "Truth", "Fitted"]
    return (
        f"{coverage.attrs['draws']} flow curves of each kind. *Fitted*: how often the estimate was "
        "said to be determined; where intervals are few, no share of them is told.\n\n"
        + markdown_table([*header, *_heads(coverage)], rows, [LEFT, LEFT] + [RIGHT] * 4)
    )
