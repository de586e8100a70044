"""The command line: one subcommand a stage, one an analysis, one a figure. No physics here.

Only the module of the command that is asked for is imported, and it imports what it runs when it
runs it: a stage that is started hundreds of times must not wait for the plotting libraries.
"""

import importlib
from collections.abc import Mapping
from typing import Any

import typer

COMMANDS: Mapping[str, tuple[str, ...]] = {
    "stages": ("packing", "expansion", "ageing", "shear"),
    "status": ("status", "clean"),
    "plan": ("plan", "calibrate"),
    "results": ("gather", "fit", "runs", "schema"),
    "query": ("query",),
    "export": ("export",),
    "draw": ("draw",),
    "trace": ("trace",),
    "verify": ("verify",),
    "crate": ("crate",),
    "validate": ("validate",),
    "bench": ("bench",),
    "numerics": ("numerics",),
}
"""Modules of this package, and the commands that each has, in the order of the help."""

GROUPS = ("validate", "bench", "numerics")
"""Commands that have commands of their own."""

_MODULES = {command: module for module, commands in COMMANDS.items() for command in commands}


def commands() -> None:
    """Wall slip and bulk yielding in soft particle suspensions."""


class _Commands(typer.core.TyperGroup):
    """All commands, each imported when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return list(_MODULES)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command, None where there is none of that name."""
        if cmd_name not in _MODULES:
            return super().get_command(ctx, cmd_name)
        module = importlib.import_module(f"softslip.cli.{_MODULES[cmd_name]}")
        parent = typer.Typer(add_completion=False, callback=commands)
        parent.add_typer(module.app, name=cmd_name if cmd_name in GROUPS else None)
        return typer.main.get_group(parent).commands[cmd_name]


app = typer.Typer(cls=_Commands, add_completion=False, no_args_is_help=True, callback=commands)


def main() -> None:
    """Run the command line."""
    app()
