"""Tables over runs, with the labels of the runs that they were made from."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import xarray as xr

from softslip.config.scenario import Scenario
from softslip.errors import ConfigError
from softslip.files.layout import DATASET
from softslip.files.products import TABLES
from softslip.files.storage import read_dataset
from softslip.messages import brief


def check_table(table: str) -> None:
    """Refuse the name of a table that there is none of.

    Raises
    ------
    ConfigError
        When it is none of `files.products.TABLES`.
    """
    if table not in TABLES:
        options = f"use one of {', '.join(TABLES)}"
        raise ConfigError("table", brief(table), "is not an analysis", options)


def finished_runs(
    scenario: Scenario, results: Path
) -> Iterator[tuple[dict[str, Any], xr.Dataset | None]]:
    """Yield the swept values of each run and its records, or None where there are none yet.

    Raises
    ------
    DatasetError
        When a finished run cannot be read.
    """
    for run in scenario.runs():
        path = results / "shear" / f"{run.ids['shear']}{DATASET}"
        records = read_dataset(path, stage="shear", run=run.ids["shear"]) if path.exists() else None
        yield dict(run.coordinates), records


def gather_table(
    table: str, runs: Iterable[tuple[Mapping[str, Any], xr.Dataset | None]]
) -> tuple[xr.Dataset, list[xr.Dataset]]:
    """Return a table over runs, and the labels of each that it was made from.

    Of each run only what names it is kept, as a dataset without data: there may be thousands.

    Parameters
    ----------
    table
        One of `files.products.TABLES`.
    runs
        See `analysis.observables.tables.collect`.

    Raises
    ------
    DatasetError
        When no run is done.
    """
    parents: list[xr.Dataset] = []

    def noted() -> Iterator[tuple[Mapping[str, Any], xr.Dataset | None]]:
        for labels, records in runs:
            if records is not None:
                parents.append(xr.Dataset(attrs=records.attrs))
            yield labels, records

    gathered: xr.Dataset = resolve_name(TABLES[table].function)(noted())
    return gathered, parents
