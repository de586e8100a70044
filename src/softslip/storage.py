"""NetCDF files that appear whole or not at all, and say which stage and run they are of."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import xarray as xr

import softslip
from softslip.errors import DatasetError

REFERENCE = (
    "G. Jung and S. M. Fielding, Wall slip and bulk yielding in soft particle suspensions, "
    "arXiv:1911.05392"
)


def write_dataset(dataset: xr.Dataset, path: Path, *, stage: str, run: str, title: str) -> None:
    """Write a dataset under its final name in one step.

    Every variable is compressed and carries a fletcher32 checksum. The file is written to a
    temporary name in the same folder, synced and renamed, so that a reader finds either the
    whole new file or what was there before.

    Parameters
    ----------
    dataset
        What to write; its attributes are kept and added to.
    path
        Final name.
    stage, run
        Which stage and which run the dataset is the result of; read back by `read_dataset`.
    title
        One line for people.
    """
    # How a part was stored before, such as the length of its words, need not fit the whole.
    labelled = dataset.drop_encoding().assign_attrs(
        Conventions="CF-1.11",
        title=title,
        source=f"softslip {softslip.__version__}",
        references=REFERENCE,
        history=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} softslip {stage}",
        stage=stage,
        run=run,
    )
    encoding = {
        name: {"zlib": True, "complevel": 4, "fletcher32": True}
        for name, variable in labelled.variables.items()
        if variable.ndim and variable.dtype.kind in "fiub"
    }
    with replacing(path) as temporary:
        labelled.to_netcdf(temporary, engine="netcdf4", encoding=encoding)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary file in the same folder, and in the end put it in a file's place.

    It is synced and renamed, so that a reader finds either the whole new file or what was there
    before. After an error nothing is left of it.

    Parameters
    ----------
    path
        Final name; its folder is made where it is missing.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        _sync(temporary)
        temporary.chmod(0o644)
        temporary.replace(path)
        _sync(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read_dataset(path: Path, *, stage: str, run: str | None = None) -> xr.Dataset:
    """Read a whole dataset into memory and check what it is.

    Raises
    ------
    DatasetError
        When the file is missing or unreadable, or is the result of another stage or run.
    """
    try:
        dataset = xr.load_dataset(path, engine="netcdf4")
    except FileNotFoundError:
        raise DatasetError(f"{path}: not there; run the {stage} stage first") from None
    except (OSError, ValueError, RuntimeError) as error:
        raise DatasetError(
            f"{path}: cannot be read ({error}); delete it and run the {stage} stage again"
        ) from error
    for key, wanted in (("stage", stage), ("run", run)):
        found = dataset.attrs.get(key)
        if wanted is not None and found != wanted:
            raise DatasetError(f"{path}: is of {key} {found!r}, not {wanted!r}")
    return dataset
