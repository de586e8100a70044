"""Signals that ask a run to stop."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from softslip.errors import Interrupted
from softslip.files.uninterrupted import signals_handled


class Interruption:
    """Whether a signal has come.

    Attributes
    ----------
    name
        Of the signal, empty as long as there was none.
    """

    def __init__(self) -> None:
        self.name = ""

    def check(self) -> None:
        """Raise when a signal has come.

        Raises
        ------
        Interrupted
            Naming the signal.
        """
        if self.name:
            raise Interrupted(f"by {self.name}")


@contextmanager
def interruptible(at_once: bool) -> Iterator[Interruption]:
    """Take note of signals while the block runs; a second one always stops it at once.

    Parameters
    ----------
    at_once
        Whether the first signal stops the block wherever it is, for work that cannot look between
        its steps; not within compiled code, which makes a SystemError of it.

    Raises
    ------
    Interrupted
        By a signal that stops the block at once.
    """
    interruption = Interruption()

    def take_note(number: int, _: FrameType | None) -> None:
        again, interruption.name = bool(interruption.name), signal.Signals(number).name
        if at_once or again:
            interruption.check()

    with signals_handled(take_note):
        yield interruption
