"""Tables of verdicts and coverage in Markdown, for the document, from the dataset alone."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from softslip.analysis.fits.slip import CONCLUSIVE
from softslip.studies.coverage.claims import CLOSE, FEWEST_INTERVALS, claims
from softslip.studies.coverage.made_up_curves import CURVES, CurveKind
from softslip.studies.coverage.made_up_runs import (
    DURATION,
    RUNS,
    TYPICAL_RATE,
    TYPICAL_SLIP,
    RunKind,
)
from softslip.studies.coverage.made_up_series import KINDS
from softslip.studies.markdown import LEFT, RIGHT, markdown_table

OFF = "*Median off by*: how far the median of the estimates is from a truth that is not zero. "
"""What the column says."""


def coverage_tables(coverage: xr.Dataset) -> str:
    """Return how often verdicts err, and how often intervals hold the truth: a table a part.

    Parameters
    ----------
    coverage
        From `studies.coverage.measure_coverage`.
    """
    tables = (_apart, _series, _measurements, _estimates, _evidence)
    return "\n\n".join(table(coverage) for table in tables)


def _apart(coverage: xr.Dataset) -> str:
    """Return a table of the estimates that claim too much or too little."""
    claimed = coverage["confidence"].values
    told = list(claims(coverage))
    apart = [claim for claim in told if claim.is_apart(claimed)]
    rows = [
        [claim.words, f"`{claim.estimate}`", f"{claim.intervals}", *map(_percent, claim.shares)]
        for claim in apart
    ]
    header = ["Data", "Estimate", "Intervals", *_heads(coverage)]
    intro = (
        f"Of {len(told)} estimates with {FEWEST_INTERVALS} intervals and more, those of "
        f"{len(apart)} hold more or less often than they claim by over {100 * CLOSE:.0f} points"
    )
    table = markdown_table(header, rows, [LEFT, LEFT] + [RIGHT] * 3)
    return f"{intro}:\n\n{table}" if apart else f"{intro}."


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
        words = KINDS[str(row["kind"].item())].words
        noise, memory = f"{100 * float(row['noise']):.0f} %", f"{float(row['memory']):g}"
        rows.append([words, noise, memory, *shares, *_held(row, "series")])
    header = ["Series", "Noise", "Memory", "Steady", "Within its error", "Drifting"]
    alignment = [LEFT] + [RIGHT] * 7
    return (
        f"{coverage.attrs['draws']} series of each kind, of {coverage.attrs['records']} records; "
        "the correlation of the noise decays by e within its memory [records].\n\n"
        + markdown_table([*header, *_heads(coverage)], rows, alignment)
    )


def _known(truth: float) -> str:
    return f"{truth:.3g}" if np.isfinite(truth) else "none"


def _held(row: xr.Dataset, name: str) -> list[str]:
    count = int(row[f"{name}_intervals"])
    return [_percent(float(each), count) for each in row[f"{name}_coverage"].values]


def _off(row: xr.Dataset, name: str, truth: float) -> str:
    """Return the median difference over a truth that is not zero, in per cent, with its sign."""
    told = truth != 0 and int(row[f"{name}_intervals"]) >= FEWEST_INTERVALS
    off = 100 * float(row[f"{name}_difference"]) / truth if told else np.nan
    return f"{off:+.1f} %" if np.isfinite(off) else ""


def _intervals(
    coverage: xr.Dataset,
    dim: str,
    columns: tuple[str, str, str, str],
    kinds: Mapping[str, RunKind] | Mapping[str, CurveKind],
    header: list[str],
) -> str:
    """Return a table of intervals: a row for each kind of data and quantity, and its truth."""
    kind, name, truth, share = columns
    rows = []
    for number in range(coverage.sizes[dim]):
        row = coverage.isel({dim: number})
        words, quantity = kinds[str(row[kind].item())].words, f"`{row[name].item()}`"
        true = float(row[truth])
        said = [_known(true), _percent(float(row[share])), _off(row, dim, true)]
        rows.append([words, quantity, *said, *_held(row, dim)])
    alignment = [LEFT, LEFT] + [RIGHT] * 5
    return markdown_table([*header, "Median off by", *_heads(coverage)], rows, alignment)


def _measurements(coverage: xr.Dataset) -> str:
    """Return a table with a row for each kind of run and observable."""
    columns = ("run_kind", "observable", "observable_truth", "known_share")
    table = _intervals(
        coverage, "measurement", columns, RUNS, ["Run", "Observable", "Truth", "Known"]
    )
    return (
        f"{coverage.attrs['runs']} runs of each kind, of {DURATION:g} time units. Where nothing "
        f"else is said, the bulk creeps until it flows at {TYPICAL_RATE:g}, slip is "
        f"{TYPICAL_SLIP:g}, and noise 10 % with a memory of 5. Noise is relative, and its "
        "correlation decays by e within its memory [time units]. "
        "*Known*: how often the observable had a value with an error and, of averages, a steady "
        f"verdict. {OFF}Intervals are value ± t error with Student's quantile, and the normal one "
        f"for times.\n\n{table}"
    )


def _estimates(coverage: xr.Dataset) -> str:
    """Return a table with a row for each kind of flow curve and parameter."""
    columns = ("curve", "parameter", "truth", "fitted_share")
    table = _intervals(
        coverage, "estimate", columns, CURVES, ["Flow curve", "Estimate", "Truth", "Fitted"]
    )
    return (
        f"{coverage.attrs['draws']} flow curves of each kind. *Fitted*: how often the estimate was "
        f"said to be determined; where intervals are few, no share of them is told. {OFF}Estimates "
        "that are not `pooled_` over roughness are those of the smoothest wall by itself.\n\n"
        f"{table}"
    )


def _evidence(coverage: xr.Dataset) -> str:
    """Return a table of what the evidence for the law of slip favours, a row for each kind."""
    rows = []
    for number in range(coverage.sizes["slip_kind"]):
        row = coverage.isel(slip_kind=number)
        words, truth = CURVES[str(row["slip_curve"].item())].words, float(row["slip_truth"])
        shares = [_percent(float(each)) for each in row["favoured_share"].values]
        rows.append([words, _known(truth), *shares])
    header = ["Flow curve", "True p", "p = 1 favoured", "p = 2 favoured", "Neither"]
    return (
        f"What `slip_linear_evidence` favours at the smoothest wall: p = 1 above {CONCLUSIVE:g}, "
        f"p = 2 below −{CONCLUSIVE:g}.\n\n" + markdown_table(header, rows, [LEFT] + [RIGHT] * 4)
    )
