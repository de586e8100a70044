"""Two axes that nobody has thought of, added in the scenario's file to runs that are finished."""

import csv
import io
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr
from projects import TINY, copy_project
from tiny import snakemake

from softslip.files.products import FIGURES, TABLES

pytestmark = pytest.mark.workflow

RESULTS = Path("results/tiny")

FREE = TINY.replace("0.046875", "0.0625").replace(
    "  packing: {", "  suspension: {area_fraction: 0.6}\n  packing: {area_fraction: 0.4, "
)
"""The tiny scenario with room for bumps that are larger than the particles."""

AXES = """\
axes:
  suspension.area_fraction: [0.5, 0.6]
  wall.roughness: [0.0, 1.5]
"""

Runs = dict[Path, tuple[int, bytes]]


def runs_of(folder: Path) -> Runs:
    """Return time and content of every file that a stage of a run wrote."""
    stages = ("packing", "expansion", "ageing", "shear")
    files = [file for stage in stages for file in (folder / RESULTS / stage).glob("*.nc")]
    return {file: (file.stat().st_mtime_ns, file.read_bytes()) for file in files}


@pytest.fixture(scope="module")
def grown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Runs]:
    """Return a folder in which the axes came after the first run, and what that run wrote."""
    folder = copy_project(tmp_path_factory.mktemp("grown") / "copy")
    scenario = folder / "config" / "tiny.yaml"
    scenario.write_text(FREE)
    snakemake(folder, "all", "--until", "shear")
    first = runs_of(folder)
    scenario.write_text(FREE + AXES)
    snakemake(folder, "all")
    return folder, first


def test_no_finished_run_is_redone(grown: tuple[Path, Runs]) -> None:
    folder, first = grown
    after = runs_of(folder)
    assert len(first) == 4
    assert {file: after[file] for file in first} == first
    assert len(after) == 16


@pytest.mark.parametrize("table", TABLES)
def test_every_dataset_has_both_dimensions(grown: tuple[Path, Runs], table: str) -> None:
    with xr.open_dataset(grown[0] / RESULTS / f"{table}.nc") as data:
        assert data["area_fraction"].values.tolist() == [0.5, 0.6]
        assert data["roughness"].values.tolist() == [0.0, 1.5]
        assert data["status"].dims == ("area_fraction", "roughness")
        assert (data["status"] == "done").all()


@pytest.mark.parametrize("figure", ["fig8", "fig9"])
def test_curves_in_time_are_drawn_for_every_value(grown: tuple[Path, Runs], figure: str) -> None:
    """Of figures that show what runs of half a time unit have."""
    folder = grown[0]
    target = str(RESULTS / "figures" / f"{figure}.png")
    command = [sys.executable, "-m", "softslip", "export", target]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    lines = [line for line in done.stdout.splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(io.StringIO("\n".join(lines))))
    assert {float(row["area_fraction"]) for row in rows} == {0.5, 0.6}


def test_every_figure_is_drawn_and_holds_what_it_shows(grown: tuple[Path, Runs]) -> None:
    folder = grown[0]
    drawn = {file.stem for file in (folder / RESULTS / "figures").glob("*.png")}
    wanted = {name for name, entry in FIGURES.items() if entry.rule == "figure"}
    assert wanted <= drawn
    command = [sys.executable, "-m", "softslip", "verify", "tiny"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
