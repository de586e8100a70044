"""One stage of a run, by its command, in a process of its own.

Within the caller's process other libraries may have been imported with other settings, and a run's
last digits would depend on them; the command does without them (`cli.inherited`). LAMMPS, signals
and memory are its own affair, too.
"""

import json
import os
import signal
import site
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO

import softslip
from softslip import errors
from softslip.errors import ConfigError, NumericalError, SoftslipError
from softslip.operations.failures import Failure
from softslip.operations.progress import Report

Recorded = Callable[[], Failure | None]
"""Returns the record that a failed run has left."""


def run_command(words: Sequence[str], report: Report, recorded: Recorded) -> tuple[str, ...]:
    """Run a command of softslip to its end, and return the lines that it has said.

    Ctrl-C is passed on to it once; as always, it then writes a checkpoint and ends. When this
    process dies, the command notices that nobody reads its progress, and does the same.

    Parameters
    ----------
    words
        The command and its arguments.
    report
        Called with the command's progress.
    recorded
        Asked for details when the command has failed.

    Raises
    ------
    SoftslipError
        The command's own error.
    KeyboardInterrupt
        With what the command says about how far it is.
    """
    # -P: the current folder may hold files with names of modules.
    command = [sys.executable, "-P", "-m", "softslip", *words, "--json-progress"]
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            env=_with_this_package(),
            # A signal to the group would reach it beside the one that is passed on.
            start_new_session=True,
        )
        with process:
            try:
                _follow(process, report)
            except KeyboardInterrupt:
                _stop(process)
                raise KeyboardInterrupt(_lines(said)[-1]) from None
            except BaseException:
                _stop(process)
                raise
        lines = _lines(said)
    if process.returncode:
        raise _error(lines, process.returncode, recorded())
    return lines


def _with_this_package() -> dict[str, str]:
    """Return the environment in which a new process imports this very package."""
    place = str(Path(softslip.__file__).parents[1])
    if place in site.getsitepackages():
        # Python finds it there by itself, and after its own modules.
        return dict(os.environ)
    others = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": f"{place}{os.pathsep}{others}" if others else place}


def _follow(process: subprocess.Popen[str], report: Report) -> None:
    assert process.stdout is not None, "it is a pipe"
    for line in process.stdout:
        told = json.loads(line)
        report(told["done"], told["steps"], told["time"])
    process.wait()


def _stop(process: subprocess.Popen[str]) -> None:
    """Ask a command to stop and wait for it, at most until the next Ctrl-C."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait()
    except BaseException:
        process.kill()
        raise


def _lines(said: IO[str]) -> tuple[str, ...]:
    """Return what was said, at least one line of it."""
    said.seek(0)
    return tuple(said.read().splitlines()) or ("",)


def _error(lines: Sequence[str], status: int, failure: Failure | None) -> SoftslipError:
    """Return the error that a command has ended with."""
    name, _, text = lines[-1].partition(": ")
    kind = getattr(errors, name, None)
    if kind is NumericalError and failure is not None and failure.field is not None:
        index, step = failure.index or 0, failure.step or 0
        start = f"{failure.field}[{index}] at step {step}: "
        return NumericalError(failure.field, index, step, text.removeprefix(start))
    if isinstance(kind, type) and issubclass(kind, SoftslipError):
        # Those that are made from several words say all of them.
        return SoftslipError(lines[-1]) if kind in (ConfigError, NumericalError) else kind(text)
    words = "\n".join(lines[-20:])
    return SoftslipError(f"the command ended with status {status}, having said:\n{words}")
