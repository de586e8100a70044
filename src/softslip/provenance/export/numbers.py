"""The numbers of a figure, a dataset or one variable, as a table."""

import os
import tempfile
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

from softslip.analysis import figures
from softslip.analysis.figures.shown import Quantity, Series, coordinates, quantity, shown
from softslip.config.stages import STAGES
from softslip.errors import DatasetError
from softslip.files.layout import DATASET, PAGE
from softslip.files.products import FIGURES
from softslip.files.stamps import FORMATS, MOVING, check_figure, read_labels
from softslip.files.storage import CONTENT_DIGEST, read_dataset
from softslip.messages import file_text, printable
from softslip.provenance.archive import REPLACED, UNREADABLE, Archive
from softslip.provenance.export.csv_file import Table
from softslip.provenance.product_labels import PASSING, Parent, read_product

SINGLE = "single values"
"""Series of a dataset's variables without dimensions."""


def dataset_table(path: Path, variable: str | None = None) -> Table:
    """Return the numbers of a dataset: variables of the same dimensions are a series.

    Parameters
    ----------
    path
        Of the dataset.
    variable
        If given, only this variable, with its error where it has one.

    Raises
    ------
    DatasetError
        When the file is missing, damaged, or has no such variable.
    """
    product = read_product(path)
    dataset = read_dataset(path, stage=product.stage, run=product.run)
    if variable is not None:
        dataset = dataset[_with_error(dataset, variable, path)]
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, each in dataset.data_vars.items():
        groups.setdefault(tuple(map(str, each.dims)), []).append(str(name))
    for name in dataset.coords if not groups else ():
        groups.setdefault(tuple(map(str, dataset[name].dims)), []).append(str(name))
    series = tuple(
        _group(dataset, dims, names, several=len(groups) > 1) for dims, names in groups.items()
    )
    what = f"{variable} of " if variable else ""
    title = f"{what}{product.label}"
    return Table(title, (f"content_sha256 {product.content}",), series)


def _with_error(dataset: xr.Dataset, variable: str, path: Path) -> list[str]:
    """Return the names of a variable and its error."""
    names = list(map(str, dataset.variables))
    if variable not in names:
        near = get_close_matches(variable, names, n=3)
        choice = f"did you mean {', '.join(near)}?" if near else f"it has {', '.join(names)}"
        raise DatasetError(f"{file_text(path)}: has no variable {printable(variable)!r}; {choice}")
    error = f"{variable}_error"
    both = [variable, error]
    alike = error in names and dataset[error].dims == dataset[variable].dims
    return both if alike else [variable]


def _group(
    dataset: xr.Dataset, dims: tuple[str, ...], names: Sequence[str], *, several: bool
) -> Series:
    """Return the variables that have some dimensions, with their coordinates."""
    first = dataset[names[0]]
    points = {
        dim: _dimension(dataset, dim, values.ravel()) for dim, values in coordinates(first).items()
    }
    at: dict[str, Quantity] = {}
    for name, each in dataset.coords.items():
        if each.ndim and str(name) not in points and set(each.dims) <= set(dims):
            spread = each.broadcast_like(first).transpose(*dims)
            points[str(name)] = quantity(each, spread.values.ravel())
        elif not each.ndim:
            at[str(name)] = quantity(each, each.item())
    points |= {name: quantity(dataset[name], dataset[name].values.ravel()) for name in names}
    return Series("", (" ".join(dims) or SINGLE) if several else "", points, at)


def _dimension(dataset: xr.Dataset, dim: str, values: Any) -> Quantity:
    if dim in dataset.coords:
        return quantity(dataset[dim], values)
    return Quantity(values, "1", f"number of the {dim.replace('_', ' ')}, from 0")


def figure_table(path: Path, results: Path | None = None) -> tuple[Table, tuple[str, ...]]:
    """Return the numbers that a figure shows, and what is to be said of them.

    The figure is redrawn from its datasets, which are found by the digests that it carries.

    Parameters
    ----------
    path
        Of the figure.
    results
        Folder of its datasets; by default the figure's own, that around ``figures``, and that of
        its scenario.

    Returns
    -------
    tuple of Table and tuple of str
        The second has a sentence if the figure, redrawn, does not look the same.

    Raises
    ------
    DatasetError
        When the file is no figure of ours, has been altered, shows no numbers, or one of its
        datasets is missing, damaged or another one by now.
    """
    labels = check_figure(path)
    name, product = str(labels.get("title")), read_product(path)
    if name not in FIGURES:
        raise DatasetError(
            f"{file_text(path)}: is a figure {printable(name)!r}, which shows no numbers; figures "
            f"that do are {', '.join(FIGURES)}"
        )
    datasets = [_found(path, parent, results) for parent in product.parents]
    drawn = figures.draw(name, *datasets)
    sources = (
        f"figure with content_sha256 {product.content}",
        *(
            f"drawn from {parent.stage} {parent.run} with content_sha256 {parent.content}"
            for parent in product.parents
        ),
    )
    still = drawn.figure if isinstance(drawn, figures.Movie) else drawn
    table = Table(f"{name} of {product.run}", sources, shown(still))
    return table, _changes(path, labels, drawn)


def _found(figure: Path, parent: Parent, results: Path | None) -> xr.Dataset:
    """Return a dataset that a figure was drawn from."""
    folders = _folders(figure, parent) if results is None else [results]
    places = [Archive(folder).locate(parent) for folder in folders]
    product = next((each.product for each in places if each.product is not None), None)
    if product is None:
        closed = next((each.problem for each in places if each.state == UNREADABLE), None)
        if closed is not None:
            raise DatasetError(f"{closed}; {file_text(figure)} was drawn from it")
        newer = next((each.path for each in places if each.state == REPLACED), None)
        there = f" ({file_text(newer)} is another version: redraw the figure)" if newer else ""
        raise DatasetError(
            f"{file_text(figure)}: was drawn from {printable(parent.stage)} "
            f"{printable(parent.run)} with {CONTENT_DIGEST} {printable(parent.content)[:16]}..., "
            f"which is not below {', '.join(map(file_text, folders))}{there}; give the folder of "
            "its results with --results"
        )
    return read_dataset(product.path, stage=parent.stage, run=parent.run)


def _folders(figure: Path, parent: Parent) -> list[Path]:
    """Return where a figure's datasets may be, the likeliest first."""
    folder = figure.parent
    around = next((each.parent for each in figure.parents if each.name == "figures"), None)
    own = [folder] if around is None else [around, folder]
    return list(dict.fromkeys([*own, *_named_results(parent)]))


def _named_results(parent: Parent) -> list[Path]:
    """Return the usual folder of a scenario's results, if there is one below the current folder."""
    usual = Path("results") / Path(parent.run).name
    return [usual] if usual.is_dir() else []


def _changes(
    path: Path, labels: Mapping[str, Any], drawn: Figure | figures.Movie
) -> tuple[str, ...]:
    """Say so if a figure looks different when it is redrawn."""
    lasting = {key: value for key, value in labels.items() if key not in PASSING}
    with tempfile.TemporaryDirectory() as folder:
        moves = isinstance(drawn, figures.Movie)
        redrawn = Path(folder) / f"redrawn{MOVING if moves else '.png'}"
        figures.save_figure(drawn, redrawn, lasting)
        same = read_labels(redrawn)[CONTENT_DIGEST] == labels[CONTENT_DIGEST]
    if same:
        return ()
    return (
        f"{file_text(path)}: looks different when it is redrawn, by other code or software "
        "than before; the numbers are those of now",
    )


def target_table(target: str, results: Path | None = None) -> tuple[Table, tuple[str, ...]]:
    """Return the numbers of a figure, a dataset, or one variable of it.

    Parameters
    ----------
    target
        A figure's file, a dataset's, or a dataset's with a colon and the name of a variable.
    results
        See `figure_table`.

    Raises
    ------
    DatasetError
        When it is none of these, or cannot be read.
    """
    path, variable = Path(target), None
    if not os.path.exists(path) and f"{DATASET}:" in target:
        before, _, variable = target.rpartition(":")
        path = Path(before)
    if path.suffix == PAGE:
        datasets = [f"{parent.stage}{DATASET}" for parent in read_product(path).parents]
        shown_in_full = (name for name in datasets if name.removesuffix(DATASET) not in STAGES)
        raise DatasetError(
            f"{file_text(path)}: shows numbers of several datasets; export these instead: "
            f"{', '.join(file_text(path.parent / name) for name in shown_in_full)}"
        )
    if path.suffix in FORMATS and variable is None:
        return figure_table(path, results)
    return dataset_table(path, variable), ()
