"""Whether a dataset is what its stage writes, before anything is made from it."""

from collections.abc import Mapping
from pkgutil import resolve_name

import xarray as xr

from softslip.errors import DatasetError
from softslip.files.faults import faults
from softslip.files.products import DATASETS
from softslip.files.schema import Schema
from softslip.files.stage_schemas import STAGE_SCHEMAS

SCHEMAS: Mapping[str, Schema] = {
    **STAGE_SCHEMAS,
    **{name: resolve_name(entry.schema) for name, entry in DATASETS.items() if entry.schema},
}
"""What the datasets of each stage must look like."""


def check_dataset(dataset: xr.Dataset, stage: str) -> None:
    """Make sure that a dataset is what a stage writes, so that nothing wrong is computed from it.

    Variables that a stage does not know are left alone: nobody reads them.

    Parameters
    ----------
    dataset
        As read from a file.
    stage
        What it is to be the result of, one of `SCHEMAS`.

    Raises
    ------
    DatasetError
        In one sentence with the first variable that is wrong, what is wrong with it, what it
        should be and what to do.
    KeyError
        When there is no such stage.
    """
    for fault in faults(dataset, SCHEMAS[stage]):
        raise DatasetError(f"{fault}; delete the file and rerun its job")
