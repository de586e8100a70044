"""Runs and code have the same names in any place, language, time zone and process."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from projects import copy_project

import softslip

NAMES = """
import json, sys
from softslip.provenance import fingerprints
from softslip.config import scenario as sweep

scenarios = {name: sweep.load_scenario(name) for name in ("ci", "demo", "paper")}
runs = {name: [dict(run.ids) for run in each.runs()] for name, each in scenarios.items()}
print(json.dumps([str(fingerprints.FOLDER), runs, fingerprints.fingerprints()]))
"""

PLACES = [
    {"TZ": "UTC", "LC_ALL": "C", "PYTHONHASHSEED": "0"},
    {"TZ": "Asia/Kathmandu", "LC_ALL": "tr_TR.UTF-8", "PYTHONHASHSEED": "1", "PYTHONUTF8": "1"},
    {"TZ": "America/St_Johns", "LC_ALL": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8"},
]


def names(folder: Path, settings: dict[str, str]) -> tuple[str, object, object]:
    """Return where the package was found, all run IDs and all fingerprints, in a clone."""
    copy_project(folder)
    package = shutil.copytree(Path(softslip.__file__).parent, folder / "src" / "softslip")
    environment = {**os.environ, "PYTHONPATH": str(package.parent), **settings}
    command = [sys.executable, "-c", NAMES]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    where, runs, code = json.loads(done.stdout)
    assert where == str(package)
    return where, runs, code


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, object, object]:
    return names(tmp_path_factory.mktemp("here") / "clone", PLACES[0])


@pytest.mark.parametrize("settings", PLACES[1:], ids=["Nepal", "Newfoundland"])
def test_two_clones_give_the_same_names(
    here: tuple[str, object, object], tmp_path: Path, settings: dict[str, str]
) -> None:
    there = names(tmp_path / "a folder with spaces", settings)
    assert there[0] != here[0]
    assert there[1:] == here[1:]
