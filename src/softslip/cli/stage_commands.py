"""One command a stage: read the parent's result, run, write."""

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
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
    stage_run,
    tell_choice,
)
from softslip.config.scenario import StageRun, load_scenario
from softslip.config.stages import STAGES, stage_parameters, trajectory_id
from softslip.files.layout import CHECKPOINTS
from softslip.files.storage import CONTENT_DIGEST, read_dataset, write_dataset
from softslip.operations.failures import failure_recorded
from softslip.operations.lock import run_lock
from softslip.operations.progress import Report, json_report, progress_report, silent_report
from softslip.provenance.attribution import Job
from softslip.provenance.environment import environment
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.interruption import interruptible

if TYPE_CHECKING:
    from softslip.simulation.checkpoint_generations import Checkpoints
    from softslip.simulation.checkpointer import Checkpointer

app = typer.Typer()

Interval = Annotated[
    float,
    typer.Option("--checkpoint-interval", min=0, help="Seconds between two checkpoints."),
]
RunParameters = Annotated[
    str | None,
    typer.Option(
        "--parameters",
        metavar="JSON",
        help="All parameters of the run, which are then not looked up in SCENARIO.",
    ),
]
JsonProgress = Annotated[
    bool,
    typer.Option(
        "--json-progress",
        help="Write progress as lines of JSON on standard output, for programs that show it.",
    ),
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Resume from a checkpoint, and fail if there is none.")
]


def _shown(stage: str, as_json: bool) -> AbstractContextManager[Report]:
    """Return what shows the progress of a stage."""
    return json_report(stage) if as_json else progress_report(stage)


def _stage_run(scenario: str, stage: str, run: str, parameters: str | None) -> StageRun:
    """Return a run, and say which settings its target accuracy has picked."""
    if parameters is None:
        row = find_run(load_scenario(scenario), stage, run)
    else:
        row = stage_run(stage, run, parameters)
    tell_choice(row.parameters)
    return row


@dataclass
class _Job:
    """One attempt at a stage of a run.

    Attributes
    ----------
    row
        The run.
    output
        Where its result goes.
    parent_path
        Result of the stage before, if there is one.
    threads
        Threads at most.
    checkpoints
        What it can resume from, if anything.
    """

    row: StageRun
    output: Path
    parent_path: Path | None = None
    threads: int = 1
    checkpoints: "Checkpoints | None" = None

    @property
    def folder(self) -> Path:
        """Folder of what is needed while the run is worked on."""
        return self.output.parent / CHECKPOINTS

    @cached_property
    def parent(self) -> xr.Dataset:
        """Result of the stage before."""
        row = self.row
        assert self.parent_path is not None, f"{row.stage} comes first"
        before = STAGES[STAGES.index(row.stage) - 1]
        return read_dataset(self.parent_path, stage=before, run=row.parent)

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """Lock the run while the block runs, and record why it failed if it does.

        Outside a folder of results, where no status is asked for, a parent that cannot be read is
        refused before any file is made.
        """
        in_results = (self.output.parent.name, self.output.stem) == (self.row.stage, self.row.id)
        if self.parent_path is not None and not in_results:
            _ = self.parent
        with run_lock(self.folder, self.row.id), failure_recorded(self.folder, self.row.id):
            yield

    def say(self, sentence: str) -> None:
        """Tell people something about the run."""
        print(f"{self.row.stage} {self.row.id}: {sentence}", file=sys.stderr, flush=True)

    def write(self, dataset: xr.Dataset) -> None:
        """Write the result with what produced it."""
        row, parents = self.row, [] if self.parent_path is None else [self.parent]
        kept = self.checkpoints
        origin = Job().labels(
            parents,
            fingerprint=fingerprint(row.stage),
            seed=row.parameters.seed,
            threads=self.threads,
            restarts=kept.restarts if kept else 0,
            core_seconds=kept.core_seconds if kept else None,
        )
        labelled = dataset.assign_attrs(
            parameters=stage_parameters(row.parameters, row.stage),
            parent=row.parent or "",
            mean_radius=row.parameters.suspension.mean_radius,
            area_fraction=row.parameters.suspension.area_fraction,
            **origin,
        )
        title = f"{row.stage} of a soft particle suspension"
        write_dataset(labelled, self.output, stage=row.stage, run=row.id, title=title)
        self.say(f"wrote {self.output}")


@app.command()
@one_line_errors
def packing(
    scenario: ScenarioName,
    run: RunName,
    output: Output,
    parameters: RunParameters = None,
    json_progress: JsonProgress = False,
) -> None:
    """Pack discs with LAMMPS."""
    from softslip.simulation.packing import pack

    job = _Job(_stage_run(scenario, "packing", run, parameters), output)
    shown = json_report if json_progress else silent_report
    with job.attempt(), interruptible(at_once=True), shown("packing") as report:
        job.write(pack(job.row.parameters))
        report(1, 1, 0.0)


@app.command()
@one_line_errors
def expansion(
    scenario: ScenarioName,
    run: RunName,
    parent: Parent,
    output: Output,
    parameters: RunParameters = None,
    json_progress: JsonProgress = False,
) -> None:
    """Grow discs into membranes at the area fraction of the scenario."""
    from softslip.simulation.expansion import expand

    job = _Job(_stage_run(scenario, "expansion", run, parameters), output, parent)
    with (
        job.attempt(),
        interruptible(at_once=False) as interruption,
        _shown("expansion", json_progress) as report,
    ):

        def tell(part: float) -> None:
            report(round(1000 * part), 1000, part)
            interruption.check()

        job.write(expand(job.parent, job.row.parameters, tell))


@contextmanager
def _resumable(job: _Job, interval: float, resume: bool) -> Iterator["Checkpointer"]:
    """Lock a run and write its checkpoints while the block runs; the last one is left."""
    from softslip.simulation.checkpoint import Identity
    from softslip.simulation.checkpoint_generations import Checkpoints
    from softslip.simulation.checkpointer import Checkpointer
    from softslip.simulation.end_state import EndState

    row = job.row
    with job.attempt(), interruptible(at_once=False) as interruption:
        identity = Identity(
            stage=row.stage,
            run=row.id,
            parent=str(job.parent.attrs[CONTENT_DIGEST]),
            fingerprint=fingerprint(row.stage),
            environment=environment(),
            parameters=stage_parameters(row.parameters, row.stage),
        )
        end_state = None
        if row.stage == "shear":
            trajectory = trajectory_id(row.parameters)
            end_state = EndState(job.folder, identity, trajectory, job.say)
        job.checkpoints = Checkpoints(
            job.folder, identity, job.say, required=resume, end_state=end_state
        )
        yield Checkpointer(job.checkpoints, interruption, interval)
        job.checkpoints.finish()


def _follow(
    job: _Job, follow: Callable[..., xr.Dataset], interval: float, resume: bool, as_json: bool
) -> None:
    """Follow a packing through time, from its checkpoint if it was interrupted."""
    with (
        _resumable(job, interval, resume) as checkpointer,
        _shown(job.row.stage, as_json) as report,
    ):
        job.write(follow(job.parent, job.row.parameters, report, job.threads, checkpointer))


@app.command()
@one_line_errors
def ageing(
    scenario: ScenarioName,
    run: RunName,
    parent: Parent,
    output: Output,
    parameters: RunParameters = None,
    threads: Threads = 1,
    checkpoint_interval: Interval = 60.0,
    resume: Resume = False,
    json_progress: JsonProgress = False,
) -> None:
    """Relax a packing at zero stress, with hydrodynamics."""
    from softslip.simulation.hydrodynamics import age

    job = _Job(_stage_run(scenario, "ageing", run, parameters), output, parent, threads)
    _follow(job, age, checkpoint_interval, resume, json_progress)


@app.command(name="shear")
@one_line_errors
def shear_command(
    scenario: ScenarioName,
    run: RunName,
    parent: Parent,
    output: Output,
    parameters: RunParameters = None,
    threads: Threads = 1,
    checkpoint_interval: Interval = 60.0,
    resume: Resume = False,
    json_progress: JsonProgress = False,
) -> None:
    """Shear an aged packing under constant stress or shear rate."""
    from softslip.simulation.hydrodynamics import shear

    job = _Job(_stage_run(scenario, "shear", run, parameters), output, parent, threads)
    _follow(job, shear, checkpoint_interval, resume, json_progress)
