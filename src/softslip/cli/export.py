"""`softslip export`: the numbers of a figure or a dataset as CSV."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from softslip.cli.common import check_output, one_line_errors
from softslip.cli.naming import overview_file

app = typer.Typer()

SUFFIX = ".csv"
"""Of the files that are written."""

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


@app.command()
@one_line_errors
def export(target: Target, csv: CsvOutput = None, results: FigureData = None) -> None:
    """Write the numbers that a figure shows, or a dataset holds, as CSV."""
    from softslip.provenance.export import save_csv, target_table, write_csv

    if csv is not None:
        check_output(csv, "output", [SUFFIX])
    table, notes = target_table(overview_file(target), results)
    for note in notes:
        print(note, file=sys.stderr)
    if csv is None:
        write_csv(table, sys.stdout)
    else:
        count = save_csv(table, csv)
        print(f"wrote {count} rows to {csv}", file=sys.stderr)
