"""`softslip verify`: whether results are what they say, and whether reruns repeat them."""

import json
import secrets
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from softslip.cli.common import FAILURE_EXIT, AsJson, Results, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.config.scenario import load_scenario
from softslip.errors import ConfigError
from softslip.files.storage import replacing
from softslip.messages import counted, duration

if TYPE_CHECKING:
    from softslip.provenance.verification import Rerun, RerunOutcome, Verdict, Verification

app = typer.Typer()

Sample = Annotated[
    int | None,
    typer.Option(min=1, metavar="N", help="Recompute N products, chosen at random, and compare."),
]
Full = Annotated[bool, typer.Option("--full", help="Recompute every product, and compare.")]
Stretch = Annotated[
    bool,
    typer.Option(
        "--stretch", help="Of runs that have left a checkpoint, recompute only the last stretch."
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(min=0, help="Seed of the random sample; a new one each time by default."),
]
Report = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.json", help="Write all that was found to this file.", readable=False
    ),
]
Every = Annotated[bool, typer.Option("--all", help="List sound files and all remarks too.")]
Complete = Annotated[bool, typer.Option("--complete", help="Count missing products as problems.")]

MOST_NAMED = 10
"""Missing products that are named without --all."""


@app.command()
@one_line_errors
def verify(
    scenario: ResultsName,
    results: Results = None,
    sample: Sample = None,
    full: Full = False,
    stretch: Stretch = False,
    seed: Seed = None,
    complete: Complete = False,
    report: Report = None,
    as_json: AsJson = False,
    every: Every = False,
) -> None:
    """Check the digests and the lineage of all results, and recompute some of them.

    The exit status is 0 if all is sound and 1 if there is any problem.
    """
    from softslip.provenance import verification

    started, clock = datetime.now(UTC), time.monotonic()
    _check_options(sample, full, stretch, seed, report)
    scenario, results = scenario_of(scenario, results)
    loaded = load_scenario(scenario)
    folder = results or Path("results") / loaded.name
    with _bar("reading") as advance:
        found = verification.verify(loaded, folder, lambda done, count: advance(done, count, ""))
    reruns: Sequence[Rerun] = verification.possible_reruns(found, stretch) if sample or full else ()
    if sample:
        seed = secrets.randbelow(2**32) if seed is None else seed
        reruns = verification.sampled(reruns, sample, seed)
    outcomes = _recomputed(reruns, scenario, folder, seed if sample else None)
    problems = len(found.problems) + sum(bool(each.problem) for each in outcomes)
    problems += len(found.missing) if complete else 0
    contents = {
        "verdict": "problem" if problems else "sound",
        **found.as_mapping(),
        "seed": seed if sample else None,
        "recomputed": [each.as_mapping() for each in outcomes],
        "times": {
            "started": f"{started:%Y-%m-%dT%H:%M:%SZ}",
            "seconds": round(time.monotonic() - clock, 3),
        },
    }
    if report is not None:
        with replacing(report) as temporary:
            temporary.write_text(json.dumps(contents, indent=1) + "\n", encoding="utf-8")
    if as_json:
        print(json.dumps(contents))
    else:
        _show(found, outcomes, every)
    if problems:
        raise typer.Exit(FAILURE_EXIT)


def _check_options(
    sample: int | None, full: bool, stretch: bool, seed: int | None, report: Path | None
) -> None:
    """Refuse options that contradict one another.

    Raises
    ------
    ConfigError
        Naming the one that is of no use.
    """
    if sample is not None and full:
        raise ConfigError("sample", sample, "is given with --full", "leave out one of the two")
    if stretch and not (sample or full):
        raise ConfigError("stretch", True, "is given alone", "give --sample N or --full too")
    if seed is not None and sample is None:
        raise ConfigError("seed", seed, "is given without --sample", "leave it out")
    if report is not None and report.suffix != ".json":
        raise ConfigError(
            "report", str(report), "does not end in .json", "give a file such as a.json"
        )


def _recomputed(
    reruns: "Sequence[Rerun]", scenario: str, folder: Path, seed: int | None
) -> "list[RerunOutcome]":
    """Recompute products, with a bar by the time that each took before."""
    from softslip.provenance.verification import reexecute

    if not reruns:
        return []
    total = sum(rerun.seconds for rerun in reruns)
    chosen = f", chosen with --seed {seed}" if seed is not None else ""
    print(
        f"recomputing {counted(len(reruns), 'result')}{chosen}; estimated {duration(total)}",
        file=sys.stderr,
    )
    outcomes, done = [], 0.0
    with _bar("recomputing") as advance:
        advance(0.0, total, reruns[0].name)
        for number, outcome in enumerate(reexecute(reruns, scenario, folder), start=1):
            outcomes.append(outcome)
            done += outcome.rerun.seconds
            following = reruns[number].name if number < len(reruns) else ""
            advance(done, total, following)
    return outcomes


@contextmanager
def _bar(what: str) -> "Iterator[Any]":
    """Yield a function that shows on standard error how far something is; nothing in a log."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[now]}"),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None, now="")

        def advance(done: float, total: float, now: str) -> None:
            bar.update(task, completed=done, total=total, now=now)

        yield advance


def _show(found: "Verification", outcomes: "list[RerunOutcome]", every: bool) -> None:
    """Print a table, problems first, what is missing, and how many there are of each."""
    console = Console(width=None if sys.stdout.isatty() else 160)
    outcome_of = {each.rerun.name: each for each in outcomes}
    rows = sorted(found.verdicts, key=lambda each: _rank(each, outcome_of.get(each.name)))
    table = Table("file", "verdict")
    if outcomes:
        table.add_column("recomputed")
    table.add_column("remarks")
    for verdict in rows:
        outcome = outcome_of.get(verdict.name)
        if every or outcome or _rank(verdict, outcome) < 2:
            table.add_row(*_cells(found.folder, verdict, outcome, bool(outcomes)))
    if table.row_count:
        console.print(table)
    named = found.missing if every else found.missing[:MOST_NAMED]
    for name in named:
        console.print(Text(f"missing: {name}"))
    if len(named) < len(found.missing):
        console.print(f"missing: {len(found.missing) - len(named)} more; --all names them")
    console.print(Text(_summary(found, outcomes)))


def _rank(verdict: "Verdict", outcome: "RerunOutcome | None") -> int:
    """Return 0 for problems, 1 for what is not of the scenario, and 2 for all else."""
    if verdict.problems or (outcome and outcome.problem):
        return 0
    return 1 if verdict.foreign else 2


def _cells(
    folder: Path, verdict: "Verdict", outcome: "RerunOutcome | None", with_outcome: bool
) -> list[Text | str]:
    problems = [*verdict.problems, *([outcome.problem] if outcome and outcome.problem else [])]
    remarks = ["not of this scenario"] if verdict.foreign else []
    # The file's name is in the first column.
    start = f"{folder / verdict.name}: "
    said = [each.removeprefix(start) for each in (*problems, *verdict.remarks)]
    cells: list[Text | str] = [Text(verdict.name), "problem" if problems else "sound"]
    if with_outcome:
        cells.append(f"{outcome.verdict} ({outcome.how})" if outcome else "")
    return [*cells, Text("\n".join([*remarks, *said]))]


def _summary(found: "Verification", outcomes: "list[RerunOutcome]") -> str:
    verdicts = found.verdicts
    wrong = {each.name for each in verdicts if each.problems}
    wrong |= {each.rerun.name for each in outcomes if each.problem}
    words = [
        counted(len(verdicts), "file"),
        f"{len(wrong)} with problems",
        f"{len(found.missing)} missing",
        f"{sum(each.foreign for each in verdicts)} not of this scenario",
        f"{sum(each.other_code for each in verdicts)} made by other code than there is now",
    ]
    if outcomes:
        words.append(f"{len(outcomes)} recomputed")
    return ", ".join(words)
