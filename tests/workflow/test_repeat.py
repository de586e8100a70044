"""The whole reduced demo, twice."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr
from projects import ROOT, copy_project

from softslip.config.scenario import load_scenario
from softslip.files.expected_results import expected_results
from softslip.files.stamps import check_figure
from softslip.files.storage import CONTENT_DIGEST

pytestmark = [pytest.mark.workflow, pytest.mark.slow]


def run(folder: Path, **settings: str) -> dict[Path, xr.Dataset]:
    """Run the scenario ci in a copy of the workflow; return every dataset by its path."""
    copy_project(folder)
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--config", "scenario=ci"]
    environment = {**os.environ, **settings}
    subprocess.run(command, cwd=folder, check=True, capture_output=True, env=environment)
    files = sorted(folder.glob("results/ci/**/*.nc"))
    return {path.relative_to(folder): xr.load_dataset(path) for path in files}


def test_the_same_scenario_gives_the_same_bytes(tmp_path: Path) -> None:
    """In two places, two time zones and two languages."""
    first = run(tmp_path / "first", TZ="UTC", LC_ALL="C.UTF-8")
    second = run(tmp_path / "second", TZ="Asia/Kathmandu", LC_ALL="tr_TR.UTF-8")
    assert first.keys() == second.keys()
    expected = {each.name for each in expected_results(load_scenario(str(ROOT / "config/ci.yaml")))}
    data = {name for name in expected if name.endswith(".nc")}
    assert {path.relative_to("results/ci").as_posix() for path in first} == data
    for path, dataset in first.items():
        for name, variable in dataset.variables.items():
            other = second[path].variables[name]
            assert variable.dtype == other.dtype, f"{path}: {name} has another type"
            if variable.dtype.kind in "fiub":
                same = variable.values.tobytes() == other.values.tobytes()
            else:
                same = bool((variable.values == other.values).all())
            assert same, f"{path}: {name} differs"
        assert dataset.attrs[CONTENT_DIGEST] == second[path].attrs[CONTENT_DIGEST], f"{path}"
    results = tmp_path / "first" / "results" / "ci"
    figures = sorted([*results.glob("figures/**/*.png"), results / "explorer.html"])
    assert len(figures) == len(expected - data)
    for figure in figures:
        twin = tmp_path / "second" / figure.relative_to(tmp_path / "first")
        contents = [check_figure(path)[CONTENT_DIGEST] for path in (figure, twin)]
        assert contents[0] == contents[1], f"{figure.name} differs"
