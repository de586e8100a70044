"""The results of a whole small scenario, made once in a process, and what forgers do to them."""

import contextlib
import functools
import hashlib
import io
import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from projects import TINY, drawings

from softslip.cli import app
from softslip.config.scenario import load_scenario
from softslip.files import stamps
from softslip.files.expected_results import expected_results
from softslip.files.seals import seal
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST, VOLATILE, digests
from softslip.provenance.verification import survey
from softslip.provenance.verification.consistency import TABLES
from softslip.provenance.verification.examination import Examination, examine

SNAPSHOTS = "snapshots: [0.1, 0.2, 0.3, 0.4, 0.5]"
"""As many as a movie takes."""

SCENARIO = TINY.replace("snapshots: [0.25]", SNAPSHOTS) + "axes:\n  rheometer.stress: [0.2, 0.4]\n"
"""Two runs that share all stages but the last, and a movie."""

NAME = "small"


def call(words: Sequence[object], folder: Path | None = None) -> str:
    """Run a command in this process, as `provenance.verification.reexecution.run_command` does."""
    try:
        # In a process of its own it would have its own output, too.
        with contextlib.redirect_stdout(io.StringIO()):
            status = app([str(word) for word in words], standalone_mode=False)
    # Whatever a command may raise is what it said.
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return f"exit status {status}" if status else ""


@functools.cache
def made() -> Path:
    """Return a folder with the scenario and its results, which nobody may change."""
    # Removed when the process ends.
    keeper = tempfile.TemporaryDirectory(prefix="softslip-small-results-")
    _KEPT.append(keeper)
    folder = Path(keeper.name)
    source, results = folder / f"{NAME}.yaml", folder / "results"
    source.write_text(SCENARIO)
    for run in load_scenario(str(source)).runs():
        before: list[object] = []
        for stage, identity in run.ids.items():
            output = results / stage / f"{identity}.nc"
            if not output.exists():
                _make(stage, source, identity, *before, "--output", output)
            before = ["--parent", output]
        picture = results / "figures" / "snapshots" / f"{run.ids['shear']}.png"
        _make("draw", "snapshot", output, "--output", picture)
    for table in TABLES:
        _make("gather", table, source, "--results", results, "--output", results / f"{table}.nc")
    curve, fits = results / "flow_curve.nc", results / "fits.nc"
    _make("fit", curve, "--output", fits)
    _make("compare", curve, fits, "--output", results / "comparison.nc")
    for name, data, picture in drawings(load_scenario(str(source)), results):
        _make("draw", name, *data, "--output", picture)
    _make("explorer", source, "--results", results, "--output", results / "explorer.html")
    return folder


@functools.cache
def count() -> int:
    """Return how many results the scenario has: more with each table and figure."""
    return len(list(expected_results(load_scenario(str(made() / f"{NAME}.yaml")))))


_KEPT: list[tempfile.TemporaryDirectory[str]] = []


def _make(*words: object) -> None:
    said = call(words)
    assert not said, f"{words}: {said}"


@functools.cache
def _copy() -> Path:
    """Return a copy in another folder, with other times of the files, which tests may change."""
    _KEPT.append(tempfile.TemporaryDirectory(prefix="softslip-small-results-"))
    copy = Path(_KEPT[-1].name) / "copy"
    shutil.copytree(made(), copy, copy_function=shutil.copyfile)
    return copy


@functools.cache
def _known(path: Path, digest: str) -> Examination:
    return examine(path)


def remembered(path: Path) -> Examination:
    """Examine a file, or remember what was found in the very same bytes at the same place."""
    return _known(path, hashlib.sha256(path.read_bytes()).hexdigest())


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a folder with results, beside their scenario; what is done to them is undone."""
    monkeypatch.setattr(survey, "examine", remembered)
    folder, pristine = _copy(), made()
    yield folder / "results"
    for path in folder.rglob("*"):
        if path.is_file() and not (pristine / path.relative_to(folder)).exists():
            path.unlink()
    for path in pristine.rglob("*"):
        copy = folder / path.relative_to(pristine)
        if path.is_file() and (not copy.exists() or copy.read_bytes() != path.read_bytes()):
            shutil.copyfile(path, copy)


def source(results: Path) -> str:
    """Return the scenario that results are of."""
    return str(results.parent / f"{NAME}.yaml")


def edit(path: Path, attributes: Mapping[str, Any]) -> None:
    """Change attributes of a dataset in place."""
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.setncatts(attributes)


def edited_json(text: str, **changes: Any) -> str:
    """Return a JSON object with some of its entries replaced."""
    return json.dumps(json.loads(text) | changes, sort_keys=True)


def attribute(path: Path, name: str) -> Any:
    with netCDF4.Dataset(path) as dataset:
        return dataset.getncattr(name)


def redigest(path: Path) -> None:
    """Make a dataset's digests, and its seal, right again."""
    with xr.open_dataset(path, engine="netcdf4") as opened:
        found = digests(opened.load())
    edit(path, found)
    seal(path)


def forge_labels(path: Path, **changes: Any) -> None:
    """Replace labels of a PNG and make its digests right again."""
    forge_figure(path, changes, lambda pixels: pixels)


def forge_figure(path: Path, changes: Mapping[str, Any], paint: Any) -> None:
    """Replace labels and pixels of a PNG and make its digests right again."""
    content = path.read_bytes()
    with Image.open(io.BytesIO(content)) as image:
        title, pixels = str(image.info["Title"]), np.array(image.convert("RGBA"))
    labels = stamps.read_labels(path) | changes
    buffer = io.BytesIO()
    Image.fromarray(paint(pixels)).save(buffer, "png")
    passing = (*VOLATILE, CONTENT_DIGEST, RECORD_DIGEST)
    lasting = {key: value for key, value in labels.items() if key not in passing}
    labels[CONTENT_DIGEST] = stamps.content_digest(buffer.getvalue(), lasting)
    fields = {"Title": title, "Description": stamps.unsealed(labels)}
    path.write_bytes(stamps.sealed(stamps.with_text(buffer.getvalue(), fields)))
