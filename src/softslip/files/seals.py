"""The last line of a dataset's file: the SHA-256 of every byte before it.

Digests of content are of what a reader sees, and half of the bits of a small NetCDF file are never
seen: unused space, padding, and times that nobody asks for. The seal is of the file itself, and is
looked at before any library is, which damage can make crash or wait for ever. It comes after the
end that the HDF5 format states, so that readers pass it by; whoever opens the file for writing
with the library cuts it off.
"""

import hashlib
import os
import re
from pathlib import Path

from softslip.errors import DatasetError
from softslip.messages import file_text

_WORDS = b"\nSHA-256 of all bytes before this line: "
_FORM = re.compile(re.escape(_WORDS) + rb"([0-9a-f]{64})\n")
_LENGTH = len(_WORDS) + 64 + 1
_BLOCK = 1 << 20


def seal(path: Path) -> None:
    """Append a seal to a file.

    Parameters
    ----------
    path
        A file without a seal, before it gets its final name.

    Raises
    ------
    OSError
        When it cannot be read or written.
    """
    digest = _digest(path, path.stat().st_size)
    with path.open("ab") as file:
        file.write(_WORDS + digest.encode() + b"\n")


def check_seal(path: Path, *, required: bool = True) -> None:
    """Make sure that no byte of a file is another than when it was sealed.

    Parameters
    ----------
    path
        The file.
    required
        Whether a file without a seal is refused, too.

    Raises
    ------
    DatasetError
        When the file cannot be read, has no seal at its end, or one of other bytes.
    """
    try:
        size = path.stat().st_size - _LENGTH
        found = _FORM.fullmatch(_end(path, size)) if size >= 0 else None
        if found is None:
            if not required:
                return
            raise DatasetError(
                f"{file_text(path)}: has no seal at its end, so that it has been cut, opened for "
                "writing, or written by an earlier release; delete it and rerun its job"
            )
        digest = _digest(path, size)
    except OSError as error:
        raise DatasetError(f"{file_text(path)}: cannot be read ({error.strerror})") from error
    if digest.encode() != found[1]:
        raise DatasetError(
            f"{file_text(path)}: has been altered since it was written: its bytes do not fit their "
            "seal; delete it and rerun its job"
        )


def _end(path: Path, start: int) -> bytes:
    with path.open("rb") as file:
        file.seek(start, os.SEEK_SET)
        return file.read()


def _digest(path: Path, size: int) -> str:
    """Return the SHA-256 of the first bytes of a file, hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0 and (block := file.read(min(size, _BLOCK))):
            digest.update(block)
            size -= len(block)
    return digest.hexdigest()
