"""Units and meanings of variables, as attributes of datasets."""

from collections.abc import Mapping

import xarray as xr

OF_QUANTITY = "as of each quantity"
"""Unit of a variable along ``quantity``."""


def attributes(unit: str, meaning: str) -> dict[str, str]:
    """Return the attributes of a variable."""
    return {"units": unit, "long_name": meaning}


def with_meanings(dataset: xr.Dataset, meanings: Mapping[str, tuple[str, str]]) -> xr.Dataset:
    """Return a dataset with unit and meaning at each of its variables that has an entry."""
    for name, variable in dataset.variables.items():
        if name in meanings:
            variable.attrs.update(attributes(*meanings[str(name)]))
    return dataset
