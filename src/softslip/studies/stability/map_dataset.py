"""The map of stability as datasets: one of each group of cells, and all of them together."""

import math
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
import xarray as xr

from softslip.errors import ConfigError
from softslip.studies.meanings import with_meanings
from softslip.studies.stability.axes import GROUPS
from softslip.studies.stability.cells import Cell
from softslip.studies.stability.map_design import MapDesign
from softslip.studies.stability.verdict import Judgement, judge
from softslip.studies.timing import Tell, silent

EVIDENCE = {
    "time": ("time unit", "simulated time"),
    "steps": ("1", "time steps"),
    "rejections": ("1", "trial steps that were refused"),
    "film": ("1", "smallest film over the contact range"),
    "stress_error": ("1", "largest deviation of the x-averaged stress, relative"),
    "area_error": ("1", "largest relative change of any particle's area"),
    "position_error": ("1", "rms distance of the nodes from the finer run over the contact range"),
    "rate_error": ("1", "relative difference of the mean wall shear rate from the finer run"),
    "regularisation_error": ("1", "the same from a run of a quarter of the regularisation length"),
    "crossings": ("1", "looks at which membranes crossed"),
    "seconds": ("s", "processor time of the cell without its finer run"),
}
"""Unit and meaning of each number of evidence."""

WORDS = {
    "group": "axis of the map",
    "label": "place on the axis",
    "value": "place on the axis as a number",
    "scheme": "level 'standard', or the paper's mesh and Euler steps",
    "verdict": "correct, stopped or wrong",
    "message": "why a cell stopped or is wrong",
}
"""Meaning of what has no unit."""


def measure_group(name: str, design: MapDesign, tell: Tell = silent) -> xr.Dataset:
    """Run the cells of one group of the map.

    Parameters
    ----------
    name
        One of `studies.stability.axes.GROUPS`.
    design
        Values along the axes.

    Returns
    -------
    xarray.Dataset
        Over ``cell``: ``group``, ``label``, ``value`` and ``scheme`` say what it is, ``verdict``
        and ``message`` what became of it; the rest is evidence, NaN where there is none.

    Raises
    ------
    ConfigError
        When there is no such group.
    SoftslipError
        When the scene that a group departs from cannot be made.
    """
    if name not in GROUPS:
        raise ConfigError(
            "group", name, "is no group of the map", f"use one of {', '.join(GROUPS)}"
        )
    rows = []
    for cell in GROUPS[name](design):
        judgement = judge(cell)
        tell(f"{cell.group} {cell.label} ({cell.scheme}): {judgement.verdict} {judgement.message}")
        rows.append((cell, judgement))
    return _dataset(rows)


def _dataset(rows: Sequence[tuple[Cell, Judgement]]) -> xr.Dataset:
    words = {
        "group": [cell.group for cell, _ in rows],
        "label": [cell.label for cell, _ in rows],
        "scheme": [str(cell.scheme) for cell, _ in rows],
        "verdict": [str(judgement.verdict) for _, judgement in rows],
        "message": [judgement.message for _, judgement in rows],
    }
    evidence = [asdict(judgement.evidence) for _, judgement in rows]
    numbers = {"value": [float(cell.value) for cell, _ in rows]}
    numbers |= {name: [_finite(each[name]) for each in evidence] for name in EVIDENCE}
    dataset = xr.Dataset(
        {name: ("cell", np.array(column, dtype=np.object_)) for name, column in words.items()}
        | {name: ("cell", np.array(column)) for name, column in numbers.items()}
    )
    return with_meanings(dataset, EVIDENCE | {name: ("1", WORDS[name]) for name in WORDS})


def _finite(value: float) -> float:
    """Return NaN for a film where nothing touches."""
    return value if math.isfinite(value) else math.nan


def gather(datasets: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the datasets of several groups as one, in the order of the map.

    Its attributes count the cells of each verdict.
    """
    order = {name: number for number, name in enumerate(GROUPS)}
    ordered = sorted(datasets, key=lambda each: order[str(each["group"].values[0])])
    together = xr.concat(ordered, "cell", data_vars="all", combine_attrs="drop_conflicts")
    verdicts = together["verdict"].values.tolist()
    counts = {name: verdicts.count(name) for name in ("correct", "stopped", "wrong")}
    return together.assign_attrs(cells=len(verdicts), **counts)
