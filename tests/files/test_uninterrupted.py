"""Signals that come while a file is written are answered when it is."""

import signal
import threading

import pytest

from softslip.files.uninterrupted import SIGNALS, signals_handled, uninterrupted


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_is_answered_after_the_block(number):
    answered, ended = [], []
    before = signal.signal(number, lambda *_: answered.append(bool(ended)))
    try:
        with uninterrupted():
            signal.raise_signal(number)
            assert not answered
            ended.append(True)
        assert answered == [True]
        signal.raise_signal(number)
    finally:
        signal.signal(number, before)
    assert answered == [True, True]


def test_ctrl_c_stops_only_what_comes_after_the_block():
    reached = []

    def work():
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            reached.append("end of the block")
        reached.append("beyond it")

    # A process that was started in the background ignores the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert reached == ["end of the block"]


def test_an_error_in_the_block_does_not_lose_the_signal():
    answered = []
    before = signal.signal(signal.SIGTERM, lambda *_: answered.append(True))

    def work():
        with uninterrupted():
            signal.raise_signal(signal.SIGTERM)
            raise OSError("disk")

    try:
        with pytest.raises(OSError, match="disk"):
            work()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert answered == [True]


def test_another_thread_writes_as_well():
    written = []

    def write():
        with uninterrupted():
            written.append(True)

    thread = threading.Thread(target=write)
    thread.start()
    thread.join()
    assert written == [True]


def test_a_handler_that_was_not_set_by_python_gives_way_to_the_usual_one(monkeypatch):
    """Python says of it that it is None, which cannot be set."""
    calls = []
    monkeypatch.setattr(signal, "signal", lambda number, handler: calls.append((number, handler)))
    with signals_handled(lambda *_: None):
        calls.clear()
    assert calls == [(number, signal.SIG_DFL) for number in SIGNALS]
