"""`softslip bench`: the paper's scheme and the faster ones side by side."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr
from rich.console import Console
from rich.markdown import Markdown
from rich.table import Table

from softslip.cli.common import AsJson, one_line_errors
from softslip.files.storage import write_dataset
from softslip.operations.progress import progress_report
from softslip.provenance.attribution import Job
from softslip.provenance.fingerprints import fingerprint

app = typer.Typer(
    no_args_is_help=True, help="Measure the paper's scheme and the faster ones side by side."
)


FEWEST_PARTICLES = 16
"""Particles of a benchmark at least: fewer make no channel."""

Particles = Annotated[int, typer.Option(min=FEWEST_PARTICLES, help="Number of particles.")]
Fidelity = Annotated[str, typer.Option(help="preview, standard, paper or converged.")]
Measured = Annotated[Path | None, typer.Option(help="Dataset to write.", readable=False)]
Budget = Annotated[float, typer.Option(min=0, help="Seconds for the repeats of a measurement.")]


def _tell(line: str) -> None:
    """Show a phase of a benchmark on standard error."""
    print(f"bench: {line}", file=sys.stderr, flush=True)


def _bench_table(dataset: xr.Dataset) -> Table:
    """Return a table of all figures of a benchmark, with a column for each number of particles."""
    words = ", ".join(f"{key} {dataset.attrs[key]}" for key in ("bench", "fidelity"))
    table = Table("figure", "unit", title=words)
    for count in dataset["particles"].values.ravel():
        table.add_column(str(count), justify="right")
    for name, variable in dataset.data_vars.items():
        if {"time", "element"} & set(variable.dims):
            continue
        dim = next((dim for dim in variable.dims if dim != "particles"), None)
        for label in [""] if dim is None else variable[dim].values:
            chosen = variable if dim is None else variable.sel({dim: label})
            if chosen.notnull().all():
                values = [f"{value:.4g}" for value in chosen.values.ravel()]
                table.add_row(f"{name} {label}".strip(), variable.attrs["units"], *values)
    return table


def _show_bench(result: Mapping[str, Any], as_json: bool, output: Path | None) -> None:
    """Print a benchmark's result, and write it where a file is named."""
    from softslip.studies.bench import as_dataset

    dataset = as_dataset(result)
    if output is not None:
        name = result["bench"]
        chosen = {key: value for key, value in result.items() if isinstance(value, int | str)}
        dataset = dataset.assign_attrs(parameters=json.dumps(chosen))
        labelled = dataset.assign_attrs(Job().labels(fingerprint=fingerprint("bench")))
        write_dataset(labelled, output, stage="bench", run=name, title=f"benchmark of {name}")
    if as_json:
        print(json.dumps(result))
        return
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(_bench_table(dataset))
    if "element" in dataset.dims:
        from softslip.studies.bench.elements_markdown import elements_table

        console.print(Markdown(elements_table(dataset)))


@app.command(name="mobility")
@one_line_errors
def bench_mobility_command(
    particles: Particles = 800,
    fidelity: Fidelity = "paper",
    budget: Budget = 5.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Compare the mesh of the paper with the Ewald sum: time of an evaluation, and velocities."""
    from softslip.studies.bench import bench_mobility

    result = bench_mobility(particles, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@app.command(name="run")
@one_line_errors
def bench_run_command(
    particles: Particles = 100,
    fidelity: Fidelity = "paper",
    budget: Budget = 60.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Compare what a simulated time unit costs in the paper's scheme and at a level of fidelity."""
    from softslip.studies.bench import bench_run

    result = bench_run(particles, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@app.command(name="scaling")
@one_line_errors
def bench_scaling_command(
    particles: Annotated[
        list[int] | None, typer.Option(min=FEWEST_PARTICLES, help="Give it once for each size.")
    ] = None,
    fidelity: Fidelity = "paper",
    budget: Budget = 3.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Time an evaluation and its parts for several numbers of particles."""
    from softslip.studies.bench import SIZES, bench_scaling

    sizes = sorted(set(particles)) if particles else SIZES
    result = bench_scaling(sizes, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@app.command(name="elements")
@one_line_errors
def bench_elements_command(
    particles: Particles = 100,
    fidelity: Fidelity = "standard",
    budget: Budget = 2.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Measure what each element of a scene costs, and what is left out where it is absent."""
    from softslip.studies.bench import bench_elements

    result = bench_elements(particles, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@app.command(name="trajectory")
@one_line_errors
def bench_trajectory_command(
    particles: Particles = 44,
    stress: Annotated[float, typer.Option(help="Imposed stress [stress unit].")] = 0.5,
    duration: Annotated[
        float, typer.Option("--time", min=2, help="Time under stress [time unit].")
    ] = 20.0,
    fidelity: Fidelity = "paper",
    ageing: Annotated[float, typer.Option(min=0, help="Time at rest before it [time unit].")] = 50,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Shear one state at a level and on the paper's mesh, and a second packing beside them."""
    from softslip.studies.bench import bench_trajectory

    result = bench_trajectory(
        particles, stress, duration, fidelity, ageing=ageing, tell=_tell, watch=progress_report
    )
    _show_bench(result, as_json, output)


@app.command(name="publish")
@one_line_errors
def bench_publish_command(
    results: Annotated[
        Path, typer.Argument(help="Folder of finished benchmarks.", readable=False)
    ] = Path("results/bench"),
) -> None:
    """Copy benchmarks to results/published/bench, and write their tables in docs/performance.md."""
    from softslip.studies.bench.bench_markdown import BENCH

    for path in BENCH.write(results):
        print(path)
