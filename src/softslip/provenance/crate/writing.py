"""A research object as a folder or as a ZIP archive, each whole or not at all."""

import hashlib
import os
import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from softslip.errors import ConfigError, StorageError
from softslip.files.storage import replacing, unused_name
from softslip.messages import brief, file_text
from softslip.provenance.crate.contents import CrateFile

CHUNK = 1 << 20
"""How much is copied at once [byte]."""

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The time that every member of an archive has: the same contents are to give the same bytes."""


def check_folder(folder: Path) -> None:
    """Refuse a folder that something is in already.

    Raises
    ------
    ConfigError
        When there is something.
    """
    if os.path.lexists(folder) and not (folder.is_dir() and not any(folder.iterdir())):
        raise ConfigError(
            "output", brief(str(folder)), "is there already", "remove it, or give another folder"
        )


def check_archive(path: Path) -> None:
    """Refuse the name of an archive that would replace what is none.

    Raises
    ------
    ConfigError
        When it would.
    """
    limits = {
        "does not end in .zip": path.suffix != ".zip",
        "exists and is not a file": os.path.lexists(path) and not path.is_file(),
    }
    for limit, broken in limits.items():
        if broken:
            raise ConfigError("zip", brief(str(path)), limit, "give a file such as demo.zip")


def write_folder(items: list[CrateFile], folder: Path, *, link: bool = False) -> None:
    """Write a research object as a folder.

    It is put together under a temporary name beside its own.

    Parameters
    ----------
    items
        Its files.
    folder
        Final name; must not be there, or be empty.
    link
        Whether files become hard links of those that they come from, instead of copies.

    Raises
    ------
    ConfigError
        When something is in the folder already.
    StorageError
        When the system refuses, or a file changes meanwhile.
    """
    check_folder(folder)
    temporary: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = unused_name(folder)
        temporary.mkdir()
        for each in items:
            _put(each, temporary / each.name, link)
        temporary.replace(folder)
    except OSError as error:
        raise StorageError(
            f"{file_text(folder)}: cannot be written ({error.strerror or error})"
        ) from error
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)


def _put(each: CrateFile, path: Path, link: bool) -> None:
    if link and isinstance(each.source, Path):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            # Of the file itself, where its name is a link.
            os.link(each.source.resolve(), path)
        except OSError as error:
            raise StorageError(
                f"{file_text(each.source)}: cannot be linked into {file_text(path.parent)} "
                f"({error.strerror}); give --data copy"
            ) from error
        with path.open("rb") as file:
            _check(each, hashlib.file_digest(file, "sha256").hexdigest())
        return
    with replacing(path) as temporary, temporary.open("wb") as file:
        _copy(each, file)


def write_archive(items: list[CrateFile], path: Path) -> None:
    """Write a research object as a ZIP archive; the same contents give the same bytes.

    Its members are in the order of their names, with `EARLIEST` as their time, and stored as they
    are: datasets and figures are compressed already, and what compression makes of the rest
    depends on the library.

    Raises
    ------
    ConfigError
        When its name is not that of an archive.
    StorageError
        When the system refuses, or a file changes meanwhile.
    """
    check_archive(path)
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
        for each in sorted(items, key=lambda each: each.name):
            member = zipfile.ZipInfo(each.name, EARLIEST)
            member.file_size = each.size
            member.external_attr = 0o644 << 16
            # The system that it was made on, which would otherwise be this one.
            member.create_system = 3
            with archive.open(member, "w") as file:
                _copy(each, file)


def _copy(each: CrateFile, file: IO[bytes]) -> None:
    """Write an item's bytes."""
    digest = hashlib.sha256()
    for chunk in _chunks(each.source):
        digest.update(chunk)
        file.write(chunk)
    _check(each, digest.hexdigest())


def _chunks(source: Path | bytes) -> Iterator[bytes]:
    if isinstance(source, bytes):
        yield source
        return
    with source.open("rb") as file:
        while chunk := file.read(CHUNK):
            yield chunk


def _check(each: CrateFile, digest: str) -> None:
    if digest != each.sha256:
        raise StorageError(f"{each.name}: has changed since it was checked; rerun the command")
