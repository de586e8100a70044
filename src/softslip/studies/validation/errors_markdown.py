"""Errors of the cases with known solutions as a Markdown table, from their datasets alone."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from softslip.studies.markdown import LEFT, RIGHT, markdown_table

LEVELS = ("literal", "preview", "standard", "paper", "converged")
"""Columns of the table, in this order."""


def errors_table(datasets: Sequence[xr.Dataset]) -> str:
    """Return the largest error of each case over all that was solved, level by level.

    Parameters
    ----------
    datasets
        Of `studies.validation.sweeps.sweep`, with the name of the sweep as ``run``.
    """
    head = ("Case", "Over", "Error of", *(f"`{level}`" for level in LEVELS), "Limit")
    alignment = [LEFT] * 3 + [RIGHT] * (len(LEVELS) + 1)
    rows = []
    for dataset in datasets:
        for name in _errors(dataset):
            cells = [_cell(dataset, name, level) for level in LEVELS]
            limit = float(dataset[f"{name}_tolerance"].max())
            quantity = dataset[f"{name}_error"].attrs["long_name"].removeprefix("error of: ")
            rows.append([dataset.attrs["run"], _over(dataset), quantity, *cells, f"{limit:.2g}"])
    return markdown_table(head, rows, alignment) + "\n"


def _errors(dataset: xr.Dataset) -> list[str]:
    """Return the names of a case's errors, the one that counts first."""
    names = [
        str(name).removesuffix("_error") for name in dataset.data_vars if "_error" in str(name)
    ]
    return sorted(names, key=lambda name: name != dataset.attrs["leading"])


def _over(dataset: xr.Dataset) -> str:
    """Return the values that a case was solved for, apart from the level."""
    axes = []
    for dim in dataset["passed"].dims:
        values = dataset[dim].values
        if dim == "fidelity" or len(values) < 2:
            continue
        if values.dtype.kind in "if":
            axes.append(f"{str(dim).replace('_', ' ')} {values.min():g} … {values.max():g}")
        else:
            axes.append(f"{str(dim).replace('_', ' ')} {', '.join(map(str, values))}")
    return "; ".join(axes)


def _cell(dataset: xr.Dataset, name: str, level: str) -> str:
    """Return the largest error at a level, and how many combinations it could not be told of."""
    if "fidelity" in dataset.dims:
        if level not in dataset["fidelity"].values:
            return ""
        dataset = dataset.sel(fidelity=level)
    elif dataset.attrs["fidelity"] != level:
        return ""
    error, refused = dataset[f"{name}_error"], int((dataset["refusal"] != "").sum())
    note = f" ({refused} refused)" if refused else ""
    return (f"{float(error.max()):.2g}" if np.isfinite(error).any() else "–") + note
