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

from softslip.files.storage import CONTENT_DIGEST

pytestmark = [pytest.mark.reliability, pytest.mark.slow]

CHECKED = (
    "chains",
    "contacts",
    "crossing",
    "growth",
    "integrators",
    "kernels",
    "membrane",
    "ewald",
    "grid",
    "near",
    "quadrature",
    "rest",
    "window",
    "neighbours",
    "contact_list",
    "steric",
    "suspension",
    "transfer",
)
"""Tests of the modules with compiled loops, and of what is made of them."""

VECTOR = "works on vectors of the processor, which exist only compiled"
LOST = "turns a number that is none into an index, which Python refuses where machine code does not"

LEFT_OUT = {
    "kernels": ("no_number", LOST),
    "chains": ("contacts_of_the_points", VECTOR),
    "contacts": ("contacts", VECTOR),
    "ewald": ("ewald", VECTOR),
    "near": ("near", VECTOR),
    "quadrature": ("wave_on_a_wall", VECTOR),
    "rest": ("ewald", VECTOR),
    "window": ("spread", VECTOR),
    "neighbours": ("no_number", LOST),
    "contact_list": ("contact_list", VECTOR),
    "steric": ("steric", VECTOR),
    "suspension": ("suspension", VECTOR),
}
"""Tests that cannot pass without a compiler, by a part of their names, and why."""

INTERPRETED = tuple(name for name in CHECKED if LEFT_OUT.get(name, ("",))[0] != name)

TRESPASS = """
import numpy as np
from softslip.solver.kernels import compiled

@compiled
def beyond(values):
    return values[values.size + 2]

try:
    beyond(np.ones(3))
except IndexError:
    print("seen")
"""
"""Reads beyond an array."""


def python(*words: str, **environment: str) -> str:
    """Run Python in the folder of the product and return what it prints."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
    return done.stdout


def run_tests(name: str, *options: str, **environment: str) -> int:
    """Run the fast tests of a module; return how many passed."""
    (path,) = (ROOT / "tests").rglob(f"test_{name}.py")
    said = python(
        "-m", "pytest", "-q", "-p", "no:cacheprovider", *options, str(path), **environment
    )
    return int(said.splitlines()[-1].split()[0])


@pytest.fixture(scope="session")
def checked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return what makes every access to an array be checked, without spoiling the usual cache."""
    cache = tmp_path_factory.mktemp("checked")
    return {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(cache)}


def test_a_loop_that_leaves_its_arrays_is_seen(checked, tmp_path: Path) -> None:
    (tmp_path / "trespass.py").write_text(TRESPASS)
    assert python(str(tmp_path / "trespass.py"), **checked) == "seen\n"


@pytest.mark.parametrize("name", CHECKED)
def test_no_loop_leaves_its_arrays(checked, tally, name: str) -> None:
    tally("tests with bounds checked")["passed"] += run_tests(name, **checked)


@pytest.mark.parametrize("name", INTERPRETED)
def test_loops_are_right_without_a_compiler(tmp_path, tally, name: str) -> None:
    plain = {"NUMBA_DISABLE_JIT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    # NumPy's numbers warn of infinity less infinity, and machine code does not.
    options = ["-W", "ignore::RuntimeWarning"]
    if name in LEFT_OUT:
        options += ["-k", f"not ({LEFT_OUT[name][0]})"]
    tally("tests without a compiler")["passed"] += run_tests(name, *options, **plain)


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
