"""One file of results: whether it is what was written, and what it says of itself."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import DatasetError
from softslip.files.layout import DATASET
from softslip.files.seals import check_seal
from softslip.files.stamps import check_figure
from softslip.files.storage import read_dataset
from softslip.messages import file_text
from softslip.provenance.archive import UNREADABLE
from softslip.provenance.product_labels import Product, product_of, read_product

RIGHT, ALTERED = "right", "altered"
"""What a file is by its seal, its digests and the schema of its stage, unless `UNREADABLE`."""

MARKS = ("parent", "mean_radius", "area_fraction")
"""Attributes of a run's dataset that follow from its parameters, and are kept for `claims`."""


@dataclass(frozen=True)
class RunCell:
    """What a table says of one run.

    Attributes
    ----------
    run
        Of the shear stage, empty where it is missing.
    done
        Whether it is there.
    values
        The swept ones, in the order of the axes.
    """

    run: str
    done: bool
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Examination:
    """What a file holds, without its numbers.

    Attributes
    ----------
    path
        Where it is.
    state
        `RIGHT`, `ALTERED` or `UNREADABLE`.
    problem
        What is wrong with it, in one sentence; empty where it is right.
    product
        What it says of itself, None unless it is right.
    marks
        Those of `MARKS` that it has.
    cells
        Of a table the runs, None where it does not name them.
    """

    path: Path
    state: str
    problem: str = ""
    product: Product | None = None
    marks: Mapping[str, Any] = field(default_factory=dict)
    cells: tuple[RunCell, ...] | None = None


def examine(path: Path) -> Examination:
    """Read a whole file, and recompute its seal and its digests."""
    try:
        return _examined(path)
    except DatasetError as error:
        state = UNREADABLE if isinstance(error.__cause__, OSError) else ALTERED
        return Examination(path, state, str(error))
    # What whoever forged a file has put into it can make readers raise anything.
    except Exception as error:
        reason = " ".join(f"{type(error).__name__} {error}".split())
        problem = f"{file_text(path)}: holds what no command writes ({reason}); rerun its job"
        return Examination(path, ALTERED, problem)


def _examined(path: Path) -> Examination:
    if path.suffix != DATASET:
        return Examination(path, RIGHT, product=product_of(path, check_figure(path)))
    check_seal(path)
    product = read_product(path)
    dataset = read_dataset(path, stage=product.stage, run=product.run)
    marks = {key: np.asarray(dataset.attrs[key]).item() for key in MARKS if key in dataset.attrs}
    cells = tuple(_cells(dataset)) if "run_id" in dataset else None
    return Examination(path, RIGHT, product=product, marks=marks, cells=cells)


def _cells(table: xr.Dataset) -> Iterator[RunCell]:
    status, runs = table["status"], table["run_id"].values
    swept = [table[dim].values.tolist() for dim in status.dims]
    for place in np.ndindex(status.shape):
        values = tuple(axis[index] for axis, index in zip(swept, place, strict=True))
        yield RunCell(str(runs[place]), str(status.values[place]) == "done", values)
