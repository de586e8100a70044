"""The source distribution and the wheel, built and used without a network and without a clone."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from projects import ROOT, TINY

from softslip.config.scenario import load_scenario
from softslip.operations.project_folder import PARTS, project_files

pytestmark = pytest.mark.workflow


def called(*words: object, folder: Path, site: Path | None = None) -> str:
    """Run a module of this Python to a good end, with a folder's packages before others."""
    variables = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    if site is not None:
        variables["PYTHONPATH"] = str(site)
    command = [sys.executable, "-m", *map(str, words)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=variables)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def archives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return the source distribution, and the wheel that is built from nothing but it."""
    out = tmp_path_factory.mktemp("archives")
    called("hatchling", "build", "-t", "sdist", "-d", out, folder=ROOT)
    (source,) = out.glob("*.tar.gz")
    # tarfile's `filter` came with Python 3.11.4; Debian 12 has 3.11.2.
    shutil.unpack_archive(source, out)
    (unpacked,) = (path for path in out.iterdir() if path.is_dir())
    called("hatchling", "build", "-t", "wheel", "-d", out, folder=unpacked)
    (wheel,) = out.glob("*.whl")
    return source, wheel


@pytest.fixture(scope="module")
def site(archives: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder that the wheel is installed in; its dependencies are those of the tests."""
    folder = tmp_path_factory.mktemp("site")
    words = ("install", "--quiet", "--no-index", "--no-deps", "--target", folder, archives[1])
    called("pip", *words, folder=folder)
    return folder


def test_the_wheel_has_the_package_and_the_workflow_and_no_more(
    archives: tuple[Path, Path],
) -> None:
    with zipfile.ZipFile(archives[1]) as packed:
        names = {name for name in packed.namelist() if ".dist-info/" not in name}
        inside = {name: packed.read(name) for name in names}
    own = {
        f"softslip/{path.relative_to(ROOT / 'src' / 'softslip').as_posix()}"
        for path in (ROOT / "src" / "softslip").rglob("*.*")
        if "__pycache__" not in path.parts
    }
    copies = {f"softslip/project/{name}" for name in project_files()}
    assert names == own | copies
    for name in copies:
        assert inside[name] == (ROOT / name.removeprefix("softslip/project/")).read_bytes(), name


def test_the_source_distribution_has_what_a_clone_has(archives: tuple[Path, Path]) -> None:
    with tarfile.open(archives[0]) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    for name in ("README.md", "LICENSE", "requirements.lock", "Makefile", "tests/conftest.py"):
        assert name in names
    assert not [name for name in names if name.startswith((".venv", ".git/", "results/demo"))]


def test_an_installed_package_writes_the_project_and_runs_it(site: Path, tmp_path: Path) -> None:
    where = called("softslip", "--help", folder=tmp_path, site=site)
    assert "init" in where
    said = called("softslip", "init", "mine", folder=tmp_path, site=site)
    assert "cd mine\n" in said
    project = tmp_path / "mine"
    assert sorted(path.name for path in project.iterdir()) == sorted(PARTS)
    (project / "config" / "tiny.yaml").write_text(TINY)
    (run,) = load_scenario(str(project / "config" / "tiny.yaml")).stage_table("packing")
    packing = f"results/tiny/packing/{run}.nc"
    words = ("--cores", 1, "--config", "scenario=tiny", "--", packing)
    called("snakemake", *words, folder=project, site=site)
    trace = called("softslip", "trace", packing, folder=project, site=site)
    assert "commit unknown" in trace or "unknown" in trace


def test_the_package_that_was_used_is_the_installed_one(site: Path, tmp_path: Path) -> None:
    code = "import softslip, sys; sys.stdout.write(softslip.__file__)"
    variables = {**os.environ, "PYTHONPATH": str(site)}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=variables)
    assert Path(done.stdout).is_relative_to(site)
