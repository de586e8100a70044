"""How datasets stand in files: the conventions CF-1.11.

The software speaks of quantities in the units of the model, of places along a dimension by words,
and of time since a stage began. In a file that others read, units are those of UDUNITS, only
numbers in order are the coordinate variable of a dimension, and ``time`` is a date. `as_stored`
turns what is in memory into what a file has, and `as_used` turns it back, to the last bit.
"""

from collections.abc import Hashable, Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

CONVENTIONS = "CF-1.11, ACDD-1.3"

MODEL_UNITS = "model_units"
"""Attribute of a variable in a file: its units in memory, which UDUNITS does not know."""

DERIVED = (MODEL_UNITS, "coverage_content_type", "ancillary_variables")
"""Attributes of variables that only files have, as they follow from the rest."""

FLAG_ATTRIBUTES: Mapping[str, Any] = {
    "flag_values": np.array([0, 1], dtype=np.int8),
    "flag_meanings": "false true",
}
"""What a file says of truth values, which it holds as bytes."""

BINARY_UNITS: Mapping[str, str] = {"MiB": "1048576 byte"}
"""Units of computing that UDUNITS has no name for."""

MODEL_WORDS = ("unit", "radius", "contact range", "each quantity")
"""Parts of the names of the model's units; all of them are pure numbers to anyone else."""

EARTHLY = frozenset(
    ("time", "lat", "latitude", "lon", "longitude", "height", "depth", "altitude", "pressure")
)
"""Names that dimensions have where they are dates and places on Earth, which the model has none
of; readers of CF files guess by them."""

OF_THE_MODEL = "model_"
"""Begins the name in a file of a dimension that is called like one of `EARTHLY`."""

LABELS = "_label"
"""Ends the name in a file of what labels a dimension without being its coordinate variable."""

ANCILLARY = ("_error", "_drift", "_uncertainty")
"""End the names of variables that say how well another one is known."""

QUALITY = (*ANCILLARY, "_deviation", "_tolerance", "_residual", "chi_square")
"""End the names of variables that say how good something is."""

MEASURED_UNITS = ("s", "ns", "byte", "MiB", "1 / s")
"""Units, where they are not divided by others, of what was measured on a machine."""


def file_units(units: str) -> str:
    """Return units as UDUNITS has them: those of the model are 1.

    Parameters
    ----------
    units
        Quotient such as ``length unit / time unit`` or ``s / time unit``.
    """
    head, *divisors = units.split(" / ")
    kept = [each for each in divisors if not _of_the_model(each)]
    return " / ".join(["1" if _of_the_model(head) else BINARY_UNITS.get(head, head), *kept])


def _of_the_model(units: str) -> bool:
    return any(word in units for word in MODEL_WORDS)


def as_stored(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset as it stands in a file.

    - ``units`` that UDUNITS does not know become `file_units`, and are kept in `MODEL_UNITS`.
    - Truth values say what 0 and 1 mean.
    - Each variable has an ISO 19115-1 ``coverage_content_type``, and names those that say how well
      it is known.
    - What labels a dimension without being numbers in order, which CF demands of a coordinate
      variable, becomes an auxiliary one, named after the dimension and `LABELS`.
    - Dimensions called like those of the Earth get `OF_THE_MODEL` before their name.

    Parameters
    ----------
    dataset
        As it is in memory; it is left alone.

    Raises
    ------
    ValueError
        When it has a name that only files have, so that it would not be read back as it is.
    """
    dims = {dim: _stored_dimension(str(dim)) for dim in dataset.dims}
    names = dict(dims)
    for dim in dataset.dims:
        if dim in dataset.variables and not _is_coordinate(dataset.variables[dim]):
            names[dim] = dims[dim] + LABELS
    only_in_files = {OF_THE_MODEL + name for name in EARTHLY}
    only_in_files |= {dim + LABELS for dim in dims.values()}
    if taken := only_in_files & {*dataset.variables, *dataset.dims}:
        raise ValueError(f"{min(taken)} is a name that only files have; use another")
    stored = _renamed(dataset, dims, names)
    for name, variable in stored.variables.items():
        variable.attrs = _stored_attributes(stored, name)
    return stored


def as_used(stored: xr.Dataset) -> xr.Dataset:
    """Return a dataset as it is in memory, from what a file has; the inverse of `as_stored`.

    A file from before there were these conventions is returned as it is.

    Parameters
    ----------
    stored
        As it was read; it is left alone.
    """
    used = _renamed(stored, *_used_names(stored))
    for variable in used.variables.values():
        variable.attrs = _used_attributes(variable)
    return used


def _stored_dimension(name: str) -> str:
    return OF_THE_MODEL + name if name in EARTHLY else name


def _is_coordinate(variable: xr.Variable) -> bool:
    """Tell whether values are those of a coordinate variable: known numbers, strictly in order."""
    values = variable.values
    if values.dtype.kind not in "if" or np.isnan(values).any():
        return False
    return bool((values[1:] > values[:-1]).all() or (values[1:] < values[:-1]).all())


def _used_names(stored: xr.Dataset) -> tuple[dict[Hashable, str], dict[Hashable, str]]:
    """Return the names in memory of a file's dimensions, and of the variables along them."""
    dims: dict[Hashable, str] = {}
    names: dict[Hashable, str] = {}
    for dim in map(str, stored.dims):
        bare = dim.removeprefix(OF_THE_MODEL)
        dims[dim] = bare if bare in EARTHLY else dim
        # Either is there, see `as_stored`.
        name = dim if dim in stored.variables else dim + LABELS
        if name in stored.variables and stored.variables[name].dims == (dim,):
            names[name] = dims[dim]
    return dims, names


def _renamed(
    dataset: xr.Dataset, dims: Mapping[Hashable, str], names: Mapping[Hashable, str]
) -> xr.Dataset:
    """Return a dataset with other names of dimensions and variables, and variables of its own."""

    def taken(chosen: Iterable[Hashable]) -> dict[Hashable, xr.Variable]:
        return {
            names.get(name, name): xr.Variable(
                [dims[dim] for dim in held.dims], held.values, held.attrs, held.encoding
            )
            for name in chosen
            for held in [dataset.variables[name]]
        }

    return xr.Dataset(taken(dataset.data_vars), taken(dataset.coords), dataset.attrs)


def _stored_attributes(stored: xr.Dataset, name: Hashable) -> dict[str, Any]:
    """Return the attributes of a variable in a file, from those that it has in memory."""
    variable = stored.variables[name]
    attributes = dict(variable.attrs)
    units = attributes.get("units")
    if isinstance(units, str) and file_units(units) != units:
        attributes |= {"units": file_units(units), MODEL_UNITS: units}
    if variable.dtype.kind == "b":
        attributes |= FLAG_ATTRIBUTES
    attributes["coverage_content_type"] = _content_type(stored, name, units)
    known = [f"{name}{end}" for end in ANCILLARY if f"{name}{end}" in stored.variables]
    if known and name in stored.data_vars:
        attributes["ancillary_variables"] = " ".join(known)
    return attributes


def _used_attributes(variable: xr.Variable) -> dict[str, Any]:
    """Return the attributes of a variable in memory, from those that it has in a file."""
    attributes = dict(variable.attrs)
    if MODEL_UNITS in attributes:
        attributes["units"] = attributes[MODEL_UNITS]
    flags = FLAG_ATTRIBUTES if variable.dtype.kind == "b" else ()
    return {key: value for key, value in attributes.items() if key not in (*DERIVED, *flags)}


def _content_type(stored: xr.Dataset, name: Hashable, units: Any) -> str:
    """Return what kind of information a variable is, as a code of ISO 19115-1."""
    kind = stored.variables[name].dtype.kind
    if name in stored.coords:
        return "coordinate"
    if kind == "b" or str(name).endswith(QUALITY):
        return "qualityInformation"
    if kind not in "iuf":
        return "auxiliaryInformation"
    if {units, str(units).partition(" / ")[0]} & set(MEASURED_UNITS):
        return "physicalMeasurement"
    return "modelResult"
