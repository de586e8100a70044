"""What the commands share: their options, errors in one line, and the run that is meant."""

import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from softslip.accuracy import cheapest
from softslip.errors import ConfigError, Interrupted, SoftslipError
from softslip.parameters import Parameters
from softslip.sweep import Scenario, StageRun

CONFIG_EXIT, FAILURE_EXIT, INTERRUPTED_EXIT = 2, 1, 75
"""Exit statuses: a scenario that cannot be run, a run that failed, and one that a signal stopped,
which the same command goes on with (EX_TEMPFAIL of sysexits.h)."""

ScenarioName = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="Name of a file in config/, or a .yaml path.")
]
RunName = Annotated[str, typer.Argument(metavar="RUN", help="Run ID, or its first digits.")]
Output = Annotated[Path, typer.Option(help="File to write.")]
Parent = Annotated[Path, typer.Option(help="Result of the stage before.")]
Threads = Annotated[
    int, typer.Option(min=1, help="Threads at most; a run uses up to 2, for the same numbers.")
]
Results = Annotated[
    Path | None, typer.Option(help="Folder of the scenario's results; results/NAME by default.")
]


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, not a table.")]


def one_line_errors(command: Callable[..., None]) -> Callable[..., None]:
    """Turn the errors that are meant for the user into one line and an exit status."""

    @functools.wraps(command)
    def guarded(*args: Any, **kwargs: Any) -> None:
        try:
            command(*args, **kwargs)
        except SoftslipError as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr)
            raise typer.Exit(_status(error)) from error

    return guarded


def _status(error: SoftslipError) -> int:
    if isinstance(error, Interrupted):
        return INTERRUPTED_EXIT
    return CONFIG_EXIT if isinstance(error, ConfigError) else FAILURE_EXIT


def find_run(scenario: Scenario, stage: str, run: str) -> StageRun:
    """Return the run of a stage whose ID begins with the given digits."""
    table = scenario.stage_table(stage)
    found = [row for identity, row in table.items() if run and identity.startswith(run)]
    if len(found) != 1:
        limit = f"is the beginning of {len(found)} {stage} runs of scenario {scenario.name}"
        raise ConfigError("run", run, limit, f"list them with: softslip runs {scenario.name}")
    return found[0]


def tell_choice(parameters: Parameters) -> None:
    """Say on standard error which settings a wanted accuracy has picked."""
    if parameters.accuracy is not None:
        print(f"accuracy {parameters.accuracy:g}: {cheapest(parameters.accuracy)}", file=sys.stderr)
