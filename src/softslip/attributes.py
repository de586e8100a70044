"""The attributes of datasets' files, read without looking at their variables.

Python's netCDF4 builds an object for each variable of a file that it opens, which takes most of the
time when thousands of files are asked only what they are. The C library that it is linked with is
called directly instead; where that cannot be reached, netCDF4 gives the same, later.
"""

import ctypes
import os
from functools import cache
from pathlib import Path
from typing import Any

import netCDF4

from softslip.errors import DatasetError
from softslip.fields import file_text

_GLOBAL, _CHAR, _STRING = -1, 2, 12
_WHOLE = frozenset({1, 3, 4, 7, 8, 9, 10, 11})
_REAL = frozenset({5, 6})
"""NC_GLOBAL and the numbers of the types of attributes, as in netcdf.h."""

_LONGEST_NAME = 257
"""Bytes of a name and the zero at its end, at most (NC_MAX_NAME)."""

_NEEDED = (
    "nc_open",
    "nc_close",
    "nc_inq_natts",
    "nc_inq_attname",
    "nc_inq_att",
    "nc_get_att_text",
    "nc_get_att_string",
    "nc_free_string",
    "nc_get_att_longlong",
    "nc_get_att_double",
    "nc_strerror",
)


def read_attributes(path: Path) -> dict[str, Any]:
    """Return the attributes of a dataset's file: text, numbers and lists of them.

    Raises
    ------
    DatasetError
        When the file is missing, or no dataset that can be read.
    """
    if not path.is_file():
        raise DatasetError(f"{file_text(path)}: is not there, or no file")
    library = _library()
    try:
        return _by_netcdf4(path) if library is None else _by_library(library, path)
    except (OSError, RuntimeError, ValueError, AttributeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise DatasetError(f"{file_text(path)}: cannot be read ({reason})") from error


def _by_netcdf4(path: Path) -> dict[str, Any]:
    with netCDF4.Dataset(path.absolute()) as dataset:
        found = {name: dataset.getncattr(name) for name in dataset.ncattrs()}
    return {
        name: value.tolist() if hasattr(value, "tolist") else value for name, value in found.items()
    }


@cache
def _library() -> ctypes.PyDLL | None:
    """Return the C library within or behind netCDF4's own, None where it is out of reach."""
    from netCDF4 import _netCDF4

    try:
        # It keeps Python's lock: the library must not be called by two threads.
        library = ctypes.PyDLL(_netCDF4.__file__)
        for name in _NEEDED:
            getattr(library, name)
    except (OSError, AttributeError):
        return None
    library.nc_strerror.restype = ctypes.c_char_p
    return library


def _by_library(library: ctypes.PyDLL, path: Path) -> dict[str, Any]:
    handle, count = ctypes.c_int(), ctypes.c_int()
    _checked(library, library.nc_open(os.fsencode(path.absolute()), 0, ctypes.byref(handle)))
    try:
        _checked(library, library.nc_inq_natts(handle, ctypes.byref(count)))
        return dict(_attribute(library, handle, place) for place in range(count.value))
    finally:
        library.nc_close(handle)


def _attribute(
    library: ctypes.PyDLL, handle: ctypes.c_int, place: int
) -> tuple[str, str | float | list[Any]]:
    """Return the name and the value of one attribute of a file."""
    name = ctypes.create_string_buffer(_LONGEST_NAME)
    kind, length = ctypes.c_int(), ctypes.c_size_t()
    _checked(library, library.nc_inq_attname(handle, _GLOBAL, place, name))
    which = (handle, _GLOBAL, name)
    _checked(library, library.nc_inq_att(*which, ctypes.byref(kind), ctypes.byref(length)))
    size = length.value
    if kind.value == _CHAR:
        text = ctypes.create_string_buffer(size + 1)
        _checked(library, library.nc_get_att_text(*which, text))
        return _words(name), _decoded(text.raw[:size])
    if kind.value == _STRING:
        return _words(name), _single(_strings(library, which, size))
    if kind.value in _WHOLE:
        whole = (ctypes.c_longlong * size)()
        _checked(library, library.nc_get_att_longlong(*which, whole))
        return _words(name), _single(list(whole))
    if kind.value in _REAL:
        real = (ctypes.c_double * size)()
        _checked(library, library.nc_get_att_double(*which, real))
        return _words(name), _single(list(real))
    raise ValueError(f"attribute {_words(name)} is of a type of its own")


def _strings(library: ctypes.PyDLL, which: tuple[Any, ...], size: int) -> list[str]:
    texts = (ctypes.c_char_p * size)()
    _checked(library, library.nc_get_att_string(*which, texts))
    try:
        return [_decoded(text or b"") for text in texts]
    finally:
        library.nc_free_string(ctypes.c_size_t(size), texts)


def _single(values: list[Any]) -> Any:
    """Return one value by itself, as netCDF4 does."""
    return values[0] if len(values) == 1 else values


def _words(name: "ctypes.Array[ctypes.c_char]") -> str:
    return _decoded(name.value)


def _decoded(text: bytes) -> str:
    # As netCDF4 does with what is no UTF-8, and with the zeros that end a text in C.
    return text.decode("utf-8", "replace").replace("\x00", "")


def _checked(library: ctypes.PyDLL, status: int) -> None:
    """Raise what the library says is wrong.

    Raises
    ------
    OSError
        When it says that something is.
    """
    if status:
        told = library.nc_strerror(status)
        raise OSError(status, told.decode("ascii", "replace") if told else f"error {status}")
