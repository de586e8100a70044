"""Times side by side."""

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

T = TypeVar("T")

Tell = Callable[[str], None]
"""Called with one line at the beginning of each phase."""

Work = Callable[[], object]
"""What is timed."""

FEWEST_ROUNDS = 3
"""Rounds at least, so that a minimum means something."""


def silent(_: str) -> None:
    """Tell nobody."""


def cheapest(
    works: Mapping[str, Callable[[], T]],
    cost: Callable[[T], float],
    budget: float,
    rounds: int = FEWEST_ROUNDS,
) -> dict[str, T]:
    """Return what each of some works gave when it cost least.

    They run in turn, in their order: what else the machine does then touches all alike, and a work
    may use what the one before it left.

    Parameters
    ----------
    works
        By name.
    cost
        Of what a work gives.
    budget
        Time after which no further round begins [s].
    rounds
        At least.
    """
    found: dict[str, T] = {}
    count, begin = 0, time.perf_counter()
    while count < rounds or time.perf_counter() - begin < budget:
        count += 1
        for name, work in works.items():
            latest = work()
            found[name] = min(found.get(name, latest), latest, key=cost)
    return found


def alternately(
    works: Mapping[str, Work],
    budget: float,
    rounds: int = FEWEST_ROUNDS,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, float]:
    """Return the least time of each of some works by a clock [s], after a run that is not timed.

    See `cheapest`.
    """

    def timed(work: Work) -> float:
        start = clock()
        work()
        return clock() - start

    for work in works.values():
        work()
    timers = {name: partial(timed, work) for name, work in works.items()}
    return cheapest(timers, float, budget, rounds)
