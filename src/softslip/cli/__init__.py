"""The command line: one subcommand a stage, one an analysis, one a figure. No physics here.

Commands import what they run when they run it: a stage that is started hundreds of times must not
wait for the plotting libraries.
"""

import typer

from softslip.cli import (
    bench,
    crate,
    draw,
    export,
    numerics,
    plan,
    query,
    results,
    stages,
    status,
    trace,
    validate,
    verify,
)

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    help="Wall slip and bulk yielding in soft particle suspensions.",
)
app.add_typer(stages.app)
app.add_typer(status.app)
app.add_typer(plan.app)
app.add_typer(results.app)
app.add_typer(query.app)
app.add_typer(export.app)
app.add_typer(draw.app)
app.add_typer(trace.app)
app.add_typer(verify.app)
app.add_typer(crate.app)
app.add_typer(validate.app, name="validate")
app.add_typer(bench.app, name="bench")
app.add_typer(numerics.app, name="numerics")


def main() -> None:
    """Run the command line."""
    app()
