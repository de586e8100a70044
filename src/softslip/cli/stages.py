"""One command a stage: read the parent's result, run, write."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
from softslip.environment import environment
from softslip.fingerprints import fingerprint
from softslip.interruption import interruptible
from softslip.lock import run_lock
from softslip.progress import progress_report
from softslip.stages import STAGES
from softslip.storage import CONTENT_DIGEST, read_dataset, write_dataset
from softslip.sweep import StageRun, load_scenario

if TYPE_CHECKING:
    from softslip.keeper import Keeper

app = typer.Typer()

Interval = Annotated[
    float,
    typer.Option("--checkpoint-interval", min=0, help="Seconds between two checkpoints."),
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on from a checkpoint, and fail if there is none.")
]


def _beside(output: Path) -> Path:
    """Return the folder of what a stage's results need while they are worked on."""
    return output.parent / "checkpoints"


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
    with run_lock(_beside(output), row.id), interruptible(at_once=True):
        _write_stage(pack(row.parameters), row, output)


def _before(row: StageRun, parent: Path) -> xr.Dataset:
    """Return the result of the stage before."""
    return read_dataset(parent, stage=STAGES[STAGES.index(row.stage) - 1], run=row.parent)


@app.command()
@one_line_errors
def expansion(scenario: ScenarioName, run: RunName, parent: Parent, output: Output) -> None:
    """Grow discs into membranes at the wanted area fraction."""
    from softslip.expansion import expand

    row = _found(scenario, "expansion", run)
    before = _before(row, parent)
    with (
        run_lock(_beside(output), row.id),
        interruptible(at_once=True),
        progress_report("expansion") as report,
    ):

        def tell(part: float) -> None:
            report(round(1000 * part), 1000, part)

        _write_stage(expand(before, row.parameters, tell), row, output)


@contextmanager
def _kept(
    row: StageRun, before: xr.Dataset, output: Path, interval: float, resume: bool
) -> Iterator["Keeper"]:
    """Lock a run and keep it while the block runs; when it has ended, checkpoints are removed."""
    from softslip.checkpoint import Checkpoints, Identity
    from softslip.keeper import Keeper

    folder = _beside(output)
    identity = Identity(
        stage=row.stage,
        run=row.id,
        parent=str(before.attrs[CONTENT_DIGEST]),
        fingerprint=fingerprint(row.stage),
        environment=environment(),
        parameters=row.parameters.model_dump_json(),
    )

    def say(sentence: str) -> None:
        print(f"{row.stage} {row.id}: {sentence}", file=sys.stderr, flush=True)

    with run_lock(folder, row.id), interruptible(at_once=False) as interruption:
        checkpoints = Checkpoints(folder, identity, say, required=resume)
        yield Keeper(checkpoints, interruption, interval)
        checkpoints.remove()


@app.command()
@one_line_errors
def ageing(
    scenario: ScenarioName,
    run: RunName,
    parent: Parent,
    output: Output,
    threads: Threads = 1,
    checkpoint_interval: Interval = 60.0,
    resume: Resume = False,
) -> None:
    """Relax a packing at zero stress, with hydrodynamics."""
    from softslip.shear import age

    row = _found(scenario, "ageing", run)
    before = _before(row, parent)
    with (
        _kept(row, before, output, checkpoint_interval, resume) as keeper,
        progress_report("ageing") as report,
    ):
        _write_stage(age(before, row.parameters, report, threads, keeper), row, output)


@app.command(name="shear")
@one_line_errors
def shear_command(
    scenario: ScenarioName,
    run: RunName,
    parent: Parent,
    output: Output,
    threads: Threads = 1,
    checkpoint_interval: Interval = 60.0,
    resume: Resume = False,
) -> None:
    """Shear an aged packing under constant stress or shear rate."""
    from softslip.shear import shear

    row = _found(scenario, "shear", run)
    before = _before(row, parent)
    with (
        _kept(row, before, output, checkpoint_interval, resume) as keeper,
        progress_report("shear") as report,
    ):
        _write_stage(shear(before, row.parameters, report, threads, keeper), row, output)
