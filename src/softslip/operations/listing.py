"""The files of a stage, listed once and not opened."""

import os
import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from softslip.errors import DatasetError
from softslip.files.layout import CHECKPOINTS, DATASET

PART_AGE = 86400.0
"""Seconds after which a file that was never completed is abandoned."""

_RUN = re.compile(r"[0-9a-f]+")
_PART = re.compile(r"\.(?:([0-9a-f]{16})\.)?.+\.part")


@dataclass(frozen=True)
class ListedFile:
    """A file as its folder lists it.

    Attributes
    ----------
    path, size
        Where it is, and its bytes.
    changed
        POSIX time of writing.
    """

    path: Path
    size: int
    changed: float

    @property
    def is_abandoned(self) -> bool:
        """Whether it was begun more than `PART_AGE` ago and never completed."""
        return bool(_PART.fullmatch(self.path.name)) and time.time() - self.changed > PART_AGE

    @property
    def part_of(self) -> str:
        """The run that an incomplete file is of, empty where its name says none."""
        name = _PART.fullmatch(self.path.name)
        return (name and name[1]) or ""


@dataclass(frozen=True)
class StageFiles:
    """The files of one stage.

    Attributes
    ----------
    folder, beside
        Folder of checkpoints and locks, and the files in it.
    datasets
        By their runs.
    abandoned
        Incomplete files of both folders.
    """

    folder: Path
    beside: tuple[ListedFile, ...]
    datasets: Mapping[str, ListedFile]
    abandoned: tuple[ListedFile, ...]

    def with_suffix(self, suffix: str) -> dict[str, ListedFile]:
        """Return the files beside the datasets that end so, by the runs that name them."""
        names = {file.path.name.removesuffix(suffix): file for file in self.beside}
        return {
            run: file
            for run, file in names.items()
            if _RUN.fullmatch(run) and file.path.name != run
        }


def stage_files(results: Path, stage: str) -> StageFiles:
    """Return the files of a stage.

    Parameters
    ----------
    results
        Folder of the scenario's results.
    stage
        Which stage it is.

    Raises
    ------
    DatasetError
        When a folder cannot be read.
    """
    # A run that ends meanwhile writes its dataset and then removes its checkpoints: seen in this
    # order it is never missing.
    folder = results / stage / CHECKPOINTS
    beside = tuple(list_files(folder))
    files = tuple(list_files(results / stage))
    return StageFiles(
        folder,
        beside,
        {file.path.stem: file for file in files if file.path.suffix == DATASET},
        tuple(file for file in files + beside if file.is_abandoned),
    )


def list_files(folder: Path) -> Iterator[ListedFile]:
    """Yield the files of a folder, which need not be there; files may vanish meanwhile."""
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                try:
                    if entry.is_file():
                        stat = entry.stat()
                        yield ListedFile(Path(entry.path), stat.st_size, stat.st_mtime)
                except FileNotFoundError:
                    continue
    except FileNotFoundError:
        return
    except OSError as error:
        raise DatasetError(f"{folder}: cannot be read ({error.strerror})") from error
