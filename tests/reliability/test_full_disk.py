"""Disks that are full, files that may not grow and folders that may not be written in."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from chain import FIGURE, KEPT, STAGES, Chain, contents, files

from softslip.simulation.checkpoint import SUFFIX

pytestmark = pytest.mark.reliability

ALL = (*STAGES, FIGURE)
REFUSALS = "StorageError|LockedError"
PAGE = 4096
ROOM = 1 << 20

SIZES = [pytest.param(stage, 2, id=f"{stage}-few") for stage in ("expansion", "ageing", FIGURE)] + [
    pytest.param(stage, 24, id=f"{stage}-many", marks=pytest.mark.slow) for stage in ALL
]


def with_results(chain: Chain, folder: Path, stage: str) -> dict[Path, bytes]:
    """Put an earlier result of a stage, and two generations of checkpoints, into a folder."""
    target = chain.output(folder, stage)
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(chain.output(chain.folder, stage), target)
    if stage in KEPT:
        death = {"die_with_checkpoints": {"folder": str(folder), "number": 2}}
        chain.run(folder, stage, "--checkpoint-interval", 0, sabotage=death)
        assert len(list(folder.rglob(f"*{SUFFIX}"))) == 2
    return contents(folder)


def copied(folder: Path, target: Path) -> None:
    """Copy a folder with what was put into it."""
    shutil.copytree(folder, target, dirs_exist_ok=True)


def sizes_below(most: int, count: int) -> list[int]:
    """Return sizes from 0 up, about equally spaced, the smallest ones among them."""
    spaced = np.linspace(0, most, count).astype(int).tolist()
    return sorted({0, *spaced, *([1, 100, 1000] if count > 10 else [])})


def check_refused(chain: Chain, folder: Path, stage: str, before: dict[Path, bytes], outcome):
    """What could not be written is said in one line, and what was there is there."""
    said = outcome.refusal(REFUSALS)
    assert str(folder) in said
    after = contents(folder)
    for path, content in before.items():
        if path.suffix != SUFFIX:
            assert after[path] == content, f"{path} has changed"
    assert not list(folder.rglob("*.part")), "a part of a file is left"
    kept = [path for path in before if path.suffix == SUFFIX]
    assert sum(path in after for path in kept) == len(kept), "a checkpoint is lost"
    chain.check_folder(folder, stage, deaths=0)


@pytest.mark.parametrize(("stage", "count"), SIZES)
def test_a_file_that_may_not_grow(
    chain: Chain, tmp_path: Path, tally, stage: str, count: int
) -> None:
    """The limit may strike a checkpoint or, where none is due, the result."""
    counts = tally("limits of file sizes")
    before = with_results(chain, tmp_path / "before", stage)
    # What a file says of its making may take some bytes more another time.
    largest = max(map(len, before.values())) + 256
    for size in sizes_below(largest, count):
        for interval in (0, 1e6) if stage in KEPT else (None,):
            words = () if interval is None else ("--checkpoint-interval", interval)
            folder = tmp_path / f"{size} {interval}"
            copied(tmp_path / "before", folder)
            limited = {"limit_size": {"size": size, "packed": stage == "packing"}}
            outcome = chain.run(folder, stage, *words, sabotage=limited)
            if outcome.status == 0:
                chain.check_result(folder, stage)
                counts["fitted"] += 1
            else:
                check_refused(chain, folder, stage, before, outcome)
                counts["refused"] += 1
            chain.finish(folder, stage, *words)
            shutil.rmtree(folder)
    assert counts["refused"] >= 1
    assert counts["fitted"] >= 1


@contextmanager
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Mount a disk of one mebibyte, or skip the test where that is not allowed."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={ROOM}", "none", str(place)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no disk can be mounted here ({error})")
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def fill(disk: Path, free: int) -> None:
    """Leave so many pages of a disk free."""
    (disk / "filler").unlink(missing_ok=True)
    room = os.statvfs(disk)
    with (disk / "filler").open("wb") as file:
        file.write(bytes(max(room.f_bavail * room.f_bsize // PAGE - free, 0) * PAGE))


@pytest.mark.parametrize(("stage", "count"), SIZES)
def test_a_disk_that_is_full(chain: Chain, tmp_path: Path, tally, stage: str, count: int) -> None:
    counts = tally("free pages of a full disk")
    before = with_results(chain, tmp_path / "before", stage)
    needed = sum(map(len, before.values())) // PAGE + 4
    with small_disk(tmp_path) as disk:
        for free in sizes_below(needed, count):
            if free > needed:
                continue
            for interval in (0, 1e6) if stage in KEPT else (None,):
                words = () if interval is None else ("--checkpoint-interval", interval)
                folder = disk / "run"
                copied(tmp_path / "before", folder)
                fill(disk, free)
                outcome = chain.run(folder, stage, *words)
                if outcome.status == 0:
                    chain.check_result(folder, stage)
                    counts["fitted"] += 1
                else:
                    check_refused(chain, folder, stage, before, outcome)
                    counts["refused"] += 1
                (disk / "filler").unlink()
                chain.finish(folder, stage, *words)
                shutil.rmtree(folder)
    assert counts["refused"] >= 1
    assert counts["fitted"] >= 1


@pytest.fixture
def common_folder() -> Iterator[Path]:
    """Return a folder that every user can look into."""
    folder = Path(tempfile.mkdtemp(prefix="softslip-reliability-"))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


@pytest.mark.parametrize("place", ["folder", "checkpoints"])
@pytest.mark.parametrize("stage", ALL)
def test_a_folder_that_may_not_be_written_in(
    chain: Chain, common_folder: Path, tally, stage: str, place: str
) -> None:
    if stage == FIGURE and place == "checkpoints":
        pytest.skip("a figure is not locked and has no checkpoints")
    if os.getuid() and place == "folder":
        pytest.skip("the folder would be that of the user who runs the tests")
    common = Chain(**vars(chain) | {"folder": common_folder / "whole"})
    common.scenario = Path(shutil.copy(chain.scenario, common_folder))
    for path in files(chain.folder):
        copy = common.folder / path.relative_to(chain.folder)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
    folder = common_folder / "run"
    target = common.output(folder, stage).parent
    target.mkdir(parents=True)
    sabotage = {"become_nobody": {}} if os.getuid() == 0 else {}
    if place == "checkpoints":
        target.chmod(0o777)
        (target / "checkpoints").mkdir(mode=0o555)
        (target / "checkpoints").chmod(0o555)
    else:
        target.chmod(0o555)
    outcome = common.run(folder, stage, sabotage=sabotage)
    assert "ermission denied" in outcome.refusal(REFUSALS)
    assert not list(files(folder))
    tally("folders without permission")["refused"] += 1


@pytest.mark.parametrize("stage", ALL)
def test_a_file_where_a_folder_should_be(chain: Chain, tmp_path: Path, tally, stage: str) -> None:
    target = chain.output(tmp_path, stage).parent
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text("in the way")
    outcome = chain.run(tmp_path, stage)
    outcome.refusal(f"{REFUSALS}|ConfigError")
    assert target.read_text() == "in the way"
    tally("files in place of folders")["refused"] += 1
