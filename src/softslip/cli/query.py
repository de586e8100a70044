"""`softslip query`: the runs that a condition holds for, as a table, a file or a dataset."""

import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from softslip.cli.common import AsJson, check_output, one_line_errors
from softslip.cli.common import Results as ResultsFolder
from softslip.cli.export import SUFFIX
from softslip.cli.naming import is_scenario, not_there, refuse_second_folder, results_folder
from softslip.config.scenario import load_scenario
from softslip.errors import ConfigError
from softslip.files.storage import replacing, write_dataset
from softslip.messages import brief, counted, file_text, printable
from softslip.provenance.attribution import Job
from softslip.provenance.fingerprints import fingerprint

if TYPE_CHECKING:
    from softslip.provenance.catalogue.selection import Results

app = typer.Typer()

SHORTENED = {"commit": 10, "fingerprint": 10, "environment": 10, "lock_sha256": 10}
"""Characters that a table for people shows of digests."""

Source = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO_OR_FOLDER", help="Scenario, a folder of results, or a file in it."
    ),
]
Expression = Annotated[
    str, typer.Argument(metavar="EXPR", help="Such as 'roughness == 0 and stress > 0.1'.")
]
Columns = Annotated[
    str, typer.Option(metavar="A,B,C", help="What to show: any names that EXPR can have.")
]
Csv = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write the table as CSV.", readable=False)
]
NcOutput = Annotated[
    Path | None,
    typer.Option(metavar="FILE.nc", help="Gather the runs into a dataset.", readable=False),
]
Gathered = Annotated[
    str, typer.Option("--table", help="What --output gathers: flow_curve, creep or profiles.")
]


@app.command()
@one_line_errors
def query(
    source: Source,
    expression: Expression = "",
    columns: Columns = "",
    as_json: AsJson = False,
    csv: Csv = None,
    output: NcOutput = None,
    table: Gathered = "flow_curve",
    results: ResultsFolder = None,
) -> None:
    """List the runs that a condition on parameters or provenance holds for."""
    job = Job()
    if csv is not None:
        check_output(csv, "csv", [SUFFIX])
    if output is not None and output.suffix != ".nc":
        raise ConfigError("output", brief(str(output)), "does not end in .nc", "give out.nc")
    found = _opened(source, results)
    for sentence in found.unreadable:
        print(sentence, file=sys.stderr)
    chosen = found.query(expression) if expression.strip() else found
    named = [name.strip() for name in columns.split(",")] if columns.strip() else []
    frame = chosen.table(named)
    if output is not None:
        name = source if is_scenario(source) else chosen.folder.name
        _gather(chosen, table, output, job, name)
    if csv is not None:
        with replacing(csv) as temporary:
            frame.to_csv(temporary, index=False, lineterminator="\n")
    if as_json:
        contents = {"folder": str(chosen.folder), "query": expression, "runs": chosen.rows(named)}
        print(json.dumps(contents))
    elif csv is None and output is None:
        _show(chosen, frame, expression)


def _opened(source: str, results: Path | None) -> "Results":
    """Return the results of a folder, or of a scenario, which wins where a name is both."""
    from softslip.operations.scenario_status import scenario_status
    from softslip.provenance.catalogue.opening import open_results, scenario_results

    if not is_scenario(source) and os.path.exists(source):
        refuse_second_folder(results)
        return open_results(source if os.path.isdir(source) else results_folder(Path(source)))
    if not is_scenario(source) and "/" in source:
        raise not_there(source)
    scenario = load_scenario(source)
    folder = results or Path("results") / scenario.name
    states = {(run.stage, run.run): run.state for run in scenario_status(scenario, folder).runs}
    return scenario_results(scenario, folder, states)


def _gather(chosen: "Results", table: str, output: Path, job: Job, source: str) -> None:
    """Write the chosen runs' data as one dataset, with what it was made from."""
    gathered, parents = chosen.gathered(table)
    labels = job.labels(parents, fingerprint=fingerprint("gather"))
    labelled = gathered.assign_attrs(parameters=chosen.as_json(), **labels)
    name = Path(source).name.removesuffix(".yaml") or "results"
    asked = " and ".join(f"({each})" for each in chosen.asked)
    title = f"{table} of {name}" + f" where {asked}" * bool(asked)
    write_dataset(labelled, output, stage=table, run=name, title=title)
    print(f"wrote {table} of {len(parents)} runs to {output}", file=sys.stderr)


def _show(chosen: "Results", frame: Any, expression: str) -> None:
    """Print the table and how many runs it lists."""
    title = printable(expression) if expression.strip() else file_text(chosen.folder)
    table = Table(title=Text(title))
    for name in frame.columns:
        table.add_column(name, no_wrap=name == "run")
    for row in frame.itertuples(index=False):
        pairs = zip(frame.columns, row, strict=True)
        table.add_row(*(Text(_text(value)[: SHORTENED.get(name)]) for name, value in pairs))
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    console.print(counted(len(frame), "run"), highlight=False)


def _text(value: Any) -> str:
    if value is None or value != value:
        return ""
    return f"{value:g}" if isinstance(value, float) else printable(str(value))
