"""Tables of the benchmarks in Markdown for the document, from their datasets alone."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr

from softslip.files.publication import Publication
from softslip.files.storage import read_dataset
from softslip.studies.markdown import LEFT, RIGHT, SYMBOLS, markdown_table, percent

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

KINDS = ("run", "mobility")
"""Benchmarks at one size each that the table of the schemes is made from."""

DIFFERENCES = {
    "grid_difference": "mesh against `paper`",
    "seed_difference": "another packing against `paper`",
}
"""Differences of trajectories, and what they are between."""

ROWS: dict[str, tuple[str, str, str]] = {
    "core-seconds per time unit, paper's scheme": ("run", "paper_core_seconds", ".3g"),
    "core-seconds per time unit, `standard`": ("run", "level_core_seconds", ".3g"),
    "ratio": ("run", "ratio", ".0f"),
    "evaluations per time unit, `standard`": ("run", "level_evaluations", ".3g"),
    "steps per time unit, `standard`": ("run", "level_steps", ".3g"),
    "γ̇_wall of `standard` over the paper's scheme, same stretch": (
        "run",
        "rate_difference",
        "+.1%",
    ),
    "evaluation of the mobility, `paper` on its own nodes, ratio": ("mobility", "own_ratio", ".2g"),
    "rms velocity error of `paper` on its own nodes": ("mobility", "own_rms_error", ".2g"),
    "the same on the paper's nodes (smooth forces)": ("mobility", "rms_error", ".2g"),
    "the same with the forces of a packing": ("mobility", "real_rms_error", ".2g"),
    "peak memory of running, paper's scheme [MiB]": ("run", "paper_peak_memory", ".0f"),
    "peak memory of running, `standard` [MiB]": ("run", "level_peak_memory", ".0f"),
}
"""Rows of the table that sets the schemes beside each other: benchmark, figure and its format."""


def bench_blocks(results: Path) -> dict[str, str]:
    """Return the generated parts of the document from the benchmarks' datasets.

    Raises
    ------
    DatasetError
        When a dataset is missing or unreadable.
    """
    sizes = [
        {kind: read_dataset(results / f"{kind}_{count}.nc", stage="bench") for kind in KINDS}
        for count in (100, 800)
    ]
    scaling, trajectory = (
        read_dataset(results / f"{name}.nc", stage="bench") for name in ("scaling", "trajectory")
    )
    return {
        "measured": measured_at(scaling),
        "schemes": schemes_table(sizes),
        "trajectories": trajectories_table(trajectory),
        "parts": parts_table(scaling),
    }


def measured_at(dataset: xr.Dataset) -> str:
    """Return a line that says which code a benchmark measured, and on which processor."""
    record = json.loads(dataset.attrs["provenance"])
    commit = record["commit"][:7] + (" with changes" if record["dirty"] else "")
    day = record["ended"].split("T")[0]
    return f"Measured at commit {commit} on {day}; processor: {record['processor']}."


def schemes_table(sizes: Sequence[Mapping[str, xr.Dataset]]) -> str:
    """Return the table of the paper's scheme and the levels.

    Parameters
    ----------
    sizes
        For each column the benchmarks `KINDS` at the same number of particles.
    """
    header = ["What", *(f"{int(size['run']['particles'])} particles" for size in sizes)]
    rows = [
        [words, *(format(float(size[kind][name]), form) for size in sizes)]
        for words, (kind, name, form) in ROWS.items()
    ]
    return markdown_table(header, rows, [LEFT, *(RIGHT for _ in sizes)])


def trajectories_table(trajectory: xr.Dataset) -> str:
    """Return the differences of trajectories, of schemes and of packings, as a table."""
    rows = [
        [symbol, *(percent(float(trajectory[key].sel(quantity=name))) for key in DIFFERENCES)]
        for name, symbol in SYMBOLS.items()
    ]
    return markdown_table(["", *DIFFERENCES.values()], rows, [LEFT, RIGHT, RIGHT])


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
