"""Pages of made-up runs, and what a page holds."""

import json
from collections.abc import Iterator, Mapping, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from synthetic import generator, sweep

from softslip.analysis.explorer.embedding import restored
from softslip.analysis.explorer.page import explorer_page, save_page
from softslip.analysis.observables.tables import creep, flow_curve, profiles
from softslip.files.storage import CONTENT_DIGEST

SHORT = 30.0
"""Duration of the runs [time unit]: long series take seconds to judge."""

VOID = {"meta", "link", "input", "br"}
"""Elements without an end tag."""


def tables_of(runs: Sequence[Any]) -> list[xr.Dataset]:
    """Return what a page is made from, of labelled runs."""
    return [table(runs).assign_attrs(run="made-up <&>") for table in (flow_curve, creep, profiles)]


def made_up(
    stresses: Sequence[float] = (0.03, 0.2, 0.5),
    roughnesses: Sequence[float] = (0.0, 0.59),
    seeds: Sequence[int] = (1, 2),
    **options: Any,
) -> tuple[list[xr.Dataset], list[xr.Dataset]]:
    """Return tables, and the runs that they were made from."""
    runs = sweep(stresses, roughnesses, seeds, **{"duration": SHORT, **options})
    return tables_of(runs), [run for _, run in runs if run is not None]


def columns_of(table: xr.Dataset) -> list[str]:
    """Return the quantities of a table that have one value for each run."""
    of_runs = [str(name) for name in table if table[name].dims == table["status"].dims]
    return [name for name in of_runs if name not in ("status", "run_id")]


def many(table: xr.Dataset, copies: int) -> xr.Dataset:
    """Return a table over more runs: each curve with noise of its own, along one more axis."""
    random = generator(copies, 5)
    swept = [name for name in table.data_vars if set(table["status"].dims) <= set(table[name].dims)]
    wider = table.expand_dims(copy=np.arange(copies)).copy(deep=True)
    for name in swept:
        if wider[name].dtype.kind == "f":
            wider[name] = wider[name] * (1 + 0.05 * random.standard_normal(wider[name].shape))
    names = [f"{number:016x}" for number in range(wider["run_id"].size)]
    wider["run_id"] = wider["run_id"].dims, np.reshape(names, wider["run_id"].shape)
    return wider


def saved(folder: Path, tables: Sequence[xr.Dataset], runs: Sequence[xr.Dataset]) -> Path:
    """Save the page of some runs, with labels as the command writes them."""
    path = folder / "explorer.html"
    parents = [
        {"stage": "shear", "run": run.attrs["run"], CONTENT_DIGEST: f"{number:064x}"}
        for number, run in enumerate(runs)
    ]
    origins = {run.attrs["run"]: {"commit": "c0ffee", "dirty": False, "seed": 1} for run in runs}
    labels = {"title": "explorer", "stage": "figure", "run": "made-up", "parents": parents}
    save_page(explorer_page(*tables, runs), path, labels, {"runs": origins})
    return path


class ParsedPage(HTMLParser):
    """The elements of a page; refuses one that is not closed."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.texts: dict[str, str] = {}
        self._id = ""
        self.feed(page.decode())
        self.close()
        assert self.open == [], f"elements are not closed: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, key, value or "") for key, value in attrs]
        self._id = dict(attrs).get("id") or tag
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag, f"{tag} is closed before it is opened"
        self._id = ""

    def handle_data(self, data: str) -> None:
        self.texts[self._id] = self.texts.get(self._id, "") + data


def data_of(page: bytes) -> dict[str, Any]:
    """Return what a page has to show."""
    found: dict[str, Any] = json.loads(ParsedPage(page).texts["data"])
    return found


def curves_of(data: Mapping[str, Any], name: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield numbers of points and values of the curve of each run."""
    found = data["curves"][name]
    ends = np.cumsum(restored(found["counts"]))
    points, values = restored(found["points"]), restored(found["values"])
    yield from zip(np.split(points, ends[:-1]), np.split(values, ends[:-1]), strict=True)
