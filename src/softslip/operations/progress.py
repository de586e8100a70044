"""How far a long stage has come: a bar for people, lines for logs, lines of JSON for programs."""

import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

Report = Callable[[int, int, float], None]
"""Called as report(steps done, steps of the stage, simulated time)."""

LOG_INTERVAL = 10.0
"""Seconds between two lines in a log."""

SHOWN_INTERVAL = 0.2
"""Seconds between two pictures of a bar in a notebook, and between two lines of JSON."""


def _line(stage: str, done: int, steps: int, simulated: float, elapsed: float) -> str:
    rate = done / elapsed if elapsed > 0 else 0.0
    remaining = (steps - done) / rate if rate > 0 else float("nan")
    return (
        f"{stage}: step {done} of {steps}, t = {simulated:.3f}, "
        f"{rate:.1f} steps/s, {remaining:.0f} s to go"
    )


@contextmanager
def progress_report(stage: str) -> Iterator[Report]:
    """Yield a function that shows progress on standard error while the block runs.

    On a terminal and in a notebook it draws a bar; otherwise it writes a line with step, simulated
    time, rate and remaining time every `LOG_INTERVAL` seconds and at the end.

    Parameters
    ----------
    stage
        What to call the work.
    """
    console = Console(stderr=True)
    if console.is_jupyter:
        with _notebook_bar(stage) as report:
            yield report
        return
    if console.is_terminal:
        with _bar(stage, console) as report:
            yield report
        return
    start = time.monotonic()
    last = start

    def log(done: int, steps: int, simulated: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= LOG_INTERVAL or done == steps:
            last = now
            print(_line(stage, done, steps, simulated, now - start), file=sys.stderr, flush=True)

    yield log


def tell(sentence: str) -> None:
    """Say something on standard error; in a notebook, where that is for errors, in the output."""
    stream = sys.stdout if Console().is_jupyter else sys.stderr
    print(sentence, file=stream, flush=True)


@contextmanager
def silent_report(stage: str) -> Iterator[Report]:
    """Yield a function that shows nothing."""
    yield lambda done, steps, simulated: None


@contextmanager
def json_report(stage: str) -> Iterator[Report]:
    """Yield a function that writes progress on standard output, for a program that reads it.

    Each line is an object with ``stage``, ``done`` and ``steps``, and the simulated ``time``. When
    nobody reads it any more, whoever asked for the work has died: the process gets the signal that
    asks it to stop, with a checkpoint.

    Parameters
    ----------
    stage
        What to call the work.
    """
    last, read = 0.0, True

    def write(done: int, steps: int, simulated: float) -> None:
        nonlocal last, read
        now = time.monotonic()
        if not read or (now - last < SHOWN_INTERVAL and done < steps):
            return
        last = now
        words = {"stage": stage, "done": done, "steps": steps, "time": simulated}
        try:
            print(json.dumps(words), flush=True)
        except BrokenPipeError:
            read = False
            os.kill(os.getpid(), signal.SIGTERM)

    yield write


def _columns() -> tuple[Any, ...]:
    return (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("t = {task.fields[simulated]:.2f}"),
        TextColumn("{task.fields[rate]:.0f} steps/s"),
        TimeRemainingColumn(),
    )


def _shown_on(bar: Progress, stage: str) -> Report:
    """Return a function that brings a bar to where the work is."""
    task = bar.add_task(stage, total=None, simulated=0.0, rate=0.0)
    start = time.monotonic()

    def show(done: int, steps: int, simulated: float) -> None:
        rate = done / max(time.monotonic() - start, 1e-9)
        bar.update(task, completed=done, total=steps, simulated=simulated, rate=rate)

    return show


@contextmanager
def _bar(stage: str, console: Console) -> Iterator[Report]:
    with Progress(*_columns(), console=console) as bar:
        yield _shown_on(bar, stage)


@contextmanager
def _notebook_bar(stage: str) -> Iterator[Report]:
    """Draw a bar in a notebook's output and replace it as the work goes on.

    Rich's own way needs ipywidgets, and shows nothing where they are missing; its bars can be drawn
    as HTML all the same, and outputs be replaced by every notebook.
    """
    from IPython.display import display

    bar = Progress(*_columns(), auto_refresh=False)
    move = _shown_on(bar, stage)
    output = display(bar, display_id=True)
    last = time.monotonic()

    def show(done: int, steps: int, simulated: float) -> None:
        nonlocal last
        move(done, steps, simulated)
        now = time.monotonic()
        if now - last >= SHOWN_INTERVAL or done == steps:
            last = now
            output.update(bar)

    yield show
    output.update(bar)
