"""The help is written without importing any command, and says what the commands say."""

import importlib
import subprocess
import sys

import pytest
import typer
from typer.testing import CliRunner

from softslip.cli import COMMANDS, GROUPS, app

LINES = [(module, name, line) for module, lines in COMMANDS.items() for name, line in lines.items()]

IMPORTED = """
import sys
from softslip.cli import app
try:
    app(["--help"])
except SystemExit:
    heavy = {"numpy", "xarray", "pydantic", "yaml", "netCDF4"} & set(sys.modules)
    commands = [name for name in sys.modules if name.startswith("softslip.cli.")]
    print(sorted(heavy), commands, file=sys.stderr)
"""


@pytest.mark.parametrize(("module", "name", "line"), LINES)
def test_the_line_of_a_command_is_its_own(module: str, name: str, line: str) -> None:
    group = typer.main.get_group(_with_parent(module, name))
    paragraph = (group.commands[name].help or "").partition("\n\n")[0]
    assert " ".join(paragraph.split()) == line


def _with_parent(module: str, name: str) -> typer.Typer:
    parent = typer.Typer(callback=lambda: None)
    commands = importlib.import_module(f"softslip.cli.{module}").app
    parent.add_typer(commands, name=name if name in GROUPS else None)
    return parent


def test_the_help_imports_no_command() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTED], capture_output=True, text=True)
    # The one module is no command: it puts right what the process has inherited.
    assert done.stderr.strip() == "[] ['softslip.cli.inherited']", done.stderr
    assert all(name in done.stdout for _, name, _ in LINES)


def test_a_typo_in_a_command_is_answered_with_the_command() -> None:
    refused = CliRunner().invoke(app, ["shaer"])
    assert refused.exit_code == 2
    assert "Did you mean 'shear'?" in refused.output
