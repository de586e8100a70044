"""The command line: one subcommand a stage, one an analysis, one a figure. No physics here.

Only the module of the command that is asked for is imported, and it imports what it runs when it
runs it: a stage that is started hundreds of times must not wait for the plotting libraries.
"""

import importlib
import sys
from collections.abc import Mapping
from typing import Any

import typer

from softslip.cli.inherited import flushed, put_right, refuse_settings_of_numba
from softslip.errors import ConfigError

COMMANDS: Mapping[str, Mapping[str, str]] = {
    "init": {
        "init": "Write the workflow, its scenarios and its settings into a folder, to run and edit "
        "them.",
    },
    "stage_commands": {
        "packing": "Pack discs with LAMMPS.",
        "expansion": "Grow discs into membranes at the area fraction of the scenario.",
        "ageing": "Relax a packing at zero stress, with hydrodynamics.",
        "shear": "Shear an aged packing under constant stress or shear rate.",
    },
    "status": {
        "status": "Say how far the runs of a scenario are: done, running, failed, interrupted or "
        "missing.",
        "clean": "Remove checkpoints that nobody needs any more, and files left by killed "
        "processes.",
    },
    "plan": {
        "plan": "Say what snakemake would run for a scenario, what it would reuse, and what that "
        "takes.",
        "calibrate": "Measure for some minutes what runs cost here, and write the table that "
        "plans start from.",
    },
    "results": {
        "gather": "Gather the finished runs of a scenario into one dataset.",
        "fit": "Fit the flow law and the slip laws to a flow curve, and say which could be fitted.",
        "compare": "Hold a scenario's yield stress, exponents and times against the paper's, as a "
        "table.",
        "runs": "List the runs of a scenario with the IDs of their stages; finished ones are "
        "ticked.",
        "schema": "Write config/schema.json, config/defaults.yaml and the table in "
        "config/README.md.",
    },
    "query": {
        "query": "List the runs that a condition on parameters or provenance holds for.",
    },
    "export": {"export": "Write the numbers that a figure shows, or a dataset holds, as CSV."},
    "draw": {"draw": "Draw a figure from datasets."},
    "explorer": {
        "explorer": "Write a page for the browser that shows all runs of a scenario.",
    },
    "trace": {
        "trace": "Say what a figure, a dataset or a value was made from, back to seeds, commits "
        "and hosts.",
    },
    "verify": {
        "verify": "Check the digests and the lineage of all results, and recompute some of them.",
    },
    "crate": {
        "crate": "Pack a scenario's results, and what they were made with, into a Workflow Run "
        "RO-Crate.",
    },
    "publish": {
        "effort": "Say what the finished runs of a scenario took beside the plan, and what set "
        "their steps.",
        "publish": "Copy a scenario's datasets and figures to results/published, and write "
        "docs/results.md.",
        "reproduce": "Hold runs that were made again beside the published ones of a scenario.",
    },
    "validate": {
        "validate": "Solve a flow whose solution is known, and compare; fails when the error is "
        "too large.",
    },
    "bench": {"bench": "Measure the paper's scheme and the faster ones side by side."},
    "numerics": {
        "numerics": "Validate, trade speed for accuracy, and stretch the scheme, as a study asks "
        "for.",
    },
}
"""Modules of this package, and the commands that each has with their lines in the help, in its
order. They stand here so that the help imports no command."""

GROUPS = ("validate", "bench", "numerics")
"""Commands that have commands of their own."""

_MODULES = {command: module for module, commands in COMMANDS.items() for command in commands}


def commands() -> None:
    """Wall slip and bulk yielding in soft particle suspensions."""


class _Commands(typer.core.TyperGroup):
    """All commands; that which is called is imported then."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Return the name, the command and the rest of a line."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, command_named(name) if name else command, rest


def command_named(name: str) -> Any:
    """Return a command of the program, for which its module is imported."""
    module = importlib.import_module(f"softslip.cli.{_MODULES[name]}")
    parent = typer.Typer(add_completion=False, callback=commands)
    parent.add_typer(module.app, name=name if name in GROUPS else None)
    return typer.main.get_group(parent).commands[name]


app = typer.Typer(cls=_Commands, no_args_is_help=True, callback=commands)
for each in COMMANDS.values():
    for name, line in each.items():
        app.command(name, help=line)(commands)


def main() -> None:
    """Run the command line, whatever it has inherited."""
    put_right()
    status = 0
    try:
        refuse_settings_of_numba()
        app()
    except ConfigError as error:
        print(f"ConfigError: {error}", file=sys.stderr)
        status = 2
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    sys.exit(flushed(status))
