"""One scenario under any spelling is one scenario, and two of one name are not."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from projects import TINY

from softslip.config.scenario import load_scenario
from softslip.provenance.scenario_file import OUTSIDE, noted_file

pytestmark = pytest.mark.workflow

MODULE = """\
module softslip:
    snakefile: "workflow/Snakefile"
    config: {"scenario": "config/tiny.yaml", "checkpoint": 7}


use rule * from softslip as softslip_*
"""

SPELLINGS = {
    "name": "tiny",
    "path": "config/tiny.yaml",
    "dots": "results/../config/./tiny.yaml",
    "absolute": "{folder}/config/tiny.yaml",
    "link": "{folder}/link/tiny.yaml",
    "copy": "elsewhere/tiny.yaml",
}


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """Return a project with results, and a link to and a copy of its scenario."""
    folder = shutil.copytree(whole, tmp_path / "project")
    for name in ("link", "elsewhere"):
        (folder / name).mkdir()
    (folder / "link" / "tiny.yaml").symlink_to("../config/tiny.yaml")
    shutil.copy(folder / "config" / "tiny.yaml", folder / "elsewhere")
    return folder


def called(folder: Path, *words: str) -> tuple[int, str]:
    command = [sys.executable, "-m", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def asked(folder: Path, scenario: str, *words: str) -> tuple[int, str]:
    """Return exit status and words of a dry run for a scenario."""
    settings = ("--config", f"scenario={scenario}", *words)
    return called(folder, "snakemake", "--cores", "1", "--dry-run", *settings)


def open_runs(folder: Path, scenario: str) -> list[str]:
    """Return what is to be done by the plan."""
    status, said = called(folder, "softslip", "plan", scenario, "--json")
    assert status == 0, said
    return [
        run["run"] for run in json.loads(said)["runs"] if run["action"] not in ("reuse", "skip")
    ]


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_no_spelling_of_a_scenario_reruns_anything(folder: Path, spelling: str) -> None:
    name = SPELLINGS[spelling].format(folder=folder)
    status, said = asked(folder, name)
    assert status == 0, said
    assert "Nothing to be done" in said, said
    assert open_runs(folder, name) == []


def test_seconds_between_checkpoints_rerun_nothing(folder: Path) -> None:
    assert "Nothing to be done" in asked(folder, "tiny", "checkpoint=5")[1]


def test_a_module_reruns_nothing(folder: Path) -> None:
    (folder / "own.smk").write_text(MODULE)
    words = ("--snakefile", "own.smk", "--dry-run", "softslip_all")
    status, said = called(folder, "snakemake", "--cores", "1", *words)
    assert status == 0, said
    assert "Nothing to be done" in said, said


def other(folder: Path, where: str) -> Path:
    """Write another scenario of the same name."""
    path = folder / where
    path.parent.mkdir(exist_ok=True)
    path.write_text(TINY + "axes:\n  rheometer.stress: [0.11, 0.12]\n")
    return path


@pytest.mark.parametrize("place", ["elsewhere/tiny.yaml", "../outside/tiny.yaml"])
def test_another_scenario_of_the_name_is_refused(folder: Path, place: str) -> None:
    other(folder, place)
    before = {path: path.read_bytes() for path in folder.glob("results/**/*.nc")}
    for words in (
        ("snakemake", "--cores", "1", "--config", f"scenario={place}"),
        ("softslip", "plan", place),
        ("softslip", "gather", "creep", place, "--output", "results/tiny/creep.nc"),
    ):
        status, said = called(folder, *words)
        assert status != 0, said
        assert "which is of another scenario of that name, in config/tiny.yaml" in said
        assert "rename one of the two files" in said
        assert "Traceback" not in said
    assert {path: path.read_bytes() for path in folder.glob("results/**/*.nc")} == before


def test_tables_may_be_deleted_for_another_scenario_of_the_name(folder: Path) -> None:
    """As the refusal says."""
    other(folder, "elsewhere/tiny.yaml")
    for table in ("flow_curve", "creep", "profiles", "structure"):
        (folder / "results" / "tiny" / f"{table}.nc").unlink()
    assert asked(folder, "elsewhere/tiny.yaml")[0] == 0


def test_a_scenario_may_be_edited(folder: Path) -> None:
    other(folder, "config/tiny.yaml")
    status, said = asked(folder, "tiny")
    assert status == 0, said
    assert len(open_runs(folder, "tiny")) == 2


def test_a_project_may_be_moved_with_the_scenarios_beside_it(folder: Path, tmp_path: Path) -> None:
    moved = folder.rename(tmp_path / "moved")
    other(moved, "config/tiny.yaml")
    assert asked(moved, "tiny")[0] == 0


def test_no_path_outside_the_project_is_noted(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "inside").mkdir()
    monkeypatch.chdir(tmp_path / "inside")
    (tmp_path / "tiny.yaml").write_text(TINY)
    (tmp_path / "inside" / "tiny.yaml").write_text(TINY)
    notes: Sequence[str] = [
        noted_file(load_scenario(name))
        for name in (
            "../tiny.yaml",
            f"{tmp_path}/tiny.yaml",
            "tiny.yaml",
            f"{os.getcwd()}/tiny.yaml",
        )
    ]
    assert notes[0] == notes[1]
    assert notes[0].startswith(OUTSIDE)
    assert str(tmp_path.name) not in notes[0]
    assert notes[2:] == ["tiny.yaml"] * 2


def test_two_settings_options_are_refused(folder: Path) -> None:
    words = ("--config", "scenario=tiny", "--config", "checkpoint=5")
    status, said = called(folder, "snakemake", "--cores", "1", "--dry-run", *words)
    assert status != 0
    assert "--config: is given more than once" in said


@pytest.mark.parametrize(
    "target", ["shear/{run}.nc", "packing/{run}.nc", "figures/snapshots/{run}.png"]
)
def test_a_run_that_the_scenario_does_not_have_is_refused(folder: Path, target: str) -> None:
    path = f"results/tiny/{target.format(run='0' * 16)}"
    for word in (path, f"./{path}", f"{folder}/{path}"):
        words = ("--config", "scenario=tiny", "--", word)
        status, said = called(folder, "snakemake", "--cores", "1", "--dry-run", *words)
        assert status != 0
        assert "is no run of scenario tiny; list them with: softslip runs tiny" in said, said
        assert "Traceback" not in said
