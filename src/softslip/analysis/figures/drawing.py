"""What all figures share: style, colours, panels, labels, and how they are saved."""

import functools
import io
import itertools
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import softslip
from softslip.errors import DatasetError
from softslip.files.stamps import FORMATS, content_digest, sealed, unsealed, with_text
from softslip.files.storage import CONTENT_DIGEST, replacing

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that the colour-blind can tell apart (Okabe and Ito 2008)."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "p")
"""One marker for each roughness."""

LINES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1.5, 1, 1.5)), (0, (9, 2)))
"""One line style for each roughness."""

WIDE, NARROW = 7.0, 3.4
"""Widths of two columns and of one [inch]."""

SYMBOLS = {
    "stress": r"$\sigma$",
    "imposed_shear_rate": r"$\dot\gamma_\mathrm{wall}$",
    "roughness": r"$\beta$",
    "wall_separation": r"$H$",
    "area_fraction": r"$\phi$",
}
"""How a dimension is written in a legend; others by their own name."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@contextmanager
def house_style() -> Iterator[None]:
    """Use the house style and nothing of the user's own settings, and put those back after."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        with resources.as_file(resources.files(__package__) / "style.mplstyle") as path:
            matplotlib.rc_file(path, use_default_template=False)
        yield


def styled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Make a function draw in the house style."""

    @functools.wraps(function)
    def wrapped(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        with house_style():
            return function(*args, **kwargs)

    return wrapped


def sequence(count: int) -> list[Any]:
    """Return colours for ordered values, dark for the largest, shape (count,)."""
    colours = matplotlib.colormaps["viridis_r"]
    return [colours(0.12 + 0.84 * place) for place in (np.arange(count) + 0.5) / max(count, 1)]


def named(label: str, value: Any) -> str:
    """Return a dimension's symbol and value for a legend or title; nothing if it has no value."""
    if isinstance(value, float | np.floating) and not np.isfinite(value):
        return ""
    text = f"{value:.3g}" if isinstance(value, float | np.floating) else str(value)
    return f"{SYMBOLS.get(label, label.replace('_', ' '))} = {text}"


def with_dimensions(dataset: xr.Dataset, *dims: str) -> xr.Dataset:
    """Give a dataset the dimensions that it lacks, of length one."""
    for dim in dims:
        if dim not in dataset.dims:
            known = dataset if dim in dataset.coords else dataset.assign_coords({dim: np.nan})
            dataset = known.expand_dims(dim)
    return dataset


def facets(dataset: xr.Dataset, *known: str) -> list[tuple[str, dict[str, Any]]]:
    """List the combinations of all other dimensions that ``status`` has.

    Returns
    -------
    list of (str, dict)
        For each combination its title and what `Dataset.sel` selects it with; one with no title
        where there are no other dimensions.
    """
    dims = [str(dim) for dim in dataset["status"].dims if dim not in (*known, "seed")]
    values = [dataset[dim].values.tolist() for dim in dims]
    return [
        (
            ", ".join(named(dim, value) for dim, value in zip(dims, each, strict=True)),
            dict(zip(dims, each, strict=True)),
        )
        for each in itertools.product(*values)
    ]


def grid_of_panels(
    rows: int, columns: int, *, width: float, height: float
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of equal panels, ``height`` inches for each row."""
    figure = Figure(figsize=(width, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, [list(row) for row in axes]


def note_missing(figure: Figure, dataset: xr.Dataset, *more: str) -> None:
    """Say below a figure how many runs are missing, and whatever else needs saying."""
    total = dataset["status"].size
    missing = int((dataset["status"] != "done").sum())
    notes = [f"{missing} of {total} runs missing"] if missing else []
    note(figure, *notes, *more)


def note(figure: Figure, *lines: str) -> None:
    """Write small lines below a figure."""
    said = [line for line in lines if line]
    if said:
        figure.supxlabel("; ".join(said), x=0.01, ha="left", fontsize=7.5, color="0.35")


def save_figure(
    figure: Figure,
    path: Path,
    labels: Mapping[str, Any],
    provenance: Mapping[str, Any] | None = None,
) -> None:
    """Save a figure under its final name in one step, with what it was made from inside it.

    The same figure with the same labels gives the same bytes: no time of writing is kept.

    Parameters
    ----------
    figure
        What to save.
    path
        Final name; its suffix (.png, .svg or .pdf) is the format.
    labels
        What JSON can hold, such as the scenario and the parents; kept as sorted JSON in the field
        Description (PNG, SVG) or Subject (PDF), with the digests of `files.stamps`. "title"
        also becomes the file's title.
    provenance
        What differs between two drawings of the same thing; kept among the labels.

    Raises
    ------
    DatasetError
        When the suffix is none of these.
    """
    if path.suffix not in FORMATS:
        raise DatasetError(
            f"{path}: cannot save a figure as {path.suffix!r}; use one of {', '.join(FORMATS)}"
        )
    with house_style():
        program = f"softslip {softslip.__version__}"
        picture = _rendered(figure, ".png", {"Software": program})
        passing = {} if provenance is None else {"provenance": dict(provenance)}
        told = unsealed({**labels, **passing, CONTENT_DIGEST: content_digest(picture, labels)})
        title = str(labels.get("title", "softslip"))
        if path.suffix == ".png":
            # Drawn again, the layout could differ by a rounding from that of the digest.
            content = with_text(picture, {"Title": title, "Description": told})
        else:
            content = _rendered(figure, path.suffix, _fields(path.suffix, title, told, program))
    with replacing(path) as temporary:
        temporary.write_bytes(sealed(content))


def _rendered(figure: Figure, suffix: str, fields: Mapping[str, Any]) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=suffix.removeprefix("."), metadata=dict(fields))
    return buffer.getvalue()


def _fields(suffix: str, title: str, told: str, program: str) -> dict[str, Any]:
    """Return the fields of a format that hold a title, labels and the program."""
    common = {"Title": title, "Creator": program}
    if suffix == ".svg":
        return common | {"Description": told, "Date": None}
    return common | {"Subject": told, "CreationDate": None}
