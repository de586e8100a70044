"""Peak memory of each part of a run, every part in a fresh process of its own."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import xarray as xr

from softslip.config.parameters import Parameters
from softslip.errors import SoftslipError
from softslip.studies import scenes
from softslip.studies.bench.run import paper_scheme
from softslip.studies.timing import Tell, silent

STAGES = ("scene", "level", "paper")
"""What is measured: the two stages before the solver, packing and expansion, and then a few
evaluations of the equations of motion at a level and in the paper's scheme."""

IMPORTED = "imported"
"""Name of what every process holds before it begins."""

EVALUATIONS = 3
"""Evaluations after which no more memory is taken: workspaces are made in the first."""

STATUS = Path("/proc/self/status")
"""Where Linux tells a process its peak memory. That of getrusage is not used: a child inherits
the peak of the process that started it."""


def bench_memory(
    particles: int = 800,
    fidelity: str = "paper",
    *,
    gap: float = scenes.PAPER_GAP,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Measure the peak resident memory of packing, growing and evaluating N particles.

    Parameters
    ----------
    particles
        N.
    fidelity
        Level whose solver is compared with the paper's scheme.
    gap
        Wanted solvent outside the walls of the paper's scheme [length unit].
    tell
        Shown the phases.

    Returns
    -------
    dict
        ``peak`` [MiB] of each of `STAGES` and of what is ``imported`` before any of them, and
        ``ratio`` of the paper's scheme to the level.

    Raises
    ------
    SoftslipError
        When there is no such scene, a part fails, or the system does not tell.
    """
    scenes.parameters_of(particles, fidelity)  # Refuses what no child could do.
    peak: dict[str, float] = {}
    with tempfile.TemporaryDirectory(prefix="softslip-bench-") as folder:
        for stage in STAGES:
            tell(f"peak memory of {stage} with {particles} particles")
            peak |= _in_a_child(stage, particles, fidelity, gap, Path(folder))
    return {
        "bench": "memory",
        "particles": particles,
        "fidelity": fidelity,
        "ratio": peak["paper"] / peak["level"],
        "peak": peak,
    }


def _in_a_child(
    stage: str, particles: int, fidelity: str, gap: float, folder: Path
) -> dict[str, float]:
    """Run a part in a process of its own and return what `main` prints."""
    # This module is imported under its own name and does not run as a script, so that what the
    # child makes has the same types as elsewhere.
    code = "import sys; from softslip.studies.bench.memory import main; main(sys.argv[1:])"
    words = [stage, str(particles), fidelity, repr(gap), str(folder)]
    child = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
    )
    if child.returncode:
        reason = child.stderr.strip().splitlines()[-1:] or [f"status {child.returncode}"]
        raise SoftslipError(f"peak memory of {stage}: the process failed ({reason[0]})")
    found: dict[str, float] = json.loads(child.stdout)
    return found


def main(words: list[str]) -> None:
    """Do a part and print the peak memory of this process before and after it, as JSON [MiB].

    Parameters
    ----------
    words
        Stage, N, level, gap of the paper's scheme and folder for what one part leaves to others.

    Raises
    ------
    SoftslipError
        See `peak_memory`.
    """
    stage, particles, fidelity, gap, folder = words
    before = peak_memory()
    _do(stage, int(particles), fidelity, float(gap), Path(folder) / "membranes.nc")
    print(json.dumps({IMPORTED: before, stage: peak_memory()}))


def peak_memory() -> float:
    """Return the peak resident memory of this process [MiB].

    Raises
    ------
    SoftslipError
        On a system without /proc.
    """
    if not STATUS.exists():
        raise SoftslipError(f"peak memory is read from {STATUS}, which only Linux has")
    for line in STATUS.read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    raise SoftslipError(f"{STATUS} holds no line VmHWM, the peak memory")


def _do(stage: str, particles: int, fidelity: str, gap: float, membranes: Path) -> None:
    if stage == "scene":
        scenes.expanded(particles, fidelity).to_netcdf(membranes)
    elif stage == "level":
        _evaluate(xr.load_dataset(membranes), scenes.parameters_of(particles, fidelity))
    elif stage == "paper":
        _evaluate(xr.load_dataset(membranes), paper_scheme(particles, gap))


def _evaluate(expansion: xr.Dataset, parameters: Parameters) -> None:
    """Evaluate the equations of motion of membranes at rest, on the nodes of the parameters."""
    membranes = scenes.renoded(expansion.rename(area="reference_area"), parameters)
    scene = scenes.untethered(membranes, parameters)
    for _ in range(EVALUATIONS):
        scene.suspension.evaluate(scene.state)
