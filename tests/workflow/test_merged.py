"""Results of several machines merge by plain copying."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from projects import TINY, copy_project
from test_spellings import open_runs
from tiny import snakemake

from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.files.labels import text_attributes
from softslip.files.storage import CONTENT_DIGEST

pytestmark = pytest.mark.workflow

PARTS = TINY + "axes:\n  rheometer.stress: [0.15, 0.5]\n"
"""Two runs that share all stages but the last: both machines compute those."""


def machine(folder: Path, part: int) -> Path:
    """Return a project in which one of the runs was computed."""
    copy_project(folder)
    (folder / "config" / "tiny.yaml").write_text(PARTS)
    run = load_scenario(str(folder / "config" / "tiny.yaml")).runs()[part].ids["shear"]
    snakemake(folder, f"results/tiny/shear/{run}.nc")
    return folder


def contents(folder: Path) -> dict[str, str]:
    """Return the content digest of each dataset."""
    return {
        str(path.relative_to(folder)): text_attributes(path, (CONTENT_DIGEST,))[CONTENT_DIGEST]
        for stage in STAGES
        for path in (folder / "results" / "tiny" / stage).glob("*.nc")
    }


def test_results_of_two_machines_merge_by_copying(tmp_path: Path) -> None:
    machines = [machine(tmp_path / f"machine{part}", part) for part in (0, 1)]
    parts = [contents(folder) for folder in machines]
    merged = copy_project(tmp_path / "merged")
    shutil.copy(machines[0] / "config" / "tiny.yaml", merged / "config")
    for folder in machines:
        # As `cp --recursive` does: the times are those of copying, and files of both are replaced.
        subprocess.run(["cp", "--recursive", folder / "results", merged], check=True)
    assert contents(merged) == parts[0] | parts[1]
    shared = set(parts[0]) & set(parts[1])
    assert {path.split("/")[2] for path in shared} == set(STAGES[:-1])
    assert {path: parts[0][path] for path in shared} == {path: parts[1][path] for path in shared}
    assert open_runs(merged, "tiny") == []
    before = contents(merged)
    said = snakemake(merged, "results/tiny/fits.nc")
    assert "Fitting" in said
    for message in ("Packing", "Growing", "Ageing", "Shearing"):
        assert message not in said, said
    assert contents(merged) == before
    words = (sys.executable, "-m", "softslip", "verify", "tiny")
    done = subprocess.run(words, cwd=merged, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
