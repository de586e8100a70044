"""`softslip init`: a folder with the workflow, its scenarios and its settings."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from softslip.cli.common import one_line_errors
from softslip.errors import ConfigError
from softslip.messages import brief, counted

app = typer.Typer()

Folder = Annotated[
    str, typer.Argument(metavar="DIR", help="Folder to write into; made if missing.")
]

NEXT = """\
{count} written to {folder}: the workflow, its scenarios and its settings.

Run the demo, 9 to 15 minutes on two cores; stopped at any time, the same command resumes it:

    cd {quoted}
    snakemake --cores 2

Its figures are then in results/demo/figures, and results/demo/explorer.html shows all runs.
config/README.md says how to write a scenario of your own; softslip plan NAME says what one takes.
"""


@app.command()
@one_line_errors
def init(folder: Folder) -> None:
    """Write the workflow, its scenarios and its settings into a folder, to run and edit them."""
    from softslip.operations.project_folder import write_project

    if not folder:
        raise ConfigError("folder", brief(folder), "is empty", "give one such as my_suspension")
    count = write_project(Path(folder))
    said = NEXT.format(count=counted(count, "file"), folder=folder, quoted=shlex.quote(str(folder)))
    print(said, end="")
