"""`softslip export`: the numbers of a figure or a dataset as CSV, or as a rheometer's table."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from softslip.cli.common import check_output, one_line_errors
from softslip.cli.naming import file_named, overview_file
from softslip.errors import ConfigError
from softslip.files.layout import DATASET
from softslip.files.storage import read_dataset
from softslip.messages import brief, counted

app = typer.Typer()

SUFFIX = ".csv"
"""Of the files that are written."""

FLOW_CURVE = "flow_curve"
"""Dataset of a scenario that a rheometer's table is of."""

Target = Annotated[
    str,
    typer.Argument(
        metavar="TARGET",
        help="Figure, dataset.nc, dataset.nc:variable, folder of results or scenario.",
    ),
]
CsvOutput = Annotated[
    Path | None,
    typer.Option("--output", help="File to write; standard output by default.", readable=False),
]
FigureData = Annotated[
    Path | None,
    typer.Option(
        help="Folder of a figure's datasets, if they do not lie where it expects them.",
        readable=False,
    ),
]
AsRheometer = Annotated[
    bool,
    typer.Option(
        "--rheometer",
        help="Write the flow curve in Pa, s and µm, for programs that fit rheometers' tables; "
        "needs the three numbers below.",
    ),
]
Viscosity = Annotated[
    float | None, typer.Option(help="Viscosity of the laboratory's solvent [Pa s].")
]
ElasticConstant = Annotated[
    float | None, typer.Option(help="Elastic constant K_e of the laboratory's particles [N/m].")
]
Radius = Annotated[
    float | None, typer.Option(help="Mean radius of the laboratory's particles [µm].")
]
ShearRate = Annotated[
    str | None,
    typer.Option("--rate", help="Shear rate: bulk (the default), or wall, which includes slip."),
]
PointsWhere = Annotated[
    str | None,
    typer.Option("--where", help="Points to write, such as 'roughness == 0'; all by default."),
]
ColumnLayout = Annotated[
    str | None,
    typer.Option("--layout", help="Names of the columns: plain (the default), or rheofit."),
]


@app.command()
@one_line_errors
def export(
    target: Target,
    csv: CsvOutput = None,
    results: FigureData = None,
    rheometer: AsRheometer = False,
    viscosity: Viscosity = None,
    elastic_constant: ElasticConstant = None,
    radius: Radius = None,
    rate: ShearRate = None,
    where: PointsWhere = None,
    layout: ColumnLayout = None,
) -> None:
    """Write the numbers that a figure shows, or a dataset holds, as CSV."""
    if csv is not None:
        check_output(csv, "output", [SUFFIX])
    laboratory = {"viscosity": viscosity, "elastic-constant": elastic_constant, "radius": radius}
    choices = {"rate": rate, "where": where, "layout": layout}
    if rheometer:
        _write_rheometer_table(target, csv, laboratory, choices)
        return
    for name, value in {**laboratory, **choices}.items():
        if value is not None:
            limit = "is given, but belongs to --rheometer"
            raise ConfigError(name, brief(value), limit, "add --rheometer, or leave it out")
    _write_numbers(target, csv, results)


def _write_numbers(target: str, csv: Path | None, results: Path | None) -> None:
    """Write what a target shows or holds."""
    from softslip.provenance.export import save_csv, target_table, write_csv

    table, notes = target_table(overview_file(target), results)
    for note in notes:
        print(note, file=sys.stderr)
    if csv is None:
        write_csv(table, sys.stdout)
    else:
        count = save_csv(table, csv)
        print(f"wrote {count} rows to {csv}", file=sys.stderr)


def _write_rheometer_table(
    target: str,
    csv: Path | None,
    laboratory: Mapping[str, float | None],
    choices: Mapping[str, str | None],
) -> None:
    """Write the flow curve of a target in the units of a laboratory."""
    from softslip.provenance.export.rheometer_table import METADATA, rheometer_table

    path = file_named(Path(target), f"{FLOW_CURVE}{DATASET}")
    given = {name: choice for name, choice in choices.items() if choice is not None}
    table = rheometer_table(read_dataset(path, stage=FLOW_CURVE), laboratory, **given)
    for note in table.remarks:
        print(note, file=sys.stderr)
    if csv is None:
        table.write(sys.stdout)
    else:
        rows = counted(table.save(csv), "row")
        print(f"wrote {rows} to {csv}, and what they are to {csv}{METADATA}", file=sys.stderr)
