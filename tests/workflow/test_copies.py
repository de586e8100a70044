"""Results that were copied without their times are reused; what really changed is rerun."""

import os
import random
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import netCDF4
import pytest
from projects import copy_project
from test_spellings import asked, open_runs

from softslip.config.stages import STAGES
from softslip.files.storage import read_dataset, write_dataset

pytestmark = pytest.mark.workflow


def copied(source: Path, target: Path) -> None:
    """Copy files one by one in a random order, without their times."""
    files = [path for path in source.rglob("*") if path.is_file()]
    now = 1_700_000_000
    for number, path in enumerate(random.Random(1).sample(files, len(files))):
        copy = target / path.relative_to(source)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
        os.utime(copy, (now + number,) * 2)


def unpacked(source: Path, target: Path) -> None:
    """Unpack an archive, which gives files the times of unpacking, many of them the same."""
    target.mkdir(parents=True)
    archive = target.with_suffix(".zip")
    with zipfile.ZipFile(archive, "w") as packed:
        for path in sorted(source.rglob("*.*")):
            packed.write(path, path.relative_to(source))
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(target)
    # The order in which files are unpacked is that of the archive.
    for number, path in enumerate(sorted(target.rglob("*.*"))):
        os.utime(path, (1_700_000_000 + number // 7,) * 2)


@pytest.fixture(params=[copied, unpacked])
def folder(whole: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Return a fresh project, without Snakemake's records, with results from elsewhere."""
    copy: Callable[[Path, Path], None] = request.param
    folder = copy_project(tmp_path / "project")
    shutil.copy(whole / "config" / "tiny.yaml", folder / "config")
    copy(whole / "results" / "tiny", folder / "results" / "tiny")
    return folder


def only(folder: Path, stage: str) -> Path:
    (path,) = (folder / "results" / "tiny" / stage).glob("*.nc")
    return path


def rerun(folder: Path) -> set[str]:
    """Return the rules of the stages that a dry run wants."""
    said = asked(folder, "tiny", "--quiet", "rules")[1]
    return set(re.findall(r"^(\w+) +\d+$", said, re.M)) & set(STAGES)


def test_intact_copies_are_reused(folder: Path) -> None:
    assert open_runs(folder, "tiny") == []
    status, said = asked(folder, "tiny")
    assert status == 0, said
    assert "Nothing to be done" in said, said


def test_what_was_made_from_something_else_is_rerun(folder: Path) -> None:
    path = only(folder, "expansion")
    before = path.stat().st_mtime
    dataset = read_dataset(path, stage="expansion")
    changed = dataset.assign_attrs(mean_radius=2 * dataset.attrs["mean_radius"])
    write_dataset(changed, path, stage="expansion", run=path.stem, title="x")
    os.utime(path, (before - 1e6,) * 2)
    assert len(open_runs(folder, "tiny")) == 2
    assert rerun(folder) == {"ageing", "shear"}


def test_what_does_not_say_what_it_was_made_from_goes_by_its_time(folder: Path) -> None:
    with netCDF4.Dataset(only(folder, "ageing"), "a") as file:
        file.delncattr("parents")
    os.utime(only(folder, "ageing"), (1, 1))
    assert len(open_runs(folder, "tiny")) == 2
    assert rerun(folder) == {"ageing", "shear"}
