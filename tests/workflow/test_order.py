"""A useful part of a sweep is done first."""

import shutil
from pathlib import Path

import pytest
from tiny import snakemake

from softslip.config.scenario import load_scenario

pytestmark = pytest.mark.workflow

STRESSES = [0.2, 0.3, 0.4, 0.5]


def test_ends_of_an_axis_are_done_before_what_lies_between(whole: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(whole, tmp_path / "copy")
    file = folder / "config" / "tiny.yaml"
    file.write_text(f"{file.read_text()}axes:\n  rheometer.stress: {STRESSES}\n")
    results = {
        run.coordinates["stress"]: folder / f"results/tiny/shear/{run.ids['shear']}.nc"
        for run in load_scenario(str(file)).runs()
    }
    made = [stress for stress in results if not results[stress].exists()]
    assert len(made) > 2
    snakemake(folder, "results/tiny/flow_curve.nc")
    order = sorted(made, key=lambda stress: results[stress].stat().st_mtime_ns)
    assert order == [stress for stress in (0.2, 0.5, 0.3, 0.4) if stress in made]
