import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import softslip
from softslip.solver import compilation
from softslip.solver.compilation import source_digest

PACKAGE = Path(softslip.__file__).parent

SPREAD = """
import numpy as np
from softslip.solver.transfer import spread_across
density = np.zeros(16)
spread_across(np.array([0.301]), np.array([1.0]), 0.05, density)
print(density.sum())
"""


def spread(folder):
    """Sum of a spread force by the package in a folder, in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    environment.pop("NUMBA_CACHE_DIR", None)
    found = subprocess.run(
        [sys.executable, "-c", SPREAD], env=environment, capture_output=True, text=True, check=True
    )
    return float(found.stdout)


def test_a_change_of_a_function_reaches_those_that_it_is_compiled_into(tmp_path):
    """Numba alone would go on with what it compiled before the change."""
    shutil.copytree(PACKAGE, tmp_path / "softslip", ignore=shutil.ignore_patterns("__pycache__"))
    assert abs(spread(tmp_path) - 20) < 1e-12
    kernels = tmp_path / "softslip" / "solver" / "kernels.py"
    source = kernels.read_text()
    changed = source.replace("weights[1] = 0.25 - q", "weights[1] = 0.35 - q")
    assert changed != source
    kernels.write_text(changed)
    assert abs(spread(tmp_path) - 22) < 1e-12


def test_the_digest_is_that_of_the_source_of_all_kernels(tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    assert source_digest(copy) == source_digest()
    (copy / "analysis" / "figures" / "drawing.py").write_text("# nothing is compiled here\n")
    assert source_digest(copy) == source_digest()
    # Kernels contain constants of modules that have no kernel, such as the last of these.
    for module in ("solver/membrane.py", "simulation/growth.py", "solver/mobility/blob.py"):
        before = source_digest(copy)
        path = copy / module
        path.write_text(path.read_text() + "\n")
        assert source_digest(copy) != before, module


def test_every_module_with_kernels_is_counted():
    """Kernels are made by what two modules of the solver define, and by no other way."""
    for path in PACKAGE.rglob("*.py"):
        source = path.read_text()
        if re.search(
            r"^@(compiled|compiled_exactly|intrinsic)$|\bnb\.njit\b", source, re.MULTILINE
        ):
            inside = path.is_relative_to(PACKAGE / "solver")
            assert inside or "from softslip.solver.compilation import" in source, path


def cache_of(**settings):
    """Return the folder that a process with some settings of numba keeps compiled functions in."""
    code = "import numba; import softslip.solver.compilation; print(numba.config.CACHE_DIR)"
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE.parent), **settings}
    line = [sys.executable, "-c", code]
    return subprocess.run(line, env=environment, capture_output=True, check=True).stdout


@pytest.mark.parametrize(
    "setting",
    ["NUMBA_OPT=1", "NUMBA_LOOP_VECTORIZE=0", "NUMBA_SLP_VECTORIZE=1", "NUMBA_BOUNDSCHECK=1"],
)
def test_what_was_compiled_under_other_settings_is_not_used(setting):
    """Numba does not look at them, and kernels compiled under them give other last digits."""
    name, _, value = setting.partition("=")
    assert cache_of(**{name: value}) != cache_of()


def test_the_number_of_threads_compiles_nothing_again():
    assert cache_of(NUMBA_NUM_THREADS="1") == cache_of()


@pytest.fixture
def nowhere(monkeypatch, tmp_path):
    """Return a folder for temporary files, where no other may be written."""
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", "/proc/none")
    monkeypatch.setattr(compilation, "_PACKAGE", Path("/proc/none"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def test_without_a_writable_folder_compiled_functions_are_stored_in_a_temporary_one(
    nowhere, capsys
):
    folder = compilation.cache_folder()
    assert folder.parent == nowhere
    assert folder.stat().st_mode & 0o777 == 0o700
    assert "set NUMBA_CACHE_DIR" in capsys.readouterr().err
    assert compilation.cache_folder() == folder


def test_a_temporary_folder_that_others_may_write_is_not_used(nowhere):
    folder = compilation.cache_folder()
    folder.chmod(0o777)
    assert compilation.cache_folder() != folder


def test_a_user_without_a_home_has_a_temporary_folder(nowhere, monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    assert compilation.cache_folder().parent == nowhere


def test_a_folder_that_is_named_but_may_not_be_written_is_passed_over(nowhere, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/proc/none/cache")
    assert compilation.cache_folder().parent == nowhere


def test_the_solver_runs_where_nothing_but_temporary_files_may_be_written(tmp_path):
    """As in containers with arbitrary users."""
    shutil.copytree(PACKAGE, tmp_path / "softslip", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "softslip" / "__pycache__").write_text("in the way")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "HOME": "/proc/none"}
    environment["TMPDIR"] = str(tmp_path)
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        environment.pop(name, None)
    found = subprocess.run(
        [sys.executable, "-c", SPREAD], env=environment, capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr
    assert "set NUMBA_CACHE_DIR" in found.stderr
    assert abs(float(found.stdout) - 20) < 1e-12
