"""The compiled loops: within their arrays, right without a compiler, the same from any cache."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from chain import ROOT, STAGES, Chain

from softslip.storage import CONTENT_DIGEST

pytestmark = [pytest.mark.reliability, pytest.mark.slow]

KERNELS = (
    "chains",
    "contacts",
    "crossing",
    "growth",
    "integrators",
    "kernels",
    "membrane",
    "mobility_grid",
    "mobility_near",
    "mobility_quadrature",
    "mobility_rest",
    "mobility_window",
    "neighbours",
    "steric",
    "transfer",
)
"""Tests of the modules with compiled loops."""

INTERPRETED = KERNELS
"""Those of them that take minutes at most without a compiler."""


def run_tests(names: tuple[str, ...], **environment: str) -> int:
    """Run the fast tests of some modules; return how many passed."""
    paths = [str(ROOT / "tests" / f"test_{name}.py") for name in names]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *paths]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-5000:]
    return int(done.stdout.splitlines()[-1].split()[0])


@pytest.mark.parametrize("name", KERNELS)
def test_no_loop_leaves_its_arrays(tmp_path_factory, tally, name: str) -> None:
    cache = tmp_path_factory.getbasetemp() / "checked"
    checked = {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(cache)}
    tally("tests with bounds checked")["passed"] += run_tests((name,), **checked)


@pytest.mark.parametrize("name", INTERPRETED)
def test_loops_are_right_without_a_compiler(tmp_path, tally, name: str) -> None:
    plain = {"NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    tally("tests without a compiler")["passed"] += run_tests((name,), **plain)


def start(chain: Chain, folder: Path, stage: str, cache: Path) -> subprocess.Popen:
    """Start a stage in a fresh process with a cache of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "softslip", *chain.words(folder, stage)],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache), "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def digest(chain: Chain, folder: Path, stage: str, cache: Path) -> str:
    """Run a stage and return what comes out."""
    assert start(chain, folder, stage, cache).wait() == 0
    with xr.open_dataset(chain.output(folder, stage)) as dataset:
        return str(dataset.attrs[CONTENT_DIGEST])


@pytest.mark.parametrize("stage", STAGES[1:])
def test_an_empty_cache_gives_the_same_bytes(
    chain: Chain, tmp_path: Path, tally, stage: str
) -> None:
    cache = tmp_path / "cache"
    for turn, state in enumerate(("empty", "filled")):
        assert digest(chain, tmp_path / f"{turn}", stage, cache) == chain.digests[stage]
        tally("caches of compiled loops")[state] += 1
    assert list(cache.rglob("*.nbi")), "nothing was cached there"


def test_a_cache_is_whole_after_kills(chain: Chain, tmp_path: Path, tally) -> None:
    """Whoever is killed while compiling leaves nothing that spoils what others compute."""
    random, cache = np.random.default_rng(np.random.SeedSequence([8])), tmp_path / "cache"
    counts = tally("caches of compiled loops")
    for turn in range(8):
        process = start(chain, tmp_path / f"{turn}", "expansion", cache)
        try:
            process.wait(timeout=random.uniform(3, 20))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()
            counts["killed"] += 1
    assert counts["killed"] > 0
    assert digest(chain, tmp_path / "last", "expansion", cache) == chain.digests["expansion"]
