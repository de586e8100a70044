"""One command a stage: read the parent's result, run, write."""

import functools
import sys
from collections.abc import Callable
from pathlib import Path

import typer
import xarray as xr

from softslip.cli.common import (
    Output,
    Parent,
    RunName,
    ScenarioName,
    Threads,
    find_run,
    one_line_errors,
    tell_choice,
)
from softslip.parameters import Parameters
from softslip.progress import Report, progress_report
from softslip.stages import STAGES
from softslip.storage import read_dataset, write_dataset
from softslip.sweep import StageRun, load_scenario

app = typer.Typer()


def _found(scenario: str, stage: str, run: str) -> StageRun:
    """Return a run, and say which settings its wanted accuracy has picked."""
    row = find_run(load_scenario(scenario), stage, run)
    tell_choice(row.parameters)
    return row


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
@one_line_errors
def packing(scenario: ScenarioName, run: RunName, output: Output) -> None:
    """Pack discs with LAMMPS."""
    from softslip.packing import pack

    row = _found(scenario, "packing", run)
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
    row = _found(scenario, stage, run)
    before = read_dataset(parent, stage=STAGES[STAGES.index(stage) - 1], run=row.parent)
    with progress_report(stage) as report:
        result = work(before, row.parameters, report)
    _write_stage(result, row, output)


@app.command()
@one_line_errors
def expansion(scenario: ScenarioName, run: RunName, parent: Parent, output: Output) -> None:
    """Grow discs into membranes at the wanted area fraction."""
    from softslip.expansion import expand

    def work(before: xr.Dataset, parameters: Parameters, report: Report) -> xr.Dataset:
        return expand(before, parameters, lambda part: report(round(1000 * part), 1000, part))

    _continue("expansion", scenario, run, parent, output, work)


@app.command()
@one_line_errors
def ageing(
    scenario: ScenarioName, run: RunName, parent: Parent, output: Output, threads: Threads = 1
) -> None:
    """Relax a packing at zero stress, with hydrodynamics."""
    from softslip.shear import age

    work = functools.partial(age, threads=threads)
    _continue("ageing", scenario, run, parent, output, work)


@app.command(name="shear")
@one_line_errors
def shear_command(
    scenario: ScenarioName, run: RunName, parent: Parent, output: Output, threads: Threads = 1
) -> None:
    """Shear an aged packing under constant stress or shear rate."""
    from softslip.shear import shear

    work = functools.partial(shear, threads=threads)
    _continue("shear", scenario, run, parent, output, work)
