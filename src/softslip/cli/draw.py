"""`softslip draw`: a figure from datasets."""

import json
import os
from pathlib import Path
from typing import Annotated

import typer
import xarray as xr

from softslip.cli.common import Output, check_output, one_line_errors
from softslip.cli.naming import file_named, is_scenario, scenario_of
from softslip.config.scenario import load_scenario
from softslip.errors import ConfigError
from softslip.files.expected_results import finished_shears, run_shown
from softslip.files.layout import DATASET, FIGURE
from softslip.files.products import ANY_MORE, FIGURES, FITS, TABLES
from softslip.files.storage import read_dataset
from softslip.messages import brief, counted
from softslip.provenance.attribution import Job, parents_of
from softslip.provenance.fingerprints import fingerprint

app = typer.Typer()

FigureName = Annotated[str, typer.Argument(metavar="FIGURE", help=f"One of {', '.join(FIGURES)}.")]


@app.command()
@one_line_errors
def draw(
    figure: FigureName,
    data: Annotated[
        list[Path],
        typer.Argument(help="Datasets that it shows, or a scenario or folder.", readable=False),
    ],
    output: Output,
) -> None:
    """Draw a figure from datasets."""
    from softslip.analysis import figures
    from softslip.files.stamps import MOVING, STILLS

    if figure not in FIGURES:
        raise ConfigError(
            "figure", brief(figure), "is not a figure", f"use one of {', '.join(FIGURES)}"
        )
    check_output(output, endings=(MOVING,) if FIGURES[figure].suffix == MOVING else STILLS)
    datasets = _datasets(figure, data)
    drawn = figures.draw(figure, *datasets)
    labels = {
        "title": figure,
        "stage": FIGURE,
        "run": datasets[0].attrs["run"],
        "parameters": json.loads(datasets[0].attrs.get("parameters", "{}")),
        "parents": parents_of(datasets),
    }
    provenance = Job().provenance(datasets, fingerprint=fingerprint("draw"))
    figures.save_figure(drawn, output, labels, provenance)


def _datasets(figure: str, data: list[Path]) -> list[xr.Dataset]:
    """Read what a figure shows, and refuse files of another kind or too few or many of them."""
    kinds = list(FIGURES[figure].parents)
    if FIGURES[figure].sample and len(data) == 1 and _is_of_scenario(data[0]):
        data = [_run_shown(figure, data[0])]
    if len(data) == 1 and set(kinds) <= {*TABLES, FITS}:
        names = [f"{kind}{DATASET}" for kind in kinds]
        data = (
            data if not _is_of_scenario(data[0]) else [file_named(data[0], name) for name in names]
        )
    if kinds[-1] == ANY_MORE:
        kinds[-1:] = [kinds[-2]] * (len(data) - len(kinds) + 1)
    if len(kinds) != len(data):
        raise ConfigError(
            "data",
            f"{len(data)} files",
            f"are not what {figure} shows",
            f"give datasets of {', '.join(FIGURES[figure].parents)}",
        )
    stages = [kind.partition("/")[::2] for kind in kinds]
    return [
        read_dataset(path, stage=stage, run=run or None)
        for path, (stage, run) in zip(data, stages, strict=True)
    ]


def _is_of_scenario(given: Path) -> bool:
    """Return whether a scenario or its folder is given, not a file of its results."""
    return is_scenario(str(given)) or not os.path.isfile(given)


def _run_shown(figure: str, given: Path) -> Path:
    """Return the finished run of a scenario that a figure of one run shows."""
    name, results = scenario_of(str(given), None)
    scenario = load_scenario(name)
    folder = results or Path("results") / scenario.name
    run = run_shown(FIGURES[figure], scenario, finished_shears(folder))
    if run is None:
        least = FIGURES[figure].snapshots
        raise ConfigError(
            "data",
            brief(str(given)),
            f"has no finished run with {counted(least, 'snapshot')} after time 0",
            "finish one whose recording.snapshots has such times",
        )
    return folder / "shear" / f"{run}{DATASET}"
