"""What the commands share: their options, errors in one line, and the run that is meant."""

import errno
import functools
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from softslip.config.accuracy import cheapest
from softslip.config.parameters import Parameters
from softslip.config.scenario import Scenario, StageRun, scenario_names
from softslip.config.stages import stage_ids
from softslip.errors import ConfigError, Interrupted, SoftslipError
from softslip.messages import brief, file_text

CONFIG_EXIT, FAILURE_EXIT, INTERRUPTED_EXIT = 2, 1, 75
"""Exit statuses: a scenario that cannot be run, a run that failed, and one that a signal stopped,
which the same command resumes (EX_TEMPFAIL of sysexits.h)."""

ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Name of a file in config/, or a .yaml path.",
        autocompletion=scenario_names,
    ),
]
RunName = Annotated[str, typer.Argument(metavar="RUN", help="Run ID, or its first digits.")]
Output = Annotated[Path, typer.Option(help="File to write.", readable=False)]
Parent = Annotated[Path, typer.Option(help="Result of the stage before.", readable=False)]
Threads = Annotated[
    int, typer.Option(min=1, help="Threads at most; a run uses up to 2, for the same numbers.")
]
Results = Annotated[
    Path | None,
    typer.Option(help="Folder of the scenario's results; results/NAME by default.", readable=False),
]


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, not a table.")]


OUTPUTS = (".nc", ".png", ".svg", ".pdf", ".mp4")
"""Suffixes of the files that commands write."""

LONGEST_NAME = 255
"""Longest name of a file on the usual file systems [byte]."""


def check_output(path: Path, option: str = "output", endings: Sequence[str] = OUTPUTS) -> None:
    """Refuse an output that cannot be written, or that would replace what no command has written.

    Parameters
    ----------
    path
        Which file it is.
    option
        That names it.
    endings
        Suffixes that it may have.

    Raises
    ------
    ConfigError
        Before any work is done.
    """
    inside = next(folder for folder in path.absolute().parents if os.path.lexists(folder))
    limits = {
        "is not plain text": not str(path).isprintable(),
        f"does not end in {_either(endings)}": path.suffix not in endings,
        "has too long a name": len(os.fsencode(path.name)) > LONGEST_NAME,
        "exists and is not a file": os.path.lexists(path) and not os.path.isfile(path),
        "lies in something that is not a folder": not inside.is_dir(),
    }
    for limit, broken in limits.items():
        if broken:
            remedy = f"give a file such as out{endings[0]}"
            raise ConfigError(option, brief(str(path)), limit, remedy)


def _either(words: Sequence[str]) -> str:
    return " or ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def one_line_errors(command: Callable[..., None]) -> Callable[..., None]:
    """Turn the errors that are meant for the user into one line and an exit status."""

    @functools.wraps(command)
    def guarded(*args: Any, **kwargs: Any) -> None:
        try:
            if kwargs.get("output") is not None:
                check_output(kwargs["output"])
            command(*args, **kwargs)
        except SoftslipError as error:
            print(f"{type(error).__name__}: {error}", file=sys.stderr)
            raise typer.Exit(_status(error)) from error
        except OSError as error:
            # Nothing that is wrong with the code: the system refuses.
            if error.errno == errno.EPIPE:
                raise
            print(_refused(error), file=sys.stderr)
            raise typer.Exit(FAILURE_EXIT) from error
        except MemoryError as error:
            limit = "more memory is needed than there is; run fewer at once, or a smaller sample"
            print(f"MemoryError: {limit}", file=sys.stderr)
            raise typer.Exit(FAILURE_EXIT) from error

    return guarded


def _refused(error: OSError) -> str:
    """Return a sentence on what the system refuses."""
    if not _current_folder_is_there():
        return "StorageError: the current folder has been removed; change to another one"
    where = "" if error.filename is None else f"{file_text(error.filename)}: "
    return f"StorageError: {where}the system refuses ({error.strerror or error})"


def _current_folder_is_there() -> bool:
    try:
        os.getcwd()
    except OSError:
        return False
    return True


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
        raise ConfigError(
            "run", brief(run), limit, f"list them with: softslip runs {scenario.name}"
        )
    return found[0]


def stage_run(stage: str, run: str, parameters: str) -> StageRun:
    """Return the run of a stage that has the given parameters, written as JSON.

    Its scenario is not read, which would take a second for a large sweep.

    Raises
    ------
    ConfigError
        When they are the parameters of another run.
    """
    tree = Parameters.from_json(parameters)
    row = StageRun.of(stage, tree, stage_ids(tree))
    if row.id != run:
        limit = f"are the parameters of {stage} {row.id}, not of {brief(run)}"
        remedy = "leave them out to use the scenario's"
        raise ConfigError("parameters", brief(parameters), limit, remedy)
    return row


def tell_choice(parameters: Parameters) -> None:
    """Say on standard error which settings a target accuracy has picked."""
    if parameters.accuracy is not None:
        print(f"accuracy {parameters.accuracy:g}: {cheapest(parameters.accuracy)}", file=sys.stderr)
