import os
import shutil
import subprocess
import sys
from pathlib import Path

import softslip
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
    (copy / "analysis" / "figures" / "drawing.py").write_text("# no kernel\n")
    assert source_digest(copy) == source_digest()
    membrane = copy / "solver" / "membrane.py"
    membrane.write_text(membrane.read_text() + "\n")
    assert source_digest(copy) != source_digest()
