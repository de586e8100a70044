"""Peak memory of evaluating the equations of motion, in a fresh process of its own."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import xarray as xr

from softslip.config.parameters import Parameters
from softslip.errors import SoftslipError
from softslip.studies import scenes
from softslip.studies.membrane_nodes import renoded

EVALUATIONS = 3
"""Evaluations after which no more memory is taken: workspaces are made in the first."""

STATUS = Path("/proc/self/status")
"""Where Linux states a process's peak memory. That of getrusage is not used: a child inherits
the peak of the process that started it."""


def memory_of_evaluation(membranes: xr.Dataset, parameters: Parameters) -> float:
    """Return the peak memory of a process that only evaluates the equations of motion [MiB].

    What the process imports is part of it.

    Parameters
    ----------
    membranes
        As `studies.scenes.membranes_of` returns them, on any nodes.
    parameters
        Of the scheme, which gives the membranes its own nodes.

    Raises
    ------
    SoftslipError
        On a system without /proc.
    """
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(max_workers=1, mp_context=fresh) as pool:
        return pool.submit(_evaluate, membranes, parameters).result()


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


def _evaluate(membranes: xr.Dataset, parameters: Parameters) -> float:
    """Evaluate the equations of motion a few times and return the peak memory [MiB]."""
    scene = scenes.untethered(renoded(membranes, parameters), parameters)
    for _ in range(EVALUATIONS):
        scene.suspension.evaluate(scene.state)
    return peak_memory()
