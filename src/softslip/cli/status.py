"""`softslip status` and `softslip clean`: how far the runs are, and removal of leftovers."""

import gc
import json
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console, Group, RenderableType
from rich.filesize import decimal
from rich.live import Live
from rich.table import Table
from rich.text import Text

from softslip.cli.common import AsJson, Results, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.config.scenario import Scenario, load_scenario
from softslip.config.stages import STAGES
from softslip.errors import ConfigError
from softslip.messages import counted, duration

if TYPE_CHECKING:
    from softslip.operations.lock import Holder
    from softslip.operations.scenario_status import RunStatus, ScenarioStatus

app = typer.Typer()

ORDER = ("running", "failed", "interrupted", "missing", "done")
"""States in the order of the table of runs."""

MOST_MISSING = 50
"""Missing runs that are listed unless all are asked for: nothing is to be seen of them."""

LONGEST_ERROR = 60
"""Characters of a failed run's error that the table shows."""

Watch = Annotated[
    float | None,
    typer.Option(min=0.1, metavar="SECONDS", help="Refresh until all runs are done."),
]
Every = Annotated[bool, typer.Option("--all", help="List every run, those that are done too.")]
AllCheckpoints = Annotated[
    bool,
    typer.Option(
        "--all",
        help="Remove those of interrupted and failed runs too, which then start over, and the "
        "ends of finished runs, from which longer ones continue.",
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Only say what would be removed.")]


@app.command()
@one_line_errors
def status(
    scenario: ResultsName,
    results: Results = None,
    as_json: AsJson = False,
    every: Every = False,
    watch: Watch = None,
) -> None:
    """Say how far the runs of a scenario are: done, running, failed, interrupted or missing."""
    from softslip.operations.scenario_status import scenario_status

    if as_json and watch is not None:
        raise ConfigError("watch", watch, "is given with --json", "leave out one of the two")
    scenario, results = scenario_of(scenario, results)
    with uncollected():
        loaded = load_scenario(scenario)
    folder = results or Path("results") / loaded.name
    remedy = shlex.join(["softslip", "clean", scenario, *_results_option(results)])
    if as_json:
        print(json.dumps(_as_mapping(loaded, folder, scenario_status(loaded, folder))))
    elif watch is None:
        found = scenario_status(loaded, folder)
        shown = *_runs_table(loaded, found, every), *_summary(loaded, found, remedy)
        _console().print(Group(*shown), crop=False)
    else:
        _watch(loaded, folder, every, watch, remedy)


@contextmanager
def uncollected() -> Iterator[None]:
    """Let no garbage be looked for: of thousands of runs none is, and looking takes its time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _results_option(results: Path | None) -> list[str]:
    return [] if results is None else ["--results", str(results)]


def _console() -> Console:
    return Console(width=None if sys.stdout.isatty() else 160)


def _watch(scenario: Scenario, folder: Path, every: bool, interval: float, remedy: str) -> None:
    """Refresh the status until all runs are done or the user interrupts."""
    from softslip.operations.scenario_status import scenario_status

    console = _console()
    with suppress(KeyboardInterrupt), Live(console=console, auto_refresh=False) as live:
        while True:
            found = scenario_status(scenario, folder)
            # On top is what stays in sight when there are more rows than lines.
            top = _summary(scenario, found, remedy)
            if console.is_terminal:
                rows = _runs_table(scenario, found, every, most=console.height)
                live.update(Group(*top, *rows), refresh=True)
            else:
                console.print(Group(*top, *_runs_table(scenario, found, every)), crop=False)
            if all(run.state == "done" for run in found.runs):
                return
            time.sleep(interval)


def _summary(scenario: Scenario, found: "ScenarioStatus", remedy: str) -> list[RenderableType]:
    """Return a table with a row for each stage, between lines on the scenario and checkpoints."""
    from softslip.operations.scenario_status import STATES

    table = Table("stage")
    for state in STATES:
        table.add_column(state, justify="right")
    for stage in STAGES:
        counts = found.counts(stage)
        table.add_row(stage, *(str(counts[state]) for state in STATES))
    files = found.checkpoints
    total = decimal(sum(file.size for file in files))
    lines = [f"{counted(len(files), 'checkpoint')}, {total}"]
    damaged = sum(file.verdict == "damaged" for file in files)
    if damaged:
        lines.append(f"{counted(damaged, 'checkpoint')} damaged")
    if found.stale:
        size = decimal(sum(file.size for file in found.stale))
        count = counted(len(found.stale), "stale checkpoint")
        lines.append(f"{count}, {size}; to remove them: {remedy}")
    if any(run.state == "interrupted" for run in found.runs):
        lines.append("interrupted runs resume from their checkpoints; rerun the same command")
    # A command that is broken over two lines cannot be copied.
    unbroken = [Text(line, no_wrap=True, overflow="ignore") for line in lines]
    return [Text(f"{scenario.name}: {scenario.description}"), table, *unbroken]


def _runs_table(
    scenario: Scenario, found: "ScenarioStatus", every: bool, most: int | None = None
) -> list[RenderableType]:
    """Return a table with a row for each run of a stage that is not done, or for all, if any.

    Those that run come first. There are no more rows than asked for, and of the missing ones only
    the first, unless all are asked for.
    """
    shown = [run for run in found.runs if every or run.state != "done"]
    shown.sort(key=lambda run: ORDER.index(run.state))
    if not shown:
        return []
    missing = sum(run.state == "missing" for run in shown)
    hidden = 0 if every else max(missing - MOST_MISSING, 0)
    shown = shown[: len(shown) - hidden]
    table = Table("stage")
    table.add_column("run", no_wrap=True)
    for axis in scenario.axes:
        table.add_column(axis.label)
    table.add_column("state")
    for name in ("time", "of", "part", "step", "steps/s", "left", "written", "restarts"):
        table.add_column(name, justify="right")
    table.add_column("remarks")
    for run in shown[:most]:
        values = [str(run.coordinates.get(axis.label, "")) for axis in scenario.axes]
        table.add_row(run.stage, run.run, *values, run.state, *_progress(run), _remarks(run))
    note = f"and {counted(hidden, 'missing run')} more; to list them all: --all"
    return [table, Text(note)] if hidden else [table]


def _progress(run: "RunStatus") -> list[str]:
    """Return the cells from a run's time to its restarts."""
    progress = run.progress
    if progress is None:
        return [""] * 8
    return [
        f"{progress.time:.4g}",
        f"{progress.end:g}",
        f"{progress.fraction:.1%}",
        str(progress.step),
        "" if progress.rate is None else f"{progress.rate:.3g}",
        "" if progress.remaining is None else duration(progress.remaining),
        f"{duration(max(time.time() - progress.written, 0.0))} ago",
        str(progress.restarts),
    ]


def _remarks(run: "RunStatus") -> Text:
    """Return who works on a run, why it failed, and what is wrong with its checkpoints."""
    words = [] if run.holder is None else [str(run.holder)]
    if run.killed is not None:
        words.append(f"{run.killed} was killed or crashed")
    if run.failure is not None:
        error = str(run.failure)
        cut = len(error) > LONGEST_ERROR
        words.append(f"{error[: LONGEST_ERROR - 1]}…" if cut else error)
    if run.damaged:
        words.append(f"{counted(run.damaged, 'checkpoint')} damaged")
    # An error may hold brackets, which are no markup.
    return Text(", ".join(words))


def _as_mapping(scenario: Scenario, folder: Path, found: "ScenarioStatus") -> dict[str, Any]:
    """Return the status as JSON has it; what is not known is null."""
    return {
        "scenario": scenario.name,
        "results": str(folder),
        "stages": {stage: found.counts(stage) for stage in STAGES},
        "runs": [_run_mapping(run) for run in found.runs],
        "checkpoints": {
            "files": len(found.checkpoints),
            "bytes": sum(file.size for file in found.checkpoints),
            "damaged": sum(file.verdict == "damaged" for file in found.checkpoints),
            "stale": len(found.stale),
            "stale_bytes": sum(file.size for file in found.stale),
        },
    }


def _run_mapping(run: "RunStatus") -> dict[str, Any]:
    words: dict[str, Any] = {
        "stage": run.stage,
        "run": run.run,
        "coordinates": dict(run.coordinates),
        "state": run.state,
        "damaged": run.damaged,
        "error": None if run.failure is None else str(run.failure),
        "failure": None if run.failure is None else vars(run.failure),
        "progress": None,
        "holder": _holder(run.holder),
        "killed": _holder(run.killed),
    }
    if run.progress is not None:
        words["progress"] = vars(run.progress) | {"fraction": run.progress.fraction}
    return words


def _holder(holder: "Holder | None") -> dict[str, Any] | None:
    if holder is None:
        return None
    return vars(holder) | {"started": holder.started and holder.started.isoformat()}


@app.command()
@one_line_errors
def clean(
    scenario: ResultsName,
    results: Results = None,
    everything: AllCheckpoints = False,
    dry_run: DryRun = False,
) -> None:
    """Remove checkpoints that nobody needs any more, and files left by killed processes."""
    from softslip.operations.leftovers import remove
    from softslip.operations.scenario_status import scenario_status

    scenario, results = scenario_of(scenario, results)
    loaded = load_scenario(scenario)
    folder = results or Path("results") / loaded.name
    found = scenario_status(loaded, folder).leftovers(everything)
    word = "would remove" if dry_run else "removed"
    count = total = 0
    for file in found if dry_run else remove(folder, found, _print_error):
        print(f"{word} {file.path.relative_to(folder)} ({decimal(file.size)}): {file.reason}")
        count, total = count + 1, total + file.size
    print(f"{word} {counted(count, 'file')}, {decimal(total)} ({total} bytes)")


def _print_error(sentence: str) -> None:
    print(sentence, file=sys.stderr)
