"""The comparison with the paper as a table for documents."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from softslip.analysis.against_paper import COMPARED, ComparedNumber
from softslip.files.quantities import dataset_quantity
from softslip.messages import counted, table_row

HEAD = ("", "Paper", "Source", "Here", "Difference [standard errors]", "Remark")


def comparison_table(comparison: xr.Dataset) -> str:
    """Return the comparison as tables in Markdown, one for each combination of dimensions.

    Parameters
    ----------
    comparison
        From `against_paper`, with the scenario as its attribute ``run``.
    """
    return "\n\n".join(_table(title, rows) for title, rows in compared_rows(comparison)) + "\n"


def _table(title: str, rows: Sequence[Sequence[str]]) -> str:
    lines = map(table_row, (HEAD, ["---"] * len(HEAD), *rows))
    return "\n".join([f"{title}:", "", *lines])


def compared_rows(comparison: xr.Dataset) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """Yield a title and the rows below `HEAD` for each combination of dimensions.

    Parameters
    ----------
    comparison
        See `comparison_table`.
    """
    runs = comparison["runs_done"]
    for place in np.ndindex(runs.shape):
        at = dict(zip(map(str, runs.dims), place, strict=True))
        cell = comparison.isel(at)
        where = [f"{dim} {cell[dim].item()}" for dim in at if dim in cell.coords]
        scenario = f"Scenario {comparison.attrs.get('run', '')}"
        finished = counted(int(cell["runs_done"]), "finished run")
        rows = [_row(cell, name, number) for name, number in COMPARED.items()]
        yield ", ".join([scenario, finished, *where]), rows


def _row(cell: xr.Dataset, name: str, number: ComparedNumber) -> tuple[str, ...]:
    """Return the cells of one number: what it is, the paper's, ours and the difference."""
    known = dataset_quantity(name)
    meaning = f"{known.meaning[0].upper()}{known.meaning[1:]}" if known else name
    theirs = f"{number.reported.value:.3g}"
    if number.reported.uncertainty is not None:
        theirs += f" ± {number.reported.uncertainty:g}"
    value, error = float(cell[name]), float(cell[f"{name}_error"])
    ours = f"{value:.3g} ± {error:.2g}" if np.isfinite(value) else "—"
    gap, remark = float(cell[f"{name}_difference"]), str(cell[f"{name}_remark"].item())
    difference = f"{gap:+.1f}" if np.isfinite(gap) else "—"
    symbol = f"${number.reported.symbol}$"
    return f"{meaning}, {symbol}", theirs, number.reported.source, ours, difference, remark
