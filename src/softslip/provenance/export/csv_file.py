"""Tables of numbers with their units, and the CSV files that they are written to."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from softslip.analysis.figures.shown import Quantity, Series
from softslip.files.storage import replacing
from softslip.messages import printable

PANEL, SERIES = "panel", "series"
"""Columns that say where in a figure a point is."""

_WHERE = {
    PANEL: Quantity((), meaning="part of the figure"),
    SERIES: Quantity((), meaning="line, set of points or group of variables"),
}


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name, unit, meaning
        See `analysis.figures.shown.Quantity`; the name is the only one in its table.
    """

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Table:
    """What is written to a file.

    Attributes
    ----------
    title
        One line.
    sources
        A line for each thing that it was made from.
    series
        The rows, in groups that share their columns.
    """

    title: str
    sources: tuple[str, ...]
    series: tuple[Series, ...]

    @property
    def columns(self) -> tuple[Column, ...]:
        """Its columns: where points are, then what they have in common, then the rest."""
        return tuple(self._named.values())

    @property
    def _named(self) -> dict[tuple[str, str], Column]:
        """The columns by the name and unit that series have for them."""
        found: dict[tuple[str, str], Column] = {}
        taken: set[str] = set()
        for name, each in self._quantities():
            key = name, each.unit
            known = found.get(key)
            if known is None:
                free = name
                while free in taken:
                    free = f"{free}_other"
                taken.add(free)
                found[key] = Column(free, each.unit, each.meaning)
            elif not known.meaning:
                found[key] = Column(known.name, known.unit, each.meaning)
        return found

    def _quantities(self) -> Iterator[tuple[str, Quantity]]:
        for name, text in ((PANEL, "panel"), (SERIES, "name")):
            if any(getattr(one, text) for one in self.series):
                yield name, _WHERE[name]
        for one in self.series:
            yield from one.at.items()
        for one in self.series:
            yield from one.points.items()

    def rows(self) -> Iterator[Sequence[str]]:
        """Yield the cells of each row, as text."""
        named = self._named
        for one in self.series:
            size = len(next(iter(one.points.values())).values)
            filled = {(PANEL, "1"): [one.panel] * size, (SERIES, "1"): [one.name] * size}
            for name, each in one.at.items():
                filled[name, each.unit] = cells(np.array([each.values], dtype=object)) * size
            for name, each in one.points.items():
                filled[name, each.unit] = cells(np.asarray(each.values))
            nothing = [""] * size
            yield from zip(*(filled.get(key, nothing) for key in named), strict=True)


def cells(values: np.ndarray[Any, np.dtype[Any]]) -> list[str]:
    """Return values as text that reads back as the same."""
    return [_cell(value) for value in values.tolist()]


def _cell(value: Any) -> str:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return "" if value != value else repr(value)
    return "" if value is None else str(value)


def write_csv(table: Table, file: TextIO) -> int:
    """Write a table; return the number of its rows.

    Parameters
    ----------
    table
        What to write.
    file
        Open for text whose line ends are left as they are.
    """
    head = [table.title, *table.sources]
    columns = table.columns
    explained = [
        f"{each.name} [{each.unit}]" + f": {each.meaning}" * bool(each.meaning) for each in columns
    ]
    head.append(f"names of the columns in line {len(head) + len(explained) + 2}, units here:")
    for line in (*head, *explained):
        file.write(f"# {printable(' '.join(line.split()))}\n")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([each.name for each in columns])
    count = 0
    for row in table.rows():
        writer.writerow(row)
        count += 1
    return count


def save_csv(table: Table, path: Path) -> int:
    """Write a table under its final name in one step; return the number of its rows.

    Raises
    ------
    StorageError
        When it cannot be written.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        return write_csv(table, file)
