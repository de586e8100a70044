"""What people point at: a file of results, or values in a dataset by their coordinates."""

import math
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from softslip.errors import ConfigError, DatasetError
from softslip.files.layout import DATASET
from softslip.files.stamps import LABELLED
from softslip.files.storage import read_dataset
from softslip.messages import brief, enumerated, file_text
from softslip.provenance.product_labels import Product, read_product
from softslip.provenance.tracing.wording import shown, with_error

SAME_NUMBER = 5e-6
"""Largest relative difference of a number from the coordinate that it names: that of six digits,
which is what people are shown (``%g``) and then copy. Whole numbers, such as seeds, have none."""

MOST_NAMES = 40
"""Most names or values that an error message lists."""

_ENDINGS = "|".join(re.escape(ending) for ending in (DATASET, *LABELLED))
_WRITTEN = re.compile(rf"(?P<path>.+?(?:{_ENDINGS}))(?::(?P<rest>.+))?", re.DOTALL)
_VARIABLE = re.compile(r"(?P<name>[^\[\]=,]+)(?:\[(?P<at>[^\[\]]*)\])?")
_EXAMPLE = "results/demo/fits.nc:yield_stress[roughness=0]"


@dataclass(frozen=True)
class Target:
    """A file of results, or a variable in a dataset at some coordinates.

    Attributes
    ----------
    path
        The file.
    variable
        Empty where the whole file is meant.
    at
        Coordinates as they were written.
    """

    path: Path
    variable: str = ""
    at: Mapping[str, str] = field(default_factory=dict)

    def __str__(self) -> str:
        """Return it as people write it."""
        at = ",".join(f"{name}={value}" for name, value in self.at.items())
        return f"{self.path}{f':{self.variable}' if self.variable else ''}{f'[{at}]' if at else ''}"


def read_target(text: str) -> Target:
    """Read a target such as ``fits.nc:yield_stress[roughness=0]``.

    Raises
    ------
    ConfigError
        When it cannot be read.
    """
    if os.path.isfile(text):
        return Target(Path(text))
    written = _WRITTEN.fullmatch(text)
    rest = written and written["rest"]
    variable = _VARIABLE.fullmatch(rest) if rest else None
    if written is None or (rest and (variable is None or not written["path"].endswith(DATASET))):
        raise ConfigError(
            "target",
            brief(text),
            "is no figure, dataset or value in a dataset",
            f"write it such as {_EXAMPLE}",
        )
    path = Path(written["path"])
    if variable is None:
        return Target(path)
    return Target(path, variable["name"].strip(), _coordinates(variable["at"] or ""))


def _coordinates(text: str) -> dict[str, str]:
    """Return the coordinates between the brackets of a target."""
    found: dict[str, str] = {}
    for part in filter(None, (each.strip() for each in text.split(","))):
        name, equals, value = (each.strip() for each in part.partition("="))
        if not (name and equals and value):
            limit, remedy = "is no coordinate with its value", f"write it such as {_EXAMPLE}"
            raise ConfigError("target", brief(part), limit, remedy)
        if name in found:
            raise ConfigError("target", brief(part), "is given twice", "name each coordinate once")
        found[name] = value
    return found


@dataclass(frozen=True)
class Values:
    """Numbers, flags or words of a variable in a dataset.

    Attributes
    ----------
    product
        The dataset's file by its labels.
    dataset
        All that it holds.
    variable
        Name of the variable.
    places
        Index along each dimension along which one was chosen.
    asked
        Where it was looked for; another dataset than `product` where that is made from it.
    """

    product: Product
    dataset: xr.Dataset
    variable: str
    places: Mapping[str, int]
    asked: Path

    @property
    def data(self) -> xr.DataArray:
        """The variable at the chosen places."""
        return self.dataset[self.variable].isel(dict(self.places))

    @property
    def units(self) -> str:
        """Its unit, empty for a pure number."""
        units = str(self.data.attrs.get("units", ""))
        return "" if units == "1" else units

    @property
    def meaning(self) -> str:
        """What it is, in words."""
        return str(self.data.attrs.get("long_name", self.variable.replace("_", " ")))

    @property
    def name(self) -> str:
        """The variable and its coordinates, as in a target."""
        at = ",".join(f"{dim}={shown(value)}" for dim, value in self.coordinates.items())
        return f"{self.variable}[{at}]" if at else self.variable

    @property
    def coordinates(self) -> dict[str, Any]:
        """Values of the chosen coordinates."""
        return {dim: value_at(self.dataset, dim, place) for dim, place in self.places.items()}

    def cells(self) -> Iterator[tuple[dict[str, Any], Any, Any]]:
        """Yield the coordinates of each value, the value and its error, None where unknown."""
        data, key = self.data, f"{self.variable}_error"
        known = key in self.dataset and self.dataset[key].dims == self.dataset[self.variable].dims
        error = self.dataset[key].isel(dict(self.places)) if known else None
        for place in np.ndindex(data.shape):
            at = {
                str(dim): value_at(self.dataset, str(dim), number)
                for dim, number in zip(data.dims, place, strict=True)
            }
            spread = None if error is None else plain(error.values[place])
            yield {**self.coordinates, **at}, plain(data.values[place]), spread


def measured(values: Values) -> str:
    """Return a value with its error and unit, or the range and number of several."""
    cells = list(values.cells())
    if len(cells) == 1:
        ((_, value, error),) = cells
        return with_error(value, error) + f" {values.units}" * bool(
            values.units and value is not None
        )
    known = [value for _, value, _ in cells if value is not None]
    unknown = len(cells) - len(known)
    tail = f", {unknown} unknown" if unknown else ""
    if not known or isinstance(known[0], bool | str):
        counts = Counter(map(with_error, known))
        summary = ", ".join(f"{count} {word}" for word, count in sorted(counts.items()))
        return f"{len(cells)} values: {summary or 'none known'}"
    return (
        f"{len(cells)} values from {min(known):g} to {max(known):g} {values.units}".strip() + tail
    )


def plain(value: Any) -> Any:
    """Return a number, flag or word as JSON has it, None for a number that is not finite."""
    value = value.item() if isinstance(value, np.generic | np.ndarray) else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def value_at(dataset: xr.Dataset, dim: str, place: int) -> Any:
    """Return the value of a coordinate, the place itself where a dimension has no values."""
    return plain(dataset[dim].values[place]) if dim in dataset.coords else place


def find_values(target: Target) -> Values:
    """Read the values that a target names.

    A variable that its dataset lacks is looked for in the datasets beside it that say that they
    were made from it: people name a yield stress after the flow curve that it was fitted to.

    Raises
    ------
    ConfigError
        When there is no such variable or coordinate, in a sentence that says which there are.
    DatasetError
        When a file is missing or damaged.
    """
    product = read_product(target.path)
    dataset = read_dataset(target.path, stage=product.stage, run=product.run)
    if target.variable not in dataset.variables:
        product, dataset = _made_from(product, target, dataset)
    places = {
        dim: place
        for name, text in target.at.items()
        for dim, place in _chosen(dataset, target.variable, name, text)
    }
    return Values(product, dataset, target.variable, places, target.path)


def _made_from(product: Product, target: Target, dataset: xr.Dataset) -> tuple[Product, xr.Dataset]:
    """Return the one dataset beside another that is made from it and has a variable."""
    known = set(map(str, dataset.data_vars))
    found: list[tuple[Product, xr.Dataset]] = []
    for path in sorted(target.path.parent.glob(f"*{DATASET}")):
        try:
            other = read_product(path)
        except DatasetError:
            continue
        if product.content in {parent.content for parent in other.parents}:
            held = read_dataset(path, stage=other.stage, run=other.run)
            known |= set(map(str, held.data_vars))
            if target.variable in held.variables:
                found.append((other, held))
    if len(found) == 1:
        return found[0]
    name, key = file_text(target.path), brief(target.variable)
    if found:
        several = ", ".join(str(each.path.name) for each, _ in found)
        limit = f"is not in {name}, but in several datasets made from it: {several}"
        raise ConfigError("variable", key, limit, "name one of these files")
    limit = f"is neither in {name} nor in a dataset beside it that was made from it"
    # Names like it first: a table of fits has more of them than a sentence.
    near = get_close_matches(target.variable, sorted(known), n=3)
    names = [*near, *sorted(known - set(near))]
    raise ConfigError("variable", key, limit, f"use one of {enumerated(names, MOST_NAMES)}")


def _chosen(dataset: xr.Dataset, variable: str, name: str, text: str) -> Iterator[tuple[str, int]]:
    """Yield the dimension and place of a coordinate; nothing where all runs share its value."""
    dims = [str(dim) for dim in dataset[variable].dims]
    shared = {str(key) for key, each in dataset.coords.items() if not each.dims}
    if name not in dims and name not in shared:
        limit = f"names a coordinate that {variable} does not have"
        known = [*dims, *sorted(shared)]
        remedy = f"it has {', '.join(known)}" if known else "it has none; leave out the brackets"
        raise ConfigError("target", brief(f"{name}={text}"), limit, remedy)
    if name in dims and name not in dataset.coords:
        values: list[Any] = list(range(dataset.sizes[name]))
    else:
        values = dataset[name].values.ravel().tolist()
    place = _nearest(values, text)
    if place is None:
        limit = f"is not among the values of {name}"
        remedy = f"it has {enumerated([shown(value) for value in values], MOST_NAMES)}"
        raise ConfigError("target", brief(f"{name}={text}"), limit, remedy)
    if name in dims:
        yield name, place


def _nearest(values: list[Any], text: str) -> int | None:
    """Return the place of the value that a text means, see `SAME_NUMBER`; None for no such."""
    words = [str(value) for value in values]
    if text in words:
        return words.index(text)
    try:
        number = float(text)
    except ValueError:
        return None
    best: tuple[float, int] | None = None
    for place, value in enumerate(values):
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue
        allowed = SAME_NUMBER * abs(value) if isinstance(value, float) else 0.0
        away = abs(number - value)
        if away <= allowed and (best is None or away < best[0]):
            best = away, place
    return None if best is None else best[1]
