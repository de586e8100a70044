"""The page: numbers of all runs, their snapshots, and the program that shows them, in one file.

Nothing is loaded from anywhere else, which a rule within the page forbids the browser as well.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import plotly
import xarray as xr
from plotly.offline import get_plotlyjs

import softslip
from softslip.analysis.explorer.embedding import embedded
from softslip.analysis.explorer.outlines import outlines
from softslip.analysis.explorer.sweep_axes import shared_values, sweep_axes, usual_colours
from softslip.analysis.explorer.thinning import thinned
from softslip.analysis.figures.markers import MEANINGS, verdicts
from softslip.analysis.observables.tables import DONE
from softslip.files.quantities import dataset_quantity
from softslip.files.stamps import labelled_page, page_digest, sealed, unsealed
from softslip.files.storage import CONTENT_DIGEST, replacing

LIMIT = 9_800_000
"""Size of a page up to which it takes up snapshots [byte]."""

LABELS_ROOM = 1_200
"""Room that is left for what a page says of the origin of a run [byte]."""

PROGRAM = ("numbers.js", "verdict_markers.js", "selection.js", "panels.js", "run_details.js")
"""Parts of the page's program, in the order in which they build on each other."""

FLAGS = {
    "shear_rate_wall": "steady_wall",
    "shear_rate_bulk": "steady_bulk",
    "slip_velocity": "steady_slip",
}
"""What is drawn as points, and the flag of its steady state."""

RATES = ("shear_rate_wall", "shear_rate_bulk")
"""What is drawn along time."""


def explorer_page(
    flow_curve: xr.Dataset, creep: xr.Dataset, profiles: xr.Dataset, runs: Iterable[xr.Dataset]
) -> bytes:
    """Return a page for the browser that shows all finished runs of a scenario.

    Flow curve, slip velocity, creep and profiles of the runs, to be filtered by whatever was swept;
    of each run its numbers, its last snapshot and where it comes from. Numbers are those of the
    datasets to the last digit. Curves of very many runs go through fewer points.

    Parameters
    ----------
    flow_curve, creep, profiles
        From `analysis.observables`, of the same runs.
    runs
        The finished runs, one after the other as they are needed. Their snapshots are taken up in
        this order for as long as there is room.

    Returns
    -------
    bytes
        HTML with an empty element for labels, see `save_page`.
    """
    data = {
        "scenario": str(flow_curve.attrs["run"]),
        "verdicts": MEANINGS,
        **_points(flow_curve),
        "curves": {
            **_curves(creep, "time", RATES, logarithmic=True),
            **_curves(profiles, "normalised_position", ("normalised_velocity",)),
        },
    }
    around = len(_page(data))
    room = LIMIT - around - LABELS_ROOM * len(data["runs"])
    return _page({**data, **_snapshots(runs, room)})


def save_page(
    page: bytes, path: Path, labels: Mapping[str, Any], provenance: Mapping[str, Any] | None = None
) -> None:
    """Save a page under its final name in one step, with what it was made from inside it.

    Parameters
    ----------
    page
        See `explorer_page`.
    path
        Final name.
    labels, provenance
        See `analysis.figures.saving.save_figure`.
    """
    passing = {} if provenance is None else {"provenance": dict(provenance)}
    whole = {**labels, **passing, CONTENT_DIGEST: page_digest(page, labels)}
    with replacing(path) as temporary:
        temporary.write_bytes(sealed(labelled_page(page, unsealed(whole))))


def _points(table: xr.Dataset) -> dict[str, Any]:
    """Return what there is one value of for each run, and which runs those are."""
    status = table["status"]
    done = np.atleast_1d(status.values == DONE)
    axes = sweep_axes(table, done) if status.ndim else []
    columns = {
        str(name): np.atleast_1d(values.values)[done]
        for name, values in table.data_vars.items()
        if values.dims == status.dims and name not in ("status", "run_id")
    }
    states = list(MEANINGS)
    return {
        "axes": axes,
        "colours": usual_colours(axes),
        "shared": shared_values(table),
        "runs": [str(each) for each in np.atleast_1d(table["run_id"].values)[done]],
        "missing": _missing(table),
        "columns": {name: _column(values) for name, values in columns.items()},
        "quantities": {name: _described(name) for name in columns},
        "states": {
            name: embedded(
                [states.index(each) for each in verdicts(table, flag)[done.ravel()]], "u1"
            )
            for name, flag in FLAGS.items()
        },
    }


def _missing(table: xr.Dataset) -> list[dict[str, Any]]:
    """Return the swept values of the runs that are missing."""
    status = table["status"]
    if not status.ndim:
        return []
    return [
        {
            str(dim): table[dim].values[index].item()
            for dim, index in zip(status.dims, place, strict=True)
        }
        for place in zip(*np.nonzero(status.values != DONE), strict=True)
    ]


def _column(values: np.ndarray[Any, np.dtype[Any]]) -> Any:
    """Return values of all runs: numbers in full, flags as true and false, and texts."""
    if values.dtype.kind in "fiu":
        return embedded(values)
    return [bool(each) if values.dtype.kind == "b" else str(each) for each in values.tolist()]


def _described(name: str) -> list[str]:
    """Return unit and meaning of a quantity."""
    found = dataset_quantity(name)
    return ["1", name.replace("_", " ")] if found is None else list(found)


def _curves(
    table: xr.Dataset, along: str, names: Iterable[str], *, logarithmic: bool = False
) -> dict[str, Any]:
    """Return curves of all runs with the points that they are drawn through."""
    done = np.atleast_1d(table["status"].values == DONE)
    x = table[along].values
    found: dict[str, Any] = {}
    for name in names:
        values = _rows(table, name, done, along)
        drawn = thinned(x, values, logarithmic=logarithmic)
        error = f"{name}_error"
        found[name] = {
            "along": along,
            "quantity": _described(name),
            "along_quantity": _described(along),
            "share": drawn.share,
            "tolerance": drawn.tolerance,
            "x": embedded(x),
            "counts": embedded([len(each) for each in drawn.kept], "u4"),
            "points": embedded(np.concatenate(drawn.kept), "u4" if x.size > 2**16 else "u2"),
            "values": _at(values, drawn.kept),
            **(
                {error: _at(_rows(table, error, done, along), drawn.kept)} if error in table else {}
            ),
        }
    return found


def _rows(
    table: xr.Dataset, name: str, done: np.ndarray[Any, np.dtype[np.bool_]], along: str
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the curves of all runs that are done, shape (runs, points)."""
    values = table[name].transpose(*table["status"].dims, along).values
    return np.asarray(values.reshape(*done.shape, -1)[done])


def _at(
    values: np.ndarray[Any, np.dtype[np.float64]], kept: Iterable[np.ndarray[Any, Any]]
) -> dict[str, str]:
    return embedded(np.concatenate([row[chosen] for row, chosen in zip(values, kept, strict=True)]))


def _snapshots(runs: Iterable[xr.Dataset], room: int) -> dict[str, Any]:
    """Return the snapshots of runs for as long as there is room, and how many do without."""
    found: dict[str, Any] = {}
    left_out: list[str] = []
    for run in runs:
        drawn = None if left_out else outlines(run)
        name = str(run.attrs["run"])
        size = len(_json({name: drawn}))
        if drawn is not None and size <= room:
            room -= size
            found[name] = drawn
        elif run.sizes.get("snapshot", 0):
            left_out.append(name)
    return {"snapshots": found, "without_room": left_out}


def _page(data: Mapping[str, Any]) -> bytes:
    parts = dict(_files(("explorer.html", "explorer.css", *PROGRAM)))
    page = Template(parts["explorer.html"]).substitute(
        title=str(data["scenario"]).replace("&", "&amp;").replace("<", "&lt;"),
        program=f"softslip {softslip.__version__}, plotly {plotly.__version__}",
        style=parts["explorer.css"],
        data=_json(data),
        plotly=_plotly(),
        script="\n".join(parts[name] for name in PROGRAM),
    )
    return page.encode()


def _json(data: Mapping[str, Any]) -> str:
    """Return JSON that can stand in an element of a page; what is not known is null."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _files(names: Iterable[str]) -> Iterator[tuple[str, str]]:
    for name in names:
        yield name, resources.files(__package__).joinpath(name).read_text("utf-8")


def _plotly() -> str:
    """Return the plotting library as it comes with its package."""
    return str(get_plotlyjs())
