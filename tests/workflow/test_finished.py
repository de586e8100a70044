"""Tables and figures of the runs that are done, of a sweep that is not finished."""

import shutil
from pathlib import Path

import pytest
import xarray as xr
from tiny import snakemake

pytestmark = pytest.mark.workflow

FINISHED = ("finished=true",)


@pytest.fixture
def sweep(whole: Path, tmp_path: Path) -> Path:
    """Return a copy of a finished project whose scenario has two more stresses since."""
    folder = shutil.copytree(whole, tmp_path / "copy")
    file = folder / "config" / "tiny.yaml"
    file.write_text(f"{file.read_text()}axes:\n  rheometer.stress: [0.2, 0.3, 0.4]\n")
    return folder


def shears(folder: Path) -> set[Path]:
    return set((folder / "results" / "tiny" / "shear").glob("*.nc"))


def states(folder: Path) -> list[str]:
    """Return what the flow curve says of its runs, in the order of letters."""
    return sorted(xr.load_dataset(folder / "results/tiny/flow_curve.nc")["status"].values)


def test_what_is_done_is_shown_and_nothing_else_begun(sweep: Path) -> None:
    before = shears(sweep)
    assert len(before) == 1
    snakemake(sweep, "all", config=FINISHED)
    assert shears(sweep) == before
    there = {path.stem for path in before}
    assert states(sweep) == ["done", "missing", "missing"]
    assert {path.stem for path in (sweep / "results/tiny/figures/snapshots").iterdir()} == there
    assert (sweep / "results" / "tiny" / "explorer.html").exists()


def test_the_rest_is_made_later(sweep: Path) -> None:
    snakemake(sweep, "results/tiny/flow_curve.nc", config=FINISHED)
    snakemake(sweep, "results/tiny/flow_curve.nc")
    assert states(sweep) == ["done", "done", "done"]
    assert len(shears(sweep)) == 3


def test_where_nothing_is_done_it_says_so(sweep: Path) -> None:
    for path in shears(sweep):
        path.unlink()
    with pytest.raises(AssertionError, match="no run of tiny is done; leave it out"):
        snakemake(sweep, "all", config=FINISHED)


@pytest.mark.parametrize("given", ["1", "some"])
def test_what_is_neither_true_nor_false_is_refused(sweep: Path, given: str) -> None:
    with pytest.raises(AssertionError, match=f"finished={given}: is neither true nor false"):
        snakemake(sweep, "all", config=(f"finished={given}",))
