"""`softslip plan`: what Snakemake would do for a scenario, and what that will take."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console, Group, RenderableType
from rich.filesize import decimal
from rich.table import Table
from rich.text import Text

from softslip.cli.common import AsJson, Results, check_output, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.cli.status import uncollected
from softslip.config.scenario import Scenario, load_scenario
from softslip.config.stages import STAGES
from softslip.messages import counted, duration

if TYPE_CHECKING:
    from softslip.operations.schedule import Plan, PlannedRun, StagePlan

app = typer.Typer()

MOST_ROWS = 50
"""Runs that are listed unless all are asked for."""

HOUR = 3600.0

Requests = Annotated[
    bool,
    typer.Option(
        "--requests",
        help="Compare the time that batch jobs would request with what finished runs took.",
    ),
]
Every = Annotated[bool, typer.Option("--all", help="List every run, those that are reused too.")]
Cores = Annotated[int, typer.Option(min=1, help="Cores that the wall time is estimated for.")]
Against = Annotated[
    str | None,
    typer.Option(metavar="SCENARIO", help="List what this other scenario does not have."),
]
Table_ = Annotated[
    Path, typer.Argument(metavar="FILE", help="The table to write, JSON.", readable=False)
]


@app.command()
@one_line_errors
def plan(
    scenario: ResultsName,
    results: Results = None,
    as_json: AsJson = False,
    against: Against = None,
    cores: Cores = 2,
    every: Every = False,
    requests: Requests = False,
) -> None:
    """Say what snakemake would run for a scenario, what it would reuse, and what that takes.

    Counted are the stages of the runs; the tables and figures made from them take seconds each.
    """
    from softslip.operations.planning import make_plan
    from softslip.provenance.scenario_file import refuse_other_file

    scenario, results = scenario_of(scenario, results)
    with uncollected():
        loaded = load_scenario(scenario)
        other = None if against is None else load_scenario(against)
        folder = results or Path("results") / loaded.name
        refuse_other_file(loaded, folder)
        if requests:
            _tell_requests(loaded, folder, as_json)
            return
        made = make_plan(loaded, folder, other)
    if as_json:
        print(json.dumps(_as_mapping(loaded, folder, made, other, cores)))
        return
    title = Text(f"{loaded.name}: {loaded.description}")
    rows = _runs_table(loaded, made, every)
    console = Console(width=None if sys.stdout.isatty() else 160)
    shown = Group(title, _summary(made), *_remarks(made, other, cores), *rows)
    console.print(shown, crop=False)


@app.command()
@one_line_errors
def calibrate(table: Table_) -> None:
    """Measure for some minutes what runs cost here, and write the table that plans start from."""
    from softslip.operations.calibration import calibrate as measure

    check_output(table, "table", (".json",))
    measure(table, _print_error)


def _print_error(sentence: str) -> None:
    print(sentence, file=sys.stderr, flush=True)


def _tell_requests(scenario: Scenario, folder: Path, as_json: bool) -> None:
    """Print how the time that jobs request fits what finished runs took."""
    from softslip.operations.job_requests import SLACK
    from softslip.operations.request_fit import request_fits

    fits = request_fits(scenario, folder)
    if as_json:
        rows = [
            {"stage": fit.stage, "estimate": fit.estimate, "ratios": list(fit.ratios)}
            for fit in fits
        ]
        print(json.dumps({"scenario": scenario.name, "requests": rows}))
        return
    if not fits:
        print(f"no ageing or shear of {scenario.name} is finished")
        return
    table = Table("stage", "estimate from", title="time requested over time used")
    heads = ("runs", "least 5 %", "median", "most 5 %", f"within {SLACK:g}", "sufficient")
    for head in heads:
        table.add_column(head, justify="right")
    for fit in fits:
        ratios = [f"{fit.quantile(share):.2f}" for share in (0.05, 0.5, 0.95)]
        shares = [f"{100 * share:.0f} %" for share in (fit.within, fit.sufficient)]
        table.add_row(fit.stage, fit.estimate, str(len(fit.ratios)), *ratios, *shares)
    Console(width=None if sys.stdout.isatty() else 160).print(table, crop=False)


def _summary(made: "Plan") -> Table:
    """Return a table with a row for each stage, and one for all of them."""
    from softslip.operations.schedule import Action

    table = Table("stage")
    names = {
        Action.BEGIN: "to do",
        Action.RESUME: "to resume",
        Action.RUNNING: "running",
        Action.REUSE: "reused",
    }
    if any(stage.counts[Action.SKIP] for stage in made.stages.values()):
        names[Action.SKIP] = "not needed"
    for name in (*names.values(), "core-hours", "give or take", "disk"):
        table.add_column(name, justify="right")
    table.add_column("because")
    for name, stage in made.stages.items():
        counts = [str(stage.counts[action]) for action in names]
        because = ", ".join(f"{reason} {count}" for reason, count in stage.reasons.items())
        table.add_row(name, *counts, *_cost(stage), because)
    table.add_section()
    totals = [str(sum(stage.counts[action] for stage in made.stages.values())) for action in names]
    table.add_row("all", *totals, *_cost(made), "")
    return table


def _cost(part: "Plan | StagePlan") -> list[str]:
    """Return the cells of what is left to do, empty where nothing is."""
    if not part.core_seconds:
        return ["", "", ""]
    return [f"{part.core_seconds / HOUR:.3g}", f"× {part.factor:.2g}", decimal(round(part.size))]


def _remarks(made: "Plan", other: Scenario | None, cores: int) -> list[RenderableType]:
    """Return lines on time, on where estimates come from, and on what needs attention."""
    from softslip.operations.schedule import Reason

    lines = []
    if made.chain:
        path = " → ".join(f"{run.stage} {run.run[:8]}" for run in made.chain)
        longest = duration(sum(run.core_seconds for run in made.chain))
        wall = duration(made.wall_seconds(cores))
        lines.append(f"longest chain: {longest} ({path})")
        lines.append(f"wall time on {counted(cores, 'core')}: about {wall}")
        finished = sum(made.stages[stage].finished for stage in STAGES)
        source = counted(finished, "finished run") if finished else "the runs of costs.json"
        lines.append(f"estimated from {source}")
    else:
        lines.append("nothing to do")
    changed = sum(stage.reasons.get(Reason.CHANGED, 0) for stage in made.stages.values())
    if changed:
        lines.append(f"{counted(changed, 'dataset')} made by other code than the present one")
    damaged = [run for run in made.runs if run.reason == Reason.DAMAGED]
    if damaged:
        paths = ", ".join(f"{run.stage}/{run.run}.nc" for run in damaged)
        lines.append(f"cannot be read, and Snakemake does not notice; delete: {paths}")
    if other is not None and made.gone is not None:
        gone = ", ".join(f"{len(runs)} {stage}" for stage, runs in made.gone.items())
        lines.append(f"only in {other.name}: {gone}")
    return [Text(line, no_wrap=True, overflow="ignore") for line in lines]


def _runs_table(scenario: Scenario, made: "Plan", every: bool) -> list[RenderableType]:
    """Return a table with a row for each run that is new in a sweep, or for all, if any.

    Where nothing was ever done, all runs are new, and the scenario is shorter than their list.
    """
    from softslip.operations.schedule import Action

    extended = made.gone is not None or any(run.action == Action.REUSE for run in made.runs)
    shown = [run for run in made.runs if every or (run.new and extended)]
    if not shown:
        return []
    hidden = 0 if every else max(len(shown) - MOST_ROWS, 0)
    table = Table("stage", title=None if every else "new runs", title_justify="left")
    table.add_column("run", no_wrap=True)
    for axis in scenario.axes:
        table.add_column(axis.label)
    table.add_column("action")
    table.add_column("because")
    for name in ("done", "left", "disk"):
        table.add_column(name, justify="right")
    for run in shown[: len(shown) - hidden]:
        values = [str(run.coordinates.get(axis.label, "")) for axis in scenario.axes]
        table.add_row(run.stage, run.run, *values, run.action, run.reason, *_amounts(run))
    note = f"and {counted(hidden, 'new run')} more; to list them all: --all"
    return [table, Text(note)] if hidden else [table]


def _amounts(run: "PlannedRun") -> list[str]:
    """Return the cells of what is done and what is left."""
    if not run.is_open:
        return ["", "", ""]
    done = f"{run.fraction:.1%}" if run.fraction else ""
    return [done, duration(run.core_seconds), decimal(round(run.size))]


def _as_mapping(
    scenario: Scenario, folder: Path, made: "Plan", other: Scenario | None, cores: int
) -> dict[str, Any]:
    """Return the plan as JSON has it."""
    return {
        "scenario": scenario.name,
        "results": str(folder),
        "against": None if other is None else other.name,
        "stages": {
            name: {**vars(stage), "counts": dict(stage.counts), "reasons": dict(stage.reasons)}
            for name, stage in made.stages.items()
        },
        "core_seconds": made.core_seconds,
        "bytes": made.size,
        "factor": made.factor,
        "cores": cores,
        "wall_seconds": made.wall_seconds(cores),
        "chain": [{"stage": run.stage, "run": run.run} for run in made.chain],
        "chain_seconds": sum(run.core_seconds for run in made.chain),
        "gone": made.gone,
        "runs": [{**vars(run), "coordinates": dict(run.coordinates)} for run in made.runs],
    }
