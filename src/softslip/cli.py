"""The command line: one subcommand a stage, one an analysis, one a figure. No physics here.

Commands import what they run when they run it: a stage that is started hundreds of times must not
wait for the plotting libraries.
"""

import functools
import sys
from collections.abc import Callable, Iterator
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

ScenarioName = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Name of a file in config/, or a .yaml path.")
]
RunName = Annotated[str, typer.Argument(metavar="RUN", help="Run ID, or its first digits.")]
Output = Annotated[Path, typer.Option(help="File to write.")]
Parent = Annotated[Path, typer.Option(help="Result of the stage before.")]
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
def ageing(scenario: ScenarioName, run: RunName, parent: Parent, output: Output) -> None:
    """Relax a packing at zero stress, with hydrodynamics."""
    from softslip.shear import age

    _continue("ageing", scenario, run, parent, output, age)


@app.command(name="shear")
@_one_line_errors
def shear_command(scenario: ScenarioName, run: RunName, parent: Parent, output: Output) -> None:
    """Shear an aged packing under constant stress or shear rate."""
    from softslip.shear import shear

    _continue("shear", scenario, run, parent, output, shear)


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


FigureName = Annotated[
    str, typer.Argument(metavar="FIGURE", help="flow_curves, creep, profiles or snapshot.")
]


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
    else:
        raise ConfigError(
            "figure", figure, "is not a figure", "use flow_curves, creep, profiles or snapshot"
        )
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


def main() -> None:
    """Run the command line."""
    app()
