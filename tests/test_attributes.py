from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from softslip import attributes as module
from softslip.attributes import read_attributes
from softslip.errors import DatasetError
from softslip.storage import write_dataset

TOLD = {
    "text": "plain",
    "empty": "",
    "greek": "γ̇ in μm",
    "long": "x" * 100_000,
    "whole": 7,
    "real": 0.1,
    "several": [1.5, 2.5],
    "small": np.int8(-3),
    "words": ["one", "zwei", "três"],
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "räume" / "it is.nc"
    write_dataset(
        xr.Dataset({"x": ("y", np.arange(3.0))}, attrs=TOLD), file, stage="s", run="r", title="t"
    )
    return file


def test_attributes_are_those_that_were_written(path: Path) -> None:
    found = read_attributes(path)
    assert {key: found[key] for key in TOLD} == TOLD
    assert found["stage"] == "s"


def test_the_library_and_netcdf4_say_the_same(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert module._library() is not None, "the fast way is not there: thousands of runs are slow"
    fast = read_attributes(path)
    monkeypatch.setattr(module, "_library", lambda: None)
    slow = read_attributes(path)
    assert fast == slow
    assert list(fast) == list(slow)


@pytest.mark.parametrize("way", ["library", "netCDF4"])
def test_what_is_no_dataset_is_refused_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    if way == "netCDF4":
        monkeypatch.setattr(module, "_library", lambda: None)
    broken = tmp_path / "broken.nc"
    broken.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(1000))
    with pytest.raises(DatasetError, match=r"broken\.nc: cannot be read \(.+\)$"):
        read_attributes(broken)
    for missing in (tmp_path / "no.nc", tmp_path):
        with pytest.raises(DatasetError, match="is not there, or no file"):
            read_attributes(missing)


def test_files_are_closed_again(path: Path) -> None:
    for _ in range(3):
        read_attributes(path)
    # A file that is open for reading cannot be opened for writing.
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.text = "changed"
    assert read_attributes(path)["text"] == "changed"
