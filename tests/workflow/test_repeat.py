"""The whole reduced demo, twice."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

ROOT = Path(__file__).parents[2]

pytestmark = [pytest.mark.workflow, pytest.mark.slow]


def run(folder: Path) -> dict[Path, xr.Dataset]:
    """Run the scenario ci in a copy of the workflow; return every dataset by its path."""
    for name in ("workflow", "config", "profiles"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "Snakefile", folder)
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--config", "scenario=ci"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    files = sorted(folder.glob("results/ci/**/*.nc"))
    return {path.relative_to(folder): xr.load_dataset(path) for path in files}


def test_the_same_scenario_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second = (run(tmp_path / name) for name in ("first", "second"))
    assert first.keys() == second.keys()
    assert len(first) == 14, f"2 packings, expansions, ageings; 4 shears; 4 tables: {list(first)}"
    for path, dataset in first.items():
        for name, variable in dataset.variables.items():
            other = second[path].variables[name]
            assert variable.dtype == other.dtype, f"{path}: {name} has another type"
            if variable.dtype.kind in "fiub":
                same = variable.values.tobytes() == other.values.tobytes()
            else:
                same = bool((variable.values == other.values).all())
            assert same, f"{path}: {name} differs"
    figures = sorted((tmp_path / "first").glob("results/ci/figures/**/*.png"))
    assert len(figures) == 7
    for figure in figures:
        twin = tmp_path / "second" / figure.relative_to(tmp_path / "first")
        assert figure.read_bytes() == twin.read_bytes(), f"{figure.name} differs"
