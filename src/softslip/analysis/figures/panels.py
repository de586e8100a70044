"""How the dimensions of a table are laid out: a family of curves, and rows of panels.

A figure knows the dimensions that it draws along; of all others one becomes the family, which has
a colour and a marker for each value, and the rest become rows of panels.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softslip.analysis.comparable import unlike
from softslip.analysis.figures.drawing import COLOURS, MARKERS, named, note, sequence, symbol

LARGEST, SHRINK, LEAST = 7.0, 0.93, 5.5
"""Size of the first marker [point], by how much each next is smaller, and the least: points that
coincide, as the bulk's do, stay visible, and a half filled one differs from a filled one in print.
"""

MOST_ROWS = 40
"""Most rows of panels, so that the picture stays within what can be drawn."""

ROUGHNESS = "roughness"
"""Dimension that is the family where it has several values."""


@dataclass(frozen=True)
class Family:
    """The dimension whose values have a colour and a marker each.

    Attributes
    ----------
    dim, values
        Its name, and its values.
    missing
        Numbers of the values of which no run is done. The others have the same colours and markers
        as when all are.
    """

    dim: str
    values: tuple[Any, ...]
    missing: frozenset[int] = frozenset()

    @classmethod
    def along(cls, table: xr.Dataset, dim: str) -> "Family":
        """Return the family of a dimension of a table with ``status``."""
        missing = without_runs(table["status"], dim)
        return cls(dim, tuple(table[dim].values.tolist()), frozenset(missing))

    def members(self, cell: xr.Dataset) -> Iterator[tuple[int, str, xr.Dataset]]:
        """Yield number, label and data of each member that is not missing."""
        for number, value in enumerate(self.values):
            if number not in self.missing:
                yield number, named(self.dim, value), cell.isel({self.dim: number})

    def laws_of(self, fits: xr.Dataset, number: int) -> xr.Dataset:
        """Return the fits of a member; those that are pooled over the family belong to each."""
        return fits.isel({self.dim: number}) if self.dim in fits.dims else fits

    def colour(self, number: int) -> Any:
        """Return the colour of a member: of a palette, or of a scale where there are many."""
        if len(self.values) > len(COLOURS):
            return sequence(len(self.values))[number]
        return COLOURS[number]

    def look(self, number: int) -> dict[str, Any]:
        """Return colour, marker and size of a member, as matplotlib calls them."""
        return {
            "color": self.colour(number),
            "marker": MARKERS[number % len(MARKERS)],
            "markersize": max(LARGEST * SHRINK**number, LEAST),
        }


def without_runs(status: xr.DataArray, dim: str) -> list[int]:
    """Return the numbers of the values of a dimension of which no run is done."""
    done = (status == "done").any([each for each in status.dims if each != dim])
    return [int(number) for number in np.flatnonzero(~done.values)]


def with_dimensions(dataset: xr.Dataset, *dims: str) -> xr.Dataset:
    """Give a dataset the dimensions that it lacks, of length one."""
    for dim in dims:
        if dim not in dataset.dims:
            known = dataset if dim in dataset.coords else dataset.assign_coords({dim: np.nan})
            dataset = known.expand_dims(dim)
    return dataset


def family_of(table: xr.Dataset, *along: str) -> Family:
    """Return which dimension is the family.

    It is the roughness, or where that has one value, the first other dimension that has several.

    Parameters
    ----------
    table
        Averages over seeds, with a dimension ``roughness``.
    along
        Dimensions that are drawn along.
    """
    dims = [str(dim) for dim in table["status"].dims if dim not in (*along, "seed")]
    several = [dim for dim in dims if table.sizes[dim] > 1]
    chosen = ROUGHNESS if not several or ROUGHNESS in several else several[0]
    return Family.along(table, chosen)


def facets(dataset: xr.Dataset, *known: str) -> list[tuple[str, dict[str, Any]]]:
    """List the combinations of all other dimensions that ``status`` has.

    Returns
    -------
    list of (str, dict)
        For each combination its title and what `Dataset.sel` selects it with; one with no title
        where there are no other dimensions. At most `MOST_ROWS`.
    """
    dims = [str(dim) for dim in dataset["status"].dims if dim not in (*known, "seed")]
    values = [dataset[dim].values.tolist() for dim in dims]
    every = (
        (
            ", ".join(filter(None, map(named, dims, each))),
            dict(zip(dims, each, strict=True)),
        )
        for each in itertools.product(*values)
    )
    return list(itertools.islice(every, MOST_ROWS))


def selected(cell: xr.Dataset, chosen: dict[str, Any]) -> xr.Dataset:
    """Select a combination of values in a dataset that may lack some of the dimensions."""
    return cell.sel({dim: value for dim, value in chosen.items() if dim in cell.dims})


def note_missing(figure: Figure, dataset: xr.Dataset, *more: str, known: tuple[str, ...]) -> None:
    """Say below a figure how many runs are missing, and whatever else needs saying.

    Parameters
    ----------
    figure
        Where to say it.
    dataset
        With ``status``.
    more
        Sentences; empty ones are left out.
    known
        Dimensions that do not become rows of panels.
    """
    status = dataset["status"]
    missing = int((status != "done").sum())
    notes = [f"{missing} of {status.size} runs missing{_where(status)}"] if missing else []
    sizes = [size for dim, size in status.sizes.items() if dim not in (*known, "seed")]
    rows = int(np.prod(sizes, dtype=int))
    if rows > MOST_ROWS:
        notes.append(f"{MOST_ROWS} of {rows} rows of panels shown")
    note(figure, *notes, *more)


def _where(status: xr.DataArray) -> str:
    """Name the values of which no run is done at all."""
    absent = [
        named(str(dim), status[dim].values.tolist()[number])
        for dim in status.dims
        if status.sizes[dim] > 1
        for number in without_runs(status, str(dim))
    ]
    return f", among them all at {', '.join(absent[:4])}" if absent else ""


def legend_above(figure: Figure, axes: Axes, most: int = 8) -> None:
    """Put what a panel's symbols mean above all panels, each label once."""
    handles, labels = axes.get_legend_handles_labels()
    if labels:
        columns = columns_for(len(labels), most)
        figure.legend(handles, labels, loc="outside upper center", ncols=columns)


def columns_for(count: int, most: int) -> int:
    """Return the columns of a legend, at most so many, in which its rows are as long as can be."""
    rows = -(-count // most)
    return -(-count // rows)


def share_limits(panels: Sequence[Axes]) -> None:
    """Give panels that show the same the same limits, as far as they show anything."""
    # What `leave_empty` has emptied has no ticks.
    full = [panel for panel in panels if panel.has_data() and len(panel.get_xticks())]
    if full:
        across = np.array([panel.get_xlim() for panel in full])
        up = np.array([panel.get_ylim() for panel in full])
        for panel in full:
            panel.set_xlim(across[:, 0].min(), across[:, 1].max())
            panel.set_ylim(up[:, 0].min(), up[:, 1].max())


def is_comparable(cell: xr.Dataset, family: Family) -> bool:
    """Return whether any member of a family is of the paper's material."""
    return any(not unlike(cell, {family.dim: value}) for value in family.values)


def leave_empty(axes: Axes, reason: str, height: float = 0.5) -> None:
    """Say in a panel, in the middle or at another share of its height, why nothing is drawn."""
    axes.set(xticks=[], yticks=[])
    axes.minorticks_off()
    axes.text(
        0.5,
        height,
        reason,
        transform=axes.transAxes,
        ha="center",
        va="center",
        fontsize=8,
        color="0.35",
        wrap=True,
    )


def above(title: str, label: str) -> str:
    """Return the label of an axis with the title of its row above it."""
    return f"{title}\n{label}" if title else label


def of_all(dim: str) -> str:
    """Return words for all values of a dimension, as in a title."""
    return f"all {symbol(dim)}"
