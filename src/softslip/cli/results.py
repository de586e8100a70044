"""From the files of runs to tables, fits and figures; what is in a scenario."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from softslip.cli.common import Output, Results, one_line_errors, tell_choice
from softslip.cli.naming import ResultsName, file_named, scenario_of
from softslip.config.reference import write_references
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.errors import ConfigError
from softslip.files.layout import DATASET
from softslip.files.products import COMPARISON, DATASETS, FITS, TABLES
from softslip.files.storage import read_dataset, write_dataset
from softslip.messages import brief
from softslip.provenance.attribution import Job, parents_of
from softslip.provenance.fingerprints import fingerprint
from softslip.provenance.scenario_file import NOTED, noted_file, refuse_other_file

app = typer.Typer()


TableName = Annotated[str, typer.Argument(metavar="TABLE", help=f"One of {', '.join(TABLES)}.")]


@app.command()
@one_line_errors
def gather(
    table: TableName, scenario: ResultsName, output: Output, results: Results = None
) -> None:
    """Gather the finished runs of a scenario into one dataset."""
    from softslip.provenance.catalogue.gathering import check_table, finished_runs, gather_table

    check_table(table)
    scenario, results = scenario_of(scenario, results)
    loaded = load_scenario(scenario)
    refuse_other_file(loaded, output.parent)
    folder = results or Path("results") / loaded.name
    gathered, parents = gather_table(table, finished_runs(loaded, folder))
    labelled = gathered.assign_attrs(
        parameters=loaded.as_json(),
        **Job().labels(parents, fingerprint=fingerprint("gather"), **{NOTED: noted_file(loaded)}),
    )
    write_dataset(labelled, output, stage=table, run=loaded.name, title=f"{table} of {loaded.name}")


@app.command()
@one_line_errors
def fit(
    flow_curve: Annotated[
        Path,
        typer.Argument(
            help="Dataset that `gather flow_curve` wrote, its folder, or a scenario.",
            readable=False,
        ),
    ],
    output: Output,
) -> None:
    """Fit the flow law and the slip laws to a flow curve, and say which could be fitted."""
    from softslip.analysis import fits

    curve = read_dataset(file_named(flow_curve, "flow_curve.nc"), stage="flow_curve")
    laws = fits.fit_laws(curve).assign_attrs(
        parameters=curve.attrs.get("parameters", "{}"),
        **Job().labels([curve], fingerprint=fingerprint("fit")),
    )
    run = curve.attrs["run"]
    write_dataset(laws, output, stage=FITS, run=run, title=f"{FITS} of {run}")
    print(fits.summary(laws, curve))


@app.command()
@one_line_errors
def compare(
    data: Annotated[
        list[Path],
        typer.Argument(help="Flow curve and fits, or their folder, or a scenario.", readable=False),
    ],
    output: Output,
) -> None:
    """Hold a scenario's yield stress, exponents and times against the paper's, as a table."""
    from softslip.analysis.against_paper import against_paper
    from softslip.analysis.comparison_markdown import comparison_table

    parents = DATASETS[COMPARISON].parents
    paths = data
    if len(data) == 1:
        paths = [file_named(data[0], f"{parent}{DATASET}") for parent in parents]
    if len(paths) != len(parents):
        limit = "are not a flow curve and its fits"
        raise ConfigError("data", f"{len(data)} files", limit, f"give {' and '.join(parents)}")
    read = [read_dataset(path, stage=each) for path, each in zip(paths, parents, strict=True)]
    if json.loads(read[1].attrs.get("parents", "[]")) != parents_of(read[:1]):
        limit, remedy = "were not fitted to that flow curve", f"run: softslip fit {paths[0]}"
        raise ConfigError("fits", brief(str(paths[1])), limit, remedy)
    run = read[0].attrs["run"]
    compared = against_paper(*read).assign_attrs(
        parameters=read[0].attrs.get("parameters", "{}"),
        **Job().labels(read, fingerprint=fingerprint("compare")),
    )
    write_dataset(compared, output, stage=COMPARISON, run=run, title=f"{COMPARISON} of {run}")
    print(comparison_table(compared.assign_attrs(run=run)), end="")


@app.command()
@one_line_errors
def runs(scenario: ResultsName, results: Results = None) -> None:
    """List the runs of a scenario with the IDs of their stages; finished ones are ticked."""
    scenario, results = scenario_of(scenario, results)
    loaded = load_scenario(scenario)
    folder = results or Path("results") / loaded.name
    table = Table(title=Text(f"{loaded.name}: {loaded.description}"))
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
    for parameters in {run.parameters.accuracy: run.parameters for run in loaded.runs()}.values():
        tell_choice(parameters)


@app.command()
@one_line_errors
def schema() -> None:
    """Write config/schema.json, config/defaults.yaml and the table in config/README.md."""
    for path in write_references(Path("config")):
        print(path)
