"""`softslip explorer`: a page for the browser that shows all runs of a scenario."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

from softslip.cli.common import Results, check_output, one_line_errors
from softslip.cli.naming import ResultsName, scenario_of
from softslip.config.scenario import Scenario, load_scenario
from softslip.config.sweep_order import priorities
from softslip.errors import DatasetError
from softslip.files.layout import DATASET, FIGURE, PAGE
from softslip.files.products import EXPLORER, PAGES, TABLES
from softslip.files.storage import CONTENT_DIGEST, read_dataset
from softslip.messages import file_text
from softslip.provenance.attribution import Job, parents_of, read_provenance
from softslip.provenance.fingerprints import fingerprint

app = typer.Typer()

ORIGIN = (
    *("commit", "dirty", "fingerprint", "environment", "host", "processor"),
    *("started", "ended", "core_seconds", "restarts", "seed"),
)
"""What the page says of where a run comes from."""

PageOutput = Annotated[Path, typer.Option("--output", help="File to write.", readable=False)]


@app.command()
@one_line_errors
def explorer(scenario: ResultsName, page: PageOutput, results: Results = None) -> None:
    """Write a page for the browser that shows all runs of a scenario."""
    from softslip.analysis.explorer.page import explorer_page, save_page

    check_output(page, "output", [PAGE])
    scenario, results = scenario_of(scenario, results)
    loaded = load_scenario(scenario)
    folder = results or Path("results") / loaded.name
    stages = [stage for stage in PAGES[EXPLORER].parents if stage in TABLES]
    tables = [
        read_dataset(folder / f"{stage}{DATASET}", stage=stage, run=loaded.name) for stage in stages
    ]
    runs: list[xr.Dataset] = []
    curve, creep, profiles = tables
    written = explorer_page(curve, creep, profiles, _noted(_runs(loaded, folder, tables), runs))
    labels = {
        "title": EXPLORER,
        "stage": FIGURE,
        "run": loaded.name,
        "parameters": json.loads(tables[0].attrs["parameters"]),
        "parents": parents_of([*tables, *runs]),
    }
    origins = {str(run.attrs["run"]): _origin(run) for run in runs}
    provenance = Job().provenance([*tables, *runs], fingerprint=fingerprint(EXPLORER), runs=origins)
    save_page(written, page, labels, provenance)


def _runs(scenario: Scenario, folder: Path, tables: list[xr.Dataset]) -> Iterator[xr.Dataset]:
    """Yield the runs that the tables were made from, the most useful first.

    Raises
    ------
    DatasetError
        When the tables were not made from the same runs, or not from those that are there.
    """
    parents = [json.loads(table.attrs["parents"]) for table in tables]
    for table, other in zip(tables, parents, strict=True):
        name = f"{table.attrs['stage']}{DATASET}"
        if other != parents[0]:
            raise DatasetError(
                f"{file_text(folder / name)}: was made from other "
                f"runs than {tables[0].attrs['stage']}{DATASET}; "
                "rerun: snakemake --cores 2 explorer"
            )
    digests = {str(each["run"]): str(each[CONTENT_DIGEST]) for each in parents[0]}
    order = priorities(scenario)["shear"]
    for run in sorted(digests, key=lambda each: (-order.get(each, 0), each)):
        path = folder / "shear" / f"{run}{DATASET}"
        read = read_dataset(path, stage="shear", run=run)
        if read.attrs[CONTENT_DIGEST] != digests[run]:
            raise DatasetError(
                f"{file_text(path)}: is not the run that {tables[0].attrs['stage']}{DATASET} was "
                "made from; rerun: snakemake --cores 2 explorer"
            )
        yield read


def _noted(runs: Iterator[xr.Dataset], seen: list[xr.Dataset]) -> Iterator[xr.Dataset]:
    """Yield runs, and keep the labels of each, as a dataset without data."""
    for run in runs:
        seen.append(xr.Dataset(attrs=run.attrs))
        yield run


def _origin(run: xr.Dataset) -> dict[str, Any]:
    record = read_provenance(run.attrs)
    return {key: record.get(key) for key in ORIGIN}
