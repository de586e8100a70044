"""Signals that wait until a file is written or read."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""What a scheduler, a person and a closed terminal send."""


@contextmanager
def signals_handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Have another handler for `SIGNALS` while the block runs; only the main thread can set one.

    Parameters
    ----------
    handler
        Called with the signal's number.
    """
    before = {number: signal.signal(number, handler) for number in SIGNALS}
    try:
        yield
    finally:
        for number, former in before.items():
            # None stands for a handler that was not set by Python, and cannot be set by it.
            signal.signal(number, signal.SIG_DFL if former is None else former)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Keep signals for when the block has ended, and send them to this process again then.

    A handler that raises within xarray, as that of Ctrl-C does, may leave one of its locks closed;
    closing the file then waits for that lock for ever. Blocks that hold this take a moment only.
    Where handlers cannot be set, in threads other than the main one, none is called either.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []

    def wait(number: int, _: FrameType | None) -> None:
        waiting.append(number)

    try:
        with signals_handled(wait):
            yield
    finally:
        for each in waiting:
            signal.raise_signal(each)
