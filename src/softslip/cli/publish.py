"""`softslip effort` and `softslip publish`: what a campaign took, and its results for others."""

import sys
from pathlib import Path

import typer
from rich.console import Console
from rich.markdown import Markdown

from softslip.cli.common import Results, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.config.scenario import Scenario, load_scenario
from softslip.files.layout import DATASET

app = typer.Typer()


def _named(name: str, results: Path | None) -> tuple[Scenario, Path]:
    """Return a scenario and the folder of its results."""
    from softslip.provenance.scenario_file import refuse_other_file

    name, results = scenario_of(name, results)
    scenario = load_scenario(name)
    folder = results or Path("results") / scenario.name
    refuse_other_file(scenario, folder)
    return scenario, folder


@app.command()
@one_line_errors
def effort(scenario: ResultsName, results: Results = None) -> None:
    """Say what the finished runs of a scenario took beside the plan, and what set their steps."""
    from softslip.operations.effort import measure_effort
    from softslip.operations.results_markdown import effort_table

    measured, _ = measure_effort(*_named(scenario, results))
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(Markdown(effort_table(measured)))


@app.command()
@one_line_errors
def publish(scenario: ResultsName, results: Results = None) -> None:
    """Copy a scenario's datasets and figures to results/published, and write docs/results.md.

    The tables in the generated parts of docs/results.md that are called after the scenario are
    replaced. Its runs need not all be done: the document says how many are.
    """
    from softslip.files.products import EFFORT
    from softslip.files.storage import write_dataset
    from softslip.operations.effort import measure_effort
    from softslip.operations.publish import publication_of
    from softslip.provenance.attribution import Job
    from softslip.provenance.fingerprints import fingerprint

    loaded, folder = _named(scenario, results)
    measured, parents = measure_effort(loaded, folder)
    # Its code is that of the runs that are counted.
    labelled = measured.assign_attrs(
        parameters=loaded.as_json(), **Job().labels(parents, fingerprint=fingerprint("shear"))
    )
    path = folder / f"{EFFORT}{DATASET}"
    write_dataset(labelled, path, stage=EFFORT, run=loaded.name, title=f"effort of {loaded.name}")
    for written in publication_of(loaded).write(folder):
        print(written)
