"""What is wrong with a dataset, measured against a declaration of what it must look like.

The checks look at names, dimensions, types, units, sizes and values, and recompute nothing.
"""

import json
from collections.abc import Hashable, Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from softslip.files.quantities import FORMER_UNITS
from softslip.files.schema import Kind, Schema, Variable
from softslip.messages import Verbatim, brief

TYPES: Mapping[Kind, np.dtype[Any]] = {
    "number": np.dtype(np.float64),
    "count": np.dtype(np.int64),
    "flag": np.dtype(np.bool_),
}
"""Type of the values of each kind; words may be of any length and are looked at one by one."""

KINDS: Mapping[str, Kind] = {"f": "number", "i": "count"}
"""Kind of swept values by the kind of their type; all others are words."""

SIZES: Mapping[str, int] = {"axis": 2, "wall": 2, "parameter": 3, "other_parameter": 3, "end": 2}
"""Sizes of the dimensions that always have the same."""

LEAST_SIZES: Mapping[str, int] = {
    "time": 1,
    "profile": 1,
    "wall_distance": 2,
    "snapshot": 1,
    "field_x": 1,
    "field_y": 1,
    "wall_node": 1,
    "normalised_position": 2,
}
"""Smallest sizes of other dimensions; those not named may be 0, as without particles."""


def faults(dataset: xr.Dataset, schema: Schema) -> Iterator[str]:
    """Yield what is wrong with a dataset; take the first, as later checks rely on earlier ones.

    Parameters
    ----------
    dataset
        Any dataset.
    schema
        What it must look like.
    """
    expected = dict(schema.variables)
    for group, path in schema.groups.items():
        members = [name for name, variable in expected.items() if variable.group == group]
        if not any(name in dataset.variables for name in members):
            yield from _parameter_faults(dataset, path)
            if not _is_asked_for(dataset, path):
                expected = {name: each for name, each in expected.items() if name not in members}
    for name in expected:
        if name not in dataset.variables:
            yield f"variable {name} is missing, which this stage writes"
    sweeps = dict.fromkeys(schema.sweep_of(variable) for variable in expected.values())
    leads = {name: () if name is None else dataset.variables[name].dims for name in sweeps}
    yield from _swept_faults(dataset, schema, leads)
    for name, variable in expected.items():
        lead = leads[schema.sweep_of(variable)]
        yield from _form_faults(name, dataset.variables[name], variable, lead)
    for name, variable in expected.items():
        yield from _value_faults(name, dataset.variables[name].values, variable)
        yield from _gap_faults(name, dataset, variable)
    for rule in schema.rules:
        fault = rule(dataset)
        if fault is not None:
            yield fault


def _is_asked_for(dataset: xr.Dataset, path: str) -> bool:
    """Tell whether a run's parameters ask for a group; without parameters nothing is asked for."""
    section, _, name = path.partition(".")
    text = dataset.attrs.get("parameters")
    return text is not None and json.loads(text)[section][name] not in (None, [])


def _parameter_faults(dataset: xr.Dataset, path: str) -> Iterator[str]:
    """Yield that the parameters cannot be read, if they cannot."""
    try:
        _is_asked_for(dataset, path)
    except (ValueError, TypeError, KeyError, IndexError, RecursionError):
        text = shown(dataset.attrs["parameters"])
        yield f"attribute parameters is {text}, not the JSON of a run's parameters with {path}"


def _swept_faults(
    dataset: xr.Dataset, schema: Schema, leads: Mapping[str | None, tuple[Hashable, ...]]
) -> Iterator[str]:
    """Yield what is wrong with the values swept and with those that all runs share."""
    own = {dim for variable in schema.variables.values() for dim in variable.dims}
    for sweep, lead in leads.items():
        for dim in lead:
            if dim in own:
                yield f"variable {sweep} has the dimension {_plain(dim)}, which is not swept"
    swept = tuple(dict.fromkeys(dim for lead in leads.values() for dim in lead))
    for dim in swept:
        name = _plain(dim)
        if dim not in dataset.variables:
            yield f"variable {name} is missing, which holds the swept values"
        held = dataset.variables[dim]
        kind = KINDS.get(held.dtype.kind, "word")
        units = schema.shared.get(str(dim), held.attrs.get("units"))
        yield from _form_faults(dim, held, Variable((str(dim),), units, kind), ())
        yield from _value_faults(dim, held.values, Variable((str(dim),), units, kind))
        if len(set(held.values.tolist())) != held.size:
            yield f"variable {name} has a value twice; each may occur once"
    for label, units in schema.shared.items():
        if label in dataset.variables and label not in swept:
            held = dataset.variables[label]
            yield from _form_faults(label, held, Variable((), units), ())
            yield from _value_faults(label, held.values, Variable((), units))


def _form_faults(
    name: Hashable, held: xr.Variable, expected: Variable, lead: tuple[Hashable, ...]
) -> Iterator[str]:
    """Yield what is wrong with a variable's dimensions, type, units and sizes."""
    before = tuple(dim for dim in lead if dim not in expected.pooled) if expected.swept else ()
    dims = (*before, *expected.dims)
    if held.dims != dims:
        yield f"variable {_plain(name)} has dimensions {_listed(held.dims)}, not {_listed(dims)}"
    yield from _type_faults(name, held, expected.kind)
    units = held.attrs.get("units")
    if not isinstance(units, str | None) or FORMER_UNITS.get(str(units), units) != expected.units:
        yield f"variable {_plain(name)} has the units {shown(units)}, not {shown(expected.units)}"
    for dim, size in held.sizes.items():
        place = f"variable {_plain(name)} has {size} values along {_plain(dim)}"
        if size != SIZES.get(str(dim), size):
            yield f"{place}, not {SIZES[str(dim)]}"
        least = 1 if dim in before else LEAST_SIZES.get(str(dim), 0)
        if size < least:
            yield f"{place}, not at least {least}"


def _type_faults(name: Hashable, held: xr.Variable, kind: Kind) -> Iterator[str]:
    """Yield what is wrong with the type of a variable's values, and with how they were stored."""
    found = f"variable {_plain(name)} has values of type {_plain(held.dtype)}"
    if kind == "word":
        if not all(isinstance(word, str) for word in held.values.ravel().tolist()):
            yield f"{found}, not words"
        return
    if held.dtype != TYPES[kind]:
        yield f"{found}, not {TYPES[kind]}"
    # Values are stored as they are, and what is unknown as NaN: anything else was changed on the
    # way in.
    fill = np.asarray(held.encoding.get("_FillValue", held.encoding.get("missing_value", np.nan)))
    whole = fill.dtype.kind == "f" and bool(np.isnan(fill).all())
    if {"scale_factor", "add_offset"} & set(held.encoding) or not whole:
        yield f"variable {_plain(name)} is stored scaled or with gaps, not as it is"


def _value_faults(name: Hashable, values: NDArray[Any], expected: Variable) -> Iterator[str]:
    """Yield what is wrong with a variable's values one by one and in their order."""
    if expected.kind == "word":
        yield from _word_faults(name, values.ravel().tolist(), expected)
    if expected.kind in ("word", "flag"):
        return
    numbers = values.astype(np.float64)
    if not expected.unknown:
        yield from _first(name, values, np.isnan(numbers), "a number")
    if not expected.infinite:
        yield from _first(name, values, np.isinf(numbers), "finite")
    yield from _first(name, values, numbers < expected.least, f"at least {expected.least:g}")
    if expected.above > -np.inf:
        yield from _first(name, values, numbers <= expected.above, f"above {expected.above:g}")
    if expected.increasing:
        falls = np.append(False, np.diff(numbers) <= 0)
        yield from _first(name, values, falls, "above the value before it")


def _word_faults(name: Hashable, words: list[str], expected: Variable) -> Iterator[str]:
    """Yield what is wrong with words; a label has all of its own in order, others some of them."""
    if not expected.words:
        return
    if expected.units is None and tuple(words) != expected.words:
        yield f"variable {_plain(name)} is {shown(words)}, not {shown(list(expected.words))}"
    for word in words:
        if word not in expected.words:
            choices = " or ".join(map(repr, expected.words))
            yield f"variable {_plain(name)} has the word {shown(word)}, not {choices}"


def _gap_faults(name: str, dataset: xr.Dataset, expected: Variable) -> Iterator[str]:
    """Yield where a value is unknown although the dataset says that it is known."""
    if expected.known_where is None:
        return
    messages, beginning = expected.known_where
    words = dataset.variables[messages].values
    known = np.array([word.startswith(beginning) for word in words.ravel().tolist()], dtype=bool)
    values = dataset.variables[name].values
    wrong = np.isnan(values) & known.reshape(words.shape)
    yield from _first(name, values, wrong, f"a number where {messages} says {beginning!r}")


def _first(
    name: Hashable, values: NDArray[Any], wrong: NDArray[np.bool_], expected: str
) -> Iterator[str]:
    """Yield the first value that is wrong, with its place."""
    if not wrong.any():
        return
    place = tuple(int(index) for index in np.argwhere(wrong)[0])
    at = f"[{', '.join(map(str, place))}]" if place else ""
    yield f"variable {_plain(name)}{at} is {values[place]:g}, not {expected}"


def shown(value: object) -> str:
    """Return anything that a file may hold on one short line of plain text."""
    return "none" if value is None else _plain(repr(value))


def _plain(name: object) -> str:
    """Return a name as one short line of plain text."""
    return brief(Verbatim(" ".join(str(name).split())))


def _listed(dims: tuple[Hashable, ...]) -> str:
    """Return dimensions as an error shows them."""
    return f"({', '.join(map(_plain, dims[:6]))})"
