"""Single attributes are those that the netCDF library reads, and damage is refused."""

import json
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

from softslip.errors import DatasetError
from softslip.files.labels import text_attributes
from softslip.files.storage import write_dataset

ATTRIBUTES = {
    "provenance": json.dumps({"core_seconds": 1.5, "host": 'a "host"'}),
    "long": "x" * 100_000,
    **{f"label{number}": f"word {number}" for number in range(20)},
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    dataset = xr.Dataset({"x": ("node", np.arange(5.0))}, attrs=ATTRIBUTES | {"count": 3})
    path = tmp_path / "a b.nc"
    write_dataset(dataset, path, stage="shear", run="0123", title="A test")
    return path


def test_texts_are_those_that_were_written(path: Path) -> None:
    found = text_attributes(path, (*ATTRIBUTES, "stage", "run", "title"))
    assert found == ATTRIBUTES | {"stage": "shear", "run": "0123", "title": "A test"}


def test_a_dataset_of_few_attributes_is_read_too(tmp_path: Path) -> None:
    """A few attributes are stored in another way than many."""
    with netCDF4.Dataset(tmp_path / "few.nc", "w") as file:
        file.setncattr("stage", "shear")
    assert text_attributes(tmp_path / "few.nc", ("stage", "run")) == {"stage": "shear"}


def test_what_is_missing_or_no_single_plain_text_is_left_out(path: Path) -> None:
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("greek", "σ = 0.3")
        file.setncattr_string("strings", ["a", "b"])
    assert text_attributes(path, ("nothing", "count", "greek", "strings", "stage")) == {
        "stage": "shear"
    }


def test_a_relative_path_is_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    assert text_attributes(Path(path.name), ("stage",)) == {"stage": "shear"}


@pytest.mark.parametrize("content", [b"", b"no dataset", b"\x89HDF\r\n\x1a\n" + b"\0" * 100])
def test_what_is_no_dataset_is_refused_in_one_line(
    path: Path, content: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=r"^[^\n]*a b.nc: cannot be read[^\n]*$"):
        text_attributes(path, ("stage",))
    assert capfd.readouterr() == ("", ""), "the library has its own say"


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="does not exist or is not a file"):
        text_attributes(tmp_path / "nothing.nc", ("stage",))


def test_a_file_that_was_cut_is_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(DatasetError, match="cannot be read"):
        text_attributes(path, ("stage",))


def test_files_are_closed_again(path: Path) -> None:
    """As many as a process may have open are read, and each can be written afterwards."""
    for _ in range(2000):
        text_attributes(path, ("stage",))
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("stage", "ageing")
    assert text_attributes(path, ("stage",)) == {"stage": "ageing"}
