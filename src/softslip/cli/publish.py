"""`softslip effort`, `publish` and `reproduce`: what a campaign took, its results for others."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer
from rich.console import Console
from rich.markdown import Markdown

from softslip.cli.common import Results, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.config.scenario import Scenario, load_scenario
from softslip.files.layout import DATASET

app = typer.Typer()


def _named(given: str, results: Path | None) -> tuple[str, Scenario, Path]:
    """Return what a scenario is called, the scenario and the folder of its results."""
    from softslip.provenance.scenario_file import refuse_other_file

    name, results = scenario_of(given, results)
    scenario = load_scenario(name)
    folder = results or Path("results") / scenario.name
    refuse_other_file(scenario, folder)
    return name, scenario, folder


@app.command()
@one_line_errors
def effort(scenario: ResultsName, results: Results = None) -> None:
    """Say what the finished runs of a scenario took beside the plan, and what set their steps."""
    from softslip.operations.effort import measure_effort
    from softslip.operations.results_markdown import effort_table

    _, loaded, folder = _named(scenario, results)
    measured, _ = measure_effort(loaded, folder)
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(Markdown(effort_table(measured)))


@app.command()
@one_line_errors
def publish(
    scenario: ResultsName,
    results: Results = None,
    runs: Annotated[
        bool, typer.Option("--runs", help="Copy the files of its runs too, not only their tables.")
    ] = False,
) -> None:
    """Copy a scenario's datasets and figures to results/published, and write docs/results.md.

    The tables in the generated parts of docs/results.md that are called after the scenario are
    replaced. Its runs need not all be done: the document says how many are. With their files,
    which --runs copies, others can go on from there.
    """
    from softslip.files.products import EFFORT
    from softslip.files.storage import write_dataset
    from softslip.operations.effort import measure_effort
    from softslip.operations.publish import describe_research_object, publication_of
    from softslip.provenance.attribution import Job
    from softslip.provenance.fingerprints import fingerprint

    name, loaded, folder = _named(scenario, results)
    measured, parents = measure_effort(loaded, folder)
    # Its code is that of the runs that are counted.
    labelled = measured.assign_attrs(
        parameters=loaded.as_json(), **Job().labels(parents, fingerprint=fingerprint("shear"))
    )
    path = folder / f"{EFFORT}{DATASET}"
    write_dataset(labelled, path, stage=EFFORT, run=loaded.name, title=f"effort of {loaded.name}")
    describe_research_object(name, folder)
    for written in publication_of(loaded, folder if runs else None).write(folder):
        print(written)


@app.command()
@one_line_errors
def reproduce(
    scenario: ResultsName,
    results: Results = None,
    flow_curve: Annotated[
        Path | None,
        typer.Option(
            help="Flow curve of runs made elsewhere; of the runs made here by default.",
            readable=False,
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option(help="Dataset to write too; none by default.", readable=False)
    ] = None,
    publish: Annotated[
        bool,
        typer.Option(
            "--publish", help="Put the dataset into results/published, its table into the docs."
        ),
    ] = False,
) -> None:
    """Hold runs that were made again beside the published ones of a scenario.

    Make some of its runs, or all, anywhere; then this says which have the same bits as the
    published ones, and by how many standard errors the means of the others differ.
    """
    from softslip.files.products import REPRODUCTION
    from softslip.files.storage import read_dataset, write_dataset
    from softslip.operations.publish import PUBLISHED, reproduction_of
    from softslip.operations.reproduction import measure_reproduction
    from softslip.operations.results_markdown import reproduction_table
    from softslip.provenance.attribution import Job
    from softslip.provenance.catalogue.gathering import finished_runs, gather_table
    from softslip.provenance.fingerprints import fingerprint

    _, loaded, folder = _named(scenario, results)
    published = read_dataset(
        PUBLISHED / loaded.name / f"flow_curve{DATASET}", stage="flow_curve", run=loaded.name
    )
    if flow_curve is None:
        gathered, runs = gather_table("flow_curve", finished_runs(loaded, folder))
        again = gathered.assign_attrs(Job().labels(runs, fingerprint=fingerprint("gather")))
    else:
        again = read_dataset(flow_curve, stage="flow_curve", run=loaded.name)
    # What was made again is named by its digests: it need not be in this folder, or stay in it.
    labelled = measure_reproduction(published, again).assign_attrs(
        parameters=loaded.as_json(),
        **Job().labels([published], fingerprint=fingerprint("gather")),
    )
    title = f"{REPRODUCTION} of {loaded.name}"

    def write(path: Path) -> None:
        write_dataset(labelled, path, stage=REPRODUCTION, run=loaded.name, title=title)

    if output is not None:
        write(output)
    console = Console(width=None if sys.stdout.isatty() else 200)
    console.print(Markdown(reproduction_table(labelled)))
    if publish:
        # Not among the scenario's own results: it was made from the published flow curve.
        with TemporaryDirectory() as made:
            write(Path(made) / f"{REPRODUCTION}{DATASET}")
            for written in reproduction_of(loaded).write(Path(made)):
                print(written)
