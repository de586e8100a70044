"""NetCDF files that appear whole or not at all, and say which stage and run they are of."""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
import xarray as xr

import softslip
from softslip.errors import DatasetError, SoftslipError, StorageError
from softslip.files.conventions import CONVENTIONS, as_stored, as_used
from softslip.files.dataset_check import SCHEMAS, check_dataset
from softslip.files.discovery import discovery, without_discovery
from softslip.files.seals import check_seal, seal
from softslip.files.uninterrupted import uninterrupted
from softslip.messages import file_text

REFERENCE = (
    "G. Jung and S. M. Fielding, Wall slip and bulk yielding in soft particle suspensions, "
    "arXiv:1911.05392"
)

VOLATILE = ("date_created", "history", "provenance")
"""Attributes that differ between two runs of the same thing: when and where it was run."""

CONTENT_DIGEST, RECORD_DIGEST = "content_sha256", "record_sha256"
"""Attributes: the digest of all that a rerun repeats, and of that with the rest."""


def write_dataset(dataset: xr.Dataset, path: Path, *, stage: str, run: str, title: str) -> None:
    """Write a dataset under its final name in one step.

    The file keeps to CF-1.11 (`files.conventions`) and ACDD-1.3 (`files.discovery`);
    `read_dataset` gives back what was given. Every variable is compressed and carries a fletcher32
    checksum, the whole two digests that `read_dataset` checks, and the file a seal (`files.seals`).
    It is written to a temporary name in the same folder, read back, synced and renamed, so that a
    reader finds either the whole new file or what was there before.

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

    Raises
    ------
    StorageError
        When it cannot be written, or does not read back as it was.
    """
    _check_place(path, StorageError)
    try:
        # How a part was stored before, such as the length of its words, need not fit the whole.
        stored = as_stored(dataset.drop_encoding())
    except ValueError as error:
        raise StorageError(f"{file_text(path)}: cannot be written ({error})") from error
    labelled = stored.assign_attrs(_labels(dataset.attrs, stage, run, title))
    labelled = labelled.assign_attrs(digests(labelled))
    encoding = _encoding(labelled)
    with replacing(path) as temporary, uninterrupted():
        # The library below says RuntimeError where a disk is full.
        try:
            labelled.to_netcdf(temporary, engine="netcdf4", encoding=encoding)
            _check_digests(path, xr.load_dataset(temporary, engine="netcdf4"))
            seal(temporary)
        except (OSError, RuntimeError, ValueError, AttributeError, DatasetError) as error:
            raise StorageError(
                f"{file_text(path)}: cannot be written ({_reason(error)})"
            ) from error


def _labels(own: Mapping[str, Any], stage: str, run: str, title: str) -> dict[str, Any]:
    """Return the attributes that a dataset gets; its own keep their place among those of ACDD."""
    moment = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
    return {
        **discovery(stage, run),
        **own,
        "Conventions": CONVENTIONS,
        "title": title,
        "source": f"softslip {softslip.__version__}",
        "product_version": softslip.__version__,
        "references": REFERENCE,
        "date_created": moment,
        "history": f"{moment} softslip {stage}",
        "stage": stage,
        "run": run,
    }


def _encoding(stored: xr.Dataset) -> dict[Any, dict[str, Any]]:
    """Return how variables are compressed, and that nothing is missing from a coordinate."""
    return {
        name: {
            **({"zlib": True, "complevel": 4, "fletcher32": True} if variable.ndim else {}),
            # Left to itself, the library declares one for every number.
            **({"_FillValue": None} if name in stored.dims else {}),
        }
        for name, variable in stored.variables.items()
        if variable.dtype.kind in "fiub"
    }


def digests(dataset: xr.Dataset) -> dict[str, str]:
    """Return the two digests of a dataset, see `CONTENT_DIGEST`, as hexadecimal SHA-256.

    Those in a file are of what the file has, which `read_dataset` turns into what is in memory.
    They are those of names, dimensions, types, numbers and attributes, whatever the order of
    variables, the compression and the byte order of the file.
    """
    attributes = {
        key: value
        for key, value in dataset.attrs.items()
        if key not in (CONTENT_DIGEST, RECORD_DIGEST)
    }
    content = hashlib.sha256()
    for name in sorted(map(str, dataset.variables)):
        variable = dataset.variables[name]
        values, kind = _canonical(variable.values)
        words = [name, list(variable.dims), kind, list(variable.shape), _plain(variable.attrs)]
        content.update(json.dumps(words, sort_keys=True).encode())
        content.update(values)
    lasting = {key: value for key, value in attributes.items() if key not in VOLATILE}
    content.update(json.dumps(_plain(lasting), sort_keys=True).encode())
    whole = content.hexdigest() + json.dumps(_plain(attributes), sort_keys=True)
    return {
        CONTENT_DIGEST: content.hexdigest(),
        RECORD_DIGEST: hashlib.sha256(whole.encode()).hexdigest(),
    }


def _canonical(values: np.ndarray[Any, np.dtype[Any]]) -> tuple[bytes, str]:
    """Return an array's bytes and type, the same before it is written and after it is read."""
    if values.dtype.kind in "OUT":
        return json.dumps(values.astype(str).tolist()).encode(), "string"
    ordered = values.astype(values.dtype.newbyteorder("<"), order="C")
    return ordered.tobytes(), ordered.dtype.str


def _plain(value: Any) -> Any:
    """Return an attribute, or all of a mapping, as JSON has it; one number is as good as a list."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return _plain(value[0]) if len(value) == 1 else [_plain(item) for item in value]
    return value


def _check_digests(path: Path, dataset: xr.Dataset) -> None:
    """Refuse a dataset that is not what was written.

    Raises
    ------
    DatasetError
        When a digest is missing or is that of something else.
    """
    for key, expected in digests(dataset).items():
        found = dataset.attrs.get(key)
        if found != expected:
            state = "is missing" if found is None else "does not fit what the file holds"
            raise DatasetError(f"{file_text(path)}: {key} {state}; delete it and rerun its job")


def _check_place(path: Path, error: type[SoftslipError]) -> None:
    """Refuse a place in which the library opens no file; it would take the file for damaged."""
    place = str(path.absolute())
    if "\\" in place or _has_no_text(place):
        raise error(
            f"{file_text(path)}: lies in a folder whose name has a backslash or is not UTF-8, in "
            "which the NetCDF library opens no file; rename that folder"
        )


def _has_no_text(place: str) -> bool:
    try:
        place.encode()
    except UnicodeEncodeError:
        return True
    return False


def _reason(error: Exception) -> str:
    """Return what is wrong, in the system's words where it was the system."""
    return str(getattr(error, "strerror", None) or error)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary file in the same folder, and in the end put it in a file's place.

    Who may read and write it is up to the umask and the folder. It is synced and renamed, so that
    a reader finds either the whole new file or what was there before. After an error nothing is
    left of it.

    Parameters
    ----------
    path
        Final name; its folder is made where it is missing.

    Raises
    ------
    StorageError
        When the system refuses to write, as on a full disk.
    """
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = unused_name(path)
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield temporary
        _sync(temporary)
        temporary.replace(path)
        _sync(path.parent)
    except OSError as error:
        raise StorageError(f"{file_text(path)}: cannot be written ({_reason(error)})") from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def unused_name(path: Path) -> Path:
    """Return a hidden name beside a file or folder that nothing else has."""
    return path.with_name(f".{path.name[:80]}.{uuid4().hex}.part")


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
        When the file is missing, unreadable or altered, the result of another stage or run, or not
        what its stage writes.
    """
    name = file_text(path)
    _check_place(path, DatasetError)
    # A pipe would be waited for, and nobody should be told to delete a folder or a device.
    if os.path.lexists(path) and not path.is_file():
        raise DatasetError(f"{name}: is not a file; give the file that the {stage} stage wrote")
    if os.path.isfile(path):
        # First, as a damaged file can make the library crash or wait for ever.
        check_seal(path, required=False)
    try:
        # From the top: the library takes ~ for the home folder.
        with uninterrupted():
            dataset = xr.load_dataset(path.absolute(), engine="netcdf4")
    except FileNotFoundError:
        raise DatasetError(f"{name}: does not exist; run the {stage} stage first") from None
    except PermissionError as error:
        raise DatasetError(f"{name}: cannot be read ({_reason(error)})") from None
    # What the library raises for a damaged file has no common base; AttributeError is among it.
    except Exception as error:
        raise DatasetError(
            f"{name}: cannot be read ({_reason(error)}); if it is a result, delete it and rerun "
            f"the {stage} stage"
        ) from error
    for key, expected in (("stage", stage), ("run", run)):
        found = dataset.attrs.get(key)
        if expected is not None and found != expected:
            raise DatasetError(f"{name}: is of {key} {found!r}, not {expected!r}")
    _check_digests(path, dataset)
    used = as_used(dataset)
    used.attrs = without_discovery(used.attrs)
    if stage in SCHEMAS:
        try:
            check_dataset(used, stage)
        except DatasetError as error:
            raise DatasetError(f"{name}: {error}") from None
    return used
