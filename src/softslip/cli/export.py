"""`softslip export`: the numbers of a figure or a dataset as CSV."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from softslip.cli.common import one_line_errors
from softslip.errors import ConfigError
from softslip.fields import brief

app = typer.Typer()

SUFFIX = ".csv"
"""Of the files that are written."""

Target = Annotated[
    str, typer.Argument(metavar="TARGET", help="Figure, dataset.nc or dataset.nc:variable.")
]
CsvOutput = Annotated[
    Path | None, typer.Option("--output", help="File to write; standard output by default.")
]
FigureData = Annotated[
    Path | None,
    typer.Option(help="Folder of a figure's datasets, if they do not lie where it expects them."),
]


def check_csv(path: Path, option: str) -> None:
    """Refuse a file that cannot be written, or that would replace what is no table.

    Raises
    ------
    ConfigError
        Before any work is done.
    """
    inside = next(folder for folder in path.absolute().parents if os.path.lexists(folder))
    limits = {
        "is no plain text": not str(path).isprintable(),
        f"does not end in {SUFFIX}": path.suffix != SUFFIX,
        "is there already and is no file": os.path.lexists(path) and not os.path.isfile(path),
        "lies in what is no folder": not inside.is_dir(),
    }
    for limit, broken in limits.items():
        if broken:
            raise ConfigError(option, brief(str(path)), limit, "give a file such as out.csv")


@app.command()
@one_line_errors
def export(target: Target, csv: CsvOutput = None, results: FigureData = None) -> None:
    """Write the numbers that a figure shows, or a dataset holds, as CSV."""
    from softslip.export import save_csv, target_table, write_csv

    if csv is not None:
        check_csv(csv, "output")
    table, notes = target_table(target, results)
    for note in notes:
        print(note, file=sys.stderr)
    if csv is None:
        write_csv(table, sys.stdout)
    else:
        count = save_csv(table, csv)
        print(f"wrote {count} rows to {csv}", file=sys.stderr)
