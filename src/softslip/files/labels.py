"""The labels of very many datasets: attributes that are text, thousands of files a second.

The netCDF library looks at all variables of a file when it opens it, which takes milliseconds. A
NetCDF 4 file is an HDF5 file whose global attributes are those of its root group, so that the HDF5
library alone reads some of them in a fraction of a millisecond. It is the very library that netCDF4
is linked to; h5py, which brings another, is no faster than netCDF4.
"""

import ctypes
import os
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from softslip.errors import DatasetError
from softslip.messages import file_text

_DEFAULT = 0
"""HDF5's default property list, its default error stack, and read-only access."""

_STRING = 3
"""HDF5's class of strings."""

_IDENTIFIER = ctypes.c_int64
_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "H5open": (ctypes.c_int, ()),
    "H5Eset_auto2": (ctypes.c_int, (_IDENTIFIER, ctypes.c_void_p, ctypes.c_void_p)),
    "H5Fopen": (_IDENTIFIER, (ctypes.c_char_p, ctypes.c_uint, _IDENTIFIER)),
    "H5Fclose": (ctypes.c_int, (_IDENTIFIER,)),
    "H5Aopen": (_IDENTIFIER, (_IDENTIFIER, ctypes.c_char_p, _IDENTIFIER)),
    "H5Aclose": (ctypes.c_int, (_IDENTIFIER,)),
    "H5Aget_type": (_IDENTIFIER, (_IDENTIFIER,)),
    "H5Aget_storage_size": (ctypes.c_uint64, (_IDENTIFIER,)),
    "H5Aread": (ctypes.c_int, (_IDENTIFIER, _IDENTIFIER, ctypes.c_void_p)),
    "H5Tget_class": (ctypes.c_int, (_IDENTIFIER,)),
    "H5Tis_variable_str": (ctypes.c_int, (_IDENTIFIER,)),
    "H5Tget_size": (ctypes.c_size_t, (_IDENTIFIER,)),
    "H5Tclose": (ctypes.c_int, (_IDENTIFIER,)),
}


LABELS = (
    "stage",
    "run",
    "title",
    "source",
    "history",
    "parent",
    "parents",
    "parameters",
    "provenance",
    "content_sha256",
    "record_sha256",
)
"""What every result says of itself, see `files.storage`; each is one text in plain ASCII."""


def text_attributes(path: Path, names: Sequence[str]) -> dict[str, str]:
    """Return some global attributes of a dataset, without those that it does not have.

    Parameters
    ----------
    path
        A NetCDF 4 file. Whether its contents are sound is not looked at.
    names
        Of attributes. Those that are no single text in plain ASCII, as the labels are that
        `files.storage` writes, are left out too.

    Raises
    ------
    DatasetError
        When the file is missing or cannot be read.
    """
    _check_file(path)
    library = _library()
    with _opened(library, path) as file:
        found = {name: _text(library, file, name) for name in names}
    return {name: text for name, text in found.items() if text is not None}


def _check_file(path: Path) -> None:
    try:
        if stat.S_ISREG(path.stat().st_mode):
            return
    except PermissionError as error:
        raise DatasetError(f"{file_text(path)}: cannot be read ({error.strerror})") from None
    except (OSError, ValueError):
        pass
    raise DatasetError(f"{file_text(path)}: does not exist or is not a file")


@cache
def _library() -> ctypes.PyDLL:
    """Return the HDF5 library, whose functions are found among what netCDF4 is linked to."""
    package = find_spec("netCDF4")
    places = package and package.submodule_search_locations
    module = places and PathFinder.find_spec("_netCDF4", places)
    if not module or not module.origin:
        raise ImportError("netCDF4 is not installed, or has no compiled module")
    # It keeps Python's lock: the library must not be called by two threads. What netCDF4 does when
    # it is imported is not needed, and takes as long as a thousand files.
    library = ctypes.PyDLL(module.origin)
    for name, (result, arguments) in _SIGNATURES.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    library.H5open()
    # Functions report errors by what they return, not on standard error.
    library.H5Eset_auto2(_DEFAULT, None, None)
    return library


@contextmanager
def _opened(library: ctypes.PyDLL, path: Path) -> Iterator[int]:
    file = library.H5Fopen(os.fsencode(path), _DEFAULT, _DEFAULT)
    if file < 0:
        raise DatasetError(f"{file_text(path)}: cannot be read {_why_not(path)}")
    try:
        yield file
    finally:
        library.H5Fclose(file)


def _why_not(path: Path) -> str:
    """Return why the library opens no file; it does not tell itself which may not be read."""
    try:
        with path.open("rb"):
            return "as a NetCDF file"
    except OSError as error:
        return f"({error.strerror})"


def _text(library: ctypes.PyDLL, file: int, name: str) -> str | None:
    """Return an attribute of the root group, None where there is none that is plain text."""
    attribute = library.H5Aopen(file, name.encode(), _DEFAULT)
    if attribute < 0:
        return None
    kind = library.H5Aget_type(attribute)
    try:
        size = library.H5Tget_size(kind)
        # Several texts need more room than one, and those of any length lie elsewhere in the file.
        single = library.H5Aget_storage_size(attribute) == size
        if library.H5Tget_class(kind) != _STRING or library.H5Tis_variable_str(kind) or not single:
            return None
        room = ctypes.create_string_buffer(size)
        if library.H5Aread(attribute, kind, room) < 0:
            return None
        return room.raw.rstrip(b"\0").decode(errors="replace")
    finally:
        library.H5Tclose(kind)
        library.H5Aclose(attribute)
