"""Tables of the benchmarks in Markdown for the document, from their datasets alone."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import xarray as xr

from softslip.files.publication import Publication
from softslip.files.storage import read_dataset
from softslip.studies.markdown import LEFT, RIGHT, markdown_table

PARTS = {
    "spread": "spread",
    "fft": "Fourier",
    "gather": "gather",
    "near": "near",
    "contact": "contacts",
    "membrane": "membrane",
    "quadrature": "quadrature",
    "control": "rest",
}
"""Heads of the parts of an evaluation."""

TRAJECTORY = {"shear_rate_wall": "γ̇_wall", "shear_rate_bulk": "γ̇_bulk", "slip_velocity": "V_s"}
"""Quantities of the trajectories, as they are written."""

_DIFFERENCES = ("grid_difference", "seed_difference")

Value = Callable[[xr.Dataset, xr.Dataset], str]
"""A cell from the benchmark of a run and that of the mobility, at the same number of particles."""


def _of_run(name: str, form: str = ".3g") -> Value:
    return lambda run, mobility: format(float(run[name]), form)


def _of_mobility(name: str, form: str = ".2g") -> Value:
    return lambda run, mobility: format(float(mobility[name]), form)


ROWS: dict[str, Value] = {
    "core-seconds per time unit, paper's scheme": _of_run("paper_core_seconds"),
    "core-seconds per time unit, `standard`": _of_run("level_core_seconds"),
    "ratio": _of_run("ratio", ".0f"),
    "evaluations per time unit, `standard`": _of_run("level_evaluations"),
    "steps per time unit, `standard`": _of_run("level_steps"),
    "γ̇_wall of `standard` over the paper's scheme, same stretch": _of_run(
        "rate_difference", "+.1%"
    ),
    "evaluation of the mobility, `paper` on its own nodes, ratio": _of_mobility("own_ratio"),
    "rms velocity error of `paper` on its own nodes": _of_mobility("own_rms_error"),
    "the same on the paper's nodes (smooth forces)": _of_mobility("rms_error"),
    "the same with the forces of a packing": _of_mobility("real_rms_error"),
    "peak memory of running, paper's scheme [MiB]": _of_run("paper_peak_memory", ".0f"),
    "peak memory of running, `standard` [MiB]": _of_run("level_peak_memory", ".0f"),
}
"""Rows of the table that sets the schemes beside each other."""


def bench_blocks(results: Path) -> dict[str, str]:
    """Return the generated parts of the document from the benchmarks' datasets.

    Raises
    ------
    DatasetError
        When a dataset is missing or unreadable.
    """
    runs, mobilities = (
        [read_dataset(results / f"{kind}_{count}.nc", stage="bench") for count in (100, 800)]
        for kind in ("run", "mobility")
    )
    scaling, trajectory = (
        read_dataset(results / f"{name}.nc", stage="bench") for name in ("scaling", "trajectory")
    )
    return {
        "measured": measured_at(scaling),
        "schemes": schemes_table(runs, mobilities),
        "trajectories": trajectories_table(trajectory),
        "parts": parts_table(scaling),
    }


def measured_at(dataset: xr.Dataset) -> str:
    """Return a line that says which code a benchmark measured, and on which processor."""
    record = json.loads(dataset.attrs["provenance"])
    commit = record["commit"][:7] + (" with changes" if record["dirty"] else "")
    day = record["ended"].split("T")[0]
    return f"Measured at commit {commit} on {day}; processor: {record['processor']}."


def schemes_table(runs: Sequence[xr.Dataset], mobilities: Sequence[xr.Dataset]) -> str:
    """Return the table of the paper's scheme and the levels, a column for each size.

    Parameters
    ----------
    runs, mobilities
        Of `bench_run` and `bench_mobility`, in the same order of particles.
    """
    pairs = list(zip(runs, mobilities, strict=True))
    header = ["What", *(f"{int(run['particles'])} particles" for run in runs)]
    rows = [[name, *(value(*pair) for pair in pairs)] for name, value in ROWS.items()]
    return markdown_table(header, rows, [LEFT, *(RIGHT for _ in runs)])


def trajectories_table(trajectory: xr.Dataset) -> str:
    """Return the differences of trajectories, of schemes and of packings, as a table."""
    rows = [
        [symbol, *(f"{float(trajectory[key].sel(quantity=name)):.1%}" for key in _DIFFERENCES)]
        for name, symbol in TRAJECTORY.items()
    ]
    header = ["", "mesh against `paper`", "another packing against `paper`"]
    return markdown_table(header, rows, [LEFT, RIGHT, RIGHT])


def parts_table(scaling: xr.Dataset) -> str:
    """Return the time of an evaluation by parts and size, what it grows as, and that in a run."""
    rows = []
    for count in scaling["particles"].values:
        parts = scaling["nanoseconds"].sel(particles=count)
        cells = [f"{float(parts.sel(part=part)):.0f}" for part in PARTS]
        rows.append([str(count), *cells, f"{float(parts.sum()):.0f}"])
    table = markdown_table(["particles", *PARTS.values(), "all"], rows, [RIGHT] * (len(PARTS) + 2))
    largest = scaling.isel(particles=-1)
    alone, within = (1e3 * float(largest[key]) for key in ("seconds", "running"))
    growth = (
        f"The whole grows as N^{float(scaling['exponent']):.2f}. Within a run of "
        f"{int(largest['particles'])} particles an evaluation takes {within:.1f} ms in place of "
        f"{alone:.1f} ms, {within / alone:.1f} times as long."
    )
    return f"{table}\n\n{growth}"


BENCH = Publication(
    folder=Path("results/published/bench"),
    document=Path("docs/performance.md"),
    files=("*.nc", "*.png"),
    made_by="measure them with snakemake --cores 2 bench",
    blocks=bench_blocks,
)
"""What is published of the benchmarks."""
