"""The command line: one subcommand a stage, one an analysis, one a figure. No physics here.

Commands import what they run when they run it: a stage that is started hundreds of times must not
wait for the plotting libraries.
"""

import functools
import json
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr
from rich.console import Console
from rich.table import Table

from softslip.errors import ConfigError, SoftslipError
from softslip.parameters import Parameters
from softslip.progress import Report, progress_report
from softslip.reference import write_references
from softslip.stages import STAGES
from softslip.storage import read_dataset, write_dataset
from softslip.sweep import Scenario, StageRun, load_scenario

CONFIG_EXIT, FAILURE_EXIT = 2, 1
"""Exit statuses: a scenario that cannot be run, and a run that failed."""

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    help="Wall slip and bulk yielding in soft particle suspensions.",
)

bench_app = typer.Typer(
    no_args_is_help=True, help="Measure the paper's scheme and the faster ones side by side."
)
app.add_typer(bench_app, name="bench")

ScenarioName = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Name of a file in config/, or a .yaml path.")
]
RunName = Annotated[str, typer.Argument(metavar="RUN", help="Run ID, or its first digits.")]
Output = Annotated[Path, typer.Option(help="File to write.")]
Parent = Annotated[Path, typer.Option(help="Result of the stage before.")]
Threads = Annotated[
    int, typer.Option(min=1, help="Threads at most; a run uses up to 2, for the same numbers.")
]
Results = Annotated[
    Path | None, typer.Option(help="Folder of the scenario's results; results/NAME by default.")
]


def _one_line_errors(command: Callable[..., None]) -> Callable[..., None]:
    """Turn the errors that are meant for the user into one line and an exit status."""

    @functools.wraps(command)
    def guarded(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except SoftslipError as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr)
            status = CONFIG_EXIT if isinstance(error, ConfigError) else FAILURE_EXIT
            raise typer.Exit(status) from error

    return guarded


def _find_run(scenario: Scenario, stage: str, run: str) -> StageRun:
    """Return the run of a stage whose ID begins with the given digits."""
    table = scenario.stage_table(stage)
    found = [row for identity, row in table.items() if run and identity.startswith(run)]
    if len(found) != 1:
        limit = f"is the beginning of {len(found)} {stage} runs of scenario {scenario.name}"
        raise ConfigError("run", run, limit, f"list them with: softslip runs {scenario.name}")
    return found[0]


def _write_stage(dataset: xr.Dataset, row: StageRun, output: Path) -> None:
    """Write a stage's result with what produced it."""
    labelled = dataset.assign_attrs(
        parameters=row.parameters.model_dump_json(),
        parent=row.parent or "",
        mean_radius=row.parameters.suspension.mean_radius,
        area_fraction=row.parameters.suspension.area_fraction,
    )
    title = f"{row.stage} of a soft particle suspension"
    write_dataset(labelled, output, stage=row.stage, run=row.id, title=title)
    print(f"{row.stage} {row.id}: wrote {output}", file=sys.stderr)


@app.command()
@_one_line_errors
def packing(scenario: ScenarioName, run: RunName, output: Output) -> None:
    """Pack discs with LAMMPS."""
    from softslip.packing import pack

    row = _find_run(load_scenario(scenario), "packing", run)
    _write_stage(pack(row.parameters), row, output)


def _continue(
    stage: str,
    scenario: str,
    run: str,
    parent: Path,
    output: Path,
    work: Callable[[xr.Dataset, Parameters, Report], xr.Dataset],
) -> None:
    """Run a stage on the result of the stage before, showing its progress."""
    row = _find_run(load_scenario(scenario), stage, run)
    before = read_dataset(parent, stage=STAGES[STAGES.index(stage) - 1], run=row.parent)
    with progress_report(stage) as report:
        result = work(before, row.parameters, report)
    _write_stage(result, row, output)


@app.command()
@_one_line_errors
def expansion(scenario: ScenarioName, run: RunName, parent: Parent, output: Output) -> None:
    """Grow discs into membranes at the wanted area fraction."""
    from softslip.expansion import expand

    def work(before: xr.Dataset, parameters: Parameters, report: Report) -> xr.Dataset:
        return expand(before, parameters, lambda part: report(round(1000 * part), 1000, part))

    _continue("expansion", scenario, run, parent, output, work)


@app.command()
@_one_line_errors
def ageing(
    scenario: ScenarioName, run: RunName, parent: Parent, output: Output, threads: Threads = 1
) -> None:
    """Relax a packing at zero stress, with hydrodynamics."""
    from softslip.shear import age

    work = functools.partial(age, threads=threads)
    _continue("ageing", scenario, run, parent, output, work)


@app.command(name="shear")
@_one_line_errors
def shear_command(
    scenario: ScenarioName, run: RunName, parent: Parent, output: Output, threads: Threads = 1
) -> None:
    """Shear an aged packing under constant stress or shear rate."""
    from softslip.shear import shear

    work = functools.partial(shear, threads=threads)
    _continue("shear", scenario, run, parent, output, work)


def _finished(
    scenario: Scenario, results: Path | None
) -> Iterator[tuple[dict[str, Any], xr.Dataset | None]]:
    """Yield the swept values of each run and its records, or None where there are none yet."""
    folder = results or Path("results") / scenario.name
    for run in scenario.runs():
        path = folder / "shear" / f"{run.ids['shear']}.nc"
        records = read_dataset(path, stage="shear", run=run.ids["shear"]) if path.exists() else None
        yield dict(run.coordinates), records


TABLES = ("flow_curve", "creep", "profiles")
"""Analyses that gather all runs of a scenario, by the name of their dataset."""

TableName = Annotated[str, typer.Argument(metavar="TABLE", help=f"One of {', '.join(TABLES)}.")]


@app.command()
@_one_line_errors
def gather(
    table: TableName, scenario: ScenarioName, output: Output, results: Results = None
) -> None:
    """Gather the finished runs of a scenario into one dataset."""
    from softslip import observables

    if table not in TABLES:
        raise ConfigError("table", table, "is not an analysis", f"use one of {', '.join(TABLES)}")
    loaded = load_scenario(scenario)
    gathered = getattr(observables, table)(_finished(loaded, results))
    write_dataset(gathered, output, stage=table, run=loaded.name, title=f"{table} of {loaded.name}")


@app.command()
@_one_line_errors
def fit(
    flow_curve: Annotated[Path, typer.Argument(help="Dataset that `gather flow_curve` wrote.")],
    output: Output,
) -> None:
    """Fit the flow law and the slip laws to a flow curve, and say which could be fitted."""
    from softslip import fits

    curve = read_dataset(flow_curve, stage="flow_curve")
    laws = fits.fit_laws(curve)
    run = curve.attrs["run"]
    write_dataset(laws, output, stage="fits", run=run, title=f"fits of {run}")
    print(fits.summary(laws))


FIGURES = "flow_curves, creep, profiles, snapshot, benchmark or trajectory"

FigureName = Annotated[str, typer.Argument(metavar="FIGURE", help=f"{FIGURES}.")]


@app.command()
@_one_line_errors
def draw(
    figure: FigureName,
    data: Annotated[list[Path], typer.Argument(help="Datasets that the figure shows.")],
    output: Output,
) -> None:
    """Draw a figure from datasets."""
    from softslip import figures

    if figure == "flow_curves":
        curve, laws = (
            read_dataset(path, stage=stage)
            for path, stage in zip(data, ("flow_curve", "fits"), strict=True)
        )
        drawn = figures.flow_curves(curve, laws)
    elif figure in ("creep", "profiles"):
        curve = read_dataset(data[0], stage=figure)
        drawn = getattr(figures, figure)(curve)
    elif figure == "snapshot":
        curve = read_dataset(data[0], stage="shear")
        drawn = figures.snapshot(curve)
    elif figure == "benchmark":
        curve = read_dataset(data[0], stage="bench", run="scaling")
        drawn = figures.benchmark(curve, *(read_dataset(path, stage="bench") for path in data[1:]))
    elif figure == "trajectory":
        curve = read_dataset(data[0], stage="bench", run="trajectory")
        drawn = figures.trajectory(curve)
    else:
        raise ConfigError("figure", figure, "is not a figure", f"use {FIGURES}")
    figures.save_figure(drawn, output, {"title": figure, "run": curve.attrs["run"]})


@app.command()
@_one_line_errors
def runs(scenario: ScenarioName, results: Results = None) -> None:
    """List the runs of a scenario with the IDs of their stages; finished ones are ticked."""
    loaded = load_scenario(scenario)
    folder = results or Path("results") / loaded.name
    table = Table(title=f"{loaded.name}: {loaded.description}")
    for axis in loaded.axes:
        table.add_column(axis.label)
    for stage in STAGES:
        table.add_column(stage, no_wrap=True)
    for run in loaded.runs():
        values = [str(run.coordinates[axis.label]) for axis in loaded.axes]
        files = {stage: folder / stage / f"{run.ids[stage]}.nc" for stage in STAGES}
        table.add_row(
            *values, *(f"{run.ids[s]} {'✓' if files[s].exists() else ' '}" for s in STAGES)
        )
    Console(width=None if sys.stdout.isatty() else 160).print(table)


@app.command()
@_one_line_errors
def schema() -> None:
    """Write config/schema.json, config/defaults.yaml and the table in config/README.md anew."""
    for path in write_references(Path("config")):
        print(path)


FEWEST_PARTICLES = 16
"""Particles of a benchmark at least: fewer make no channel."""

Particles = Annotated[int, typer.Option(min=FEWEST_PARTICLES, help="Number of particles.")]
Fidelity = Annotated[str, typer.Option(help="preview, standard, paper or converged.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, not a table.")]
Measured = Annotated[Path | None, typer.Option(help="Dataset to write.")]
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
        if {"time", "trimming"} & set(variable.dims):
            continue
        dim = next((dim for dim in variable.dims if dim != "particles"), None)
        for label in [""] if dim is None else variable[dim].values:
            chosen = variable if dim is None else variable.sel({dim: label})
            if chosen.notnull().all():
                values = [f"{value:.4g}" for value in chosen.values.ravel()]
                table.add_row(f"{name} {label}".strip(), variable.attrs["units"], *values)
    return table


def _trimming_table(dataset: xr.Dataset) -> Table:
    """Return a table with a row for each trimming; changes stand beside their errors."""
    title = "core-seconds per time unit, and relative changes ± error of the estimate"
    table = Table("trimming", title=title, caption=f"Errors from {dataset.attrs['errors']}.")
    for words in ("with it", "without", "saved", "wall rate", "bulk rate", "slip velocity"):
        table.add_column(words, justify="right")
    for name in dataset["trimming"].values:
        row = dataset.sel(trimming=name)
        seconds = [f"{float(row[key]):.3g}" for key in ("trimmed_seconds", "untrimmed_seconds")]
        changes = [
            f"{float(row[f'{key}_change']):.1e} ± {float(row[f'{key}_error']):.1e}"
            for key in ("shear_rate_wall", "shear_rate_bulk", "slip_velocity")
        ]
        table.add_row(name, *seconds, f"{float(row['saved']):.1%}", *changes)
    return table


def _show_bench(result: Mapping[str, Any], as_json: bool, output: Path | None) -> None:
    """Print a benchmark's result, and write it if that is wanted."""
    from softslip.bench import as_dataset

    dataset = as_dataset(result)
    if output is not None:
        name = result["bench"]
        write_dataset(dataset, output, stage="bench", run=name, title=f"benchmark of {name}")
    if as_json:
        print(json.dumps(result))
        return
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(_bench_table(dataset))
    if "trimming" in dataset.dims:
        console.print(_trimming_table(dataset))


@bench_app.command(name="mobility")
@_one_line_errors
def bench_mobility_command(
    particles: Particles = 800,
    fidelity: Fidelity = "paper",
    budget: Budget = 5.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Compare the mesh of the paper with the Ewald sum: time of an evaluation, and velocities."""
    from softslip.bench import bench_mobility

    result = bench_mobility(particles, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@bench_app.command(name="run")
@_one_line_errors
def bench_run_command(
    particles: Particles = 100,
    fidelity: Fidelity = "paper",
    budget: Budget = 60.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Compare what a simulated time unit costs in the paper's scheme and at a level of fidelity."""
    from softslip.bench import bench_run

    result = bench_run(particles, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@bench_app.command(name="scaling")
@_one_line_errors
def bench_scaling_command(
    particles: Annotated[
        list[int] | None, typer.Option(min=FEWEST_PARTICLES, help="Give it once for each size.")
    ] = None,
    fidelity: Fidelity = "paper",
    budget: Budget = 3.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Time an evaluation and its parts for several numbers of particles, against the roofline."""
    from softslip.bench import SIZES, bench_scaling

    sizes = sorted(set(particles)) if particles else SIZES
    result = bench_scaling(sizes, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@bench_app.command(name="memory")
@_one_line_errors
def bench_memory_command(
    particles: Particles = 800,
    fidelity: Fidelity = "paper",
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Measure the peak memory of packing, growing and evaluating, in a process for each."""
    from softslip.bench import bench_memory

    _show_bench(bench_memory(particles, fidelity, tell=_tell), as_json, output)


@bench_app.command(name="trimming")
@_one_line_errors
def bench_trimming_command(
    particles: Particles = 100,
    fidelity: Fidelity = "paper",
    budget: Budget = 2.0,
    as_json: AsJson = False,
    output: Measured = None,
) -> None:
    """Measure what work that is left out of a run saves, and that the flow stays the same."""
    from softslip.bench import bench_trimming

    result = bench_trimming(particles, fidelity, budget=budget, tell=_tell)
    _show_bench(result, as_json, output)


@bench_app.command(name="trajectory")
@_one_line_errors
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
    from softslip.bench import bench_trajectory

    result = bench_trajectory(
        particles, stress, duration, fidelity, ageing=ageing, tell=_tell, watch=progress_report
    )
    _show_bench(result, as_json, output)


def main() -> None:
    """Run the command line."""
    app()
