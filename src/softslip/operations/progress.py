"""How far a long stage has come: a bar for people, lines for logs."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

Report = Callable[[int, int, float], None]
"""Called as report(steps done, steps of the stage, simulated time)."""

LOG_INTERVAL = 10.0
"""Seconds between two lines in a log."""


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

    On a terminal it draws a bar; otherwise it writes a line with step, simulated time, rate and
    remaining time every `LOG_INTERVAL` seconds and at the end.

    Parameters
    ----------
    stage
        What to call the work.
    """
    console = Console(stderr=True)
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


@contextmanager
def _bar(stage: str, console: Console) -> Iterator[Report]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("t = {task.fields[simulated]:.2f}"),
        TextColumn("{task.fields[rate]:.0f} steps/s"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(stage, total=None, simulated=0.0, rate=0.0)
        start = time.monotonic()

        def show(done: int, steps: int, simulated: float) -> None:
            rate = done / max(time.monotonic() - start, 1e-9)
            bar.update(task, completed=done, total=steps, simulated=simulated, rate=rate)

        yield show
