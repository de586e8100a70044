import os
import signal

import pytest

from softslip.errors import Interrupted
from softslip.files.uninterrupted import SIGNALS
from softslip.simulation.interruption import interruptible


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_is_noted_and_the_next_one_stops(number):
    before = signal.getsignal(number)
    with interruptible(at_once=False) as interruption:
        interruption.check()
        os.kill(os.getpid(), number)
        assert interruption.name == number.name
        with pytest.raises(Interrupted, match=f"by {number.name}"):
            os.kill(os.getpid(), number)
    assert signal.getsignal(number) is before


@pytest.mark.parametrize("number", SIGNALS)
def test_what_cannot_be_kept_stops_at_once(number):
    before = signal.getsignal(number)

    def work():
        with interruptible(at_once=True):
            os.kill(os.getpid(), number)
            pytest.fail("the signal did not stop the block")

    with pytest.raises(Interrupted, match=number.name):
        work()
    assert signal.getsignal(number) is before
