"""Times side by side."""

import time
from collections.abc import Callable, Mapping

import numpy as np

Tell = Callable[[str], None]
"""Called with one line at the beginning of each phase."""

Work = Callable[[], object]
"""What is timed."""

FEWEST_ROUNDS = 3
"""Rounds at least, so that a minimum means something."""


def silent(_: str) -> None:
    """Tell nobody."""


def alternately(works: Mapping[str, Work], budget: float) -> dict[str, float]:
    """Return the least wall time of each of some works [s].

    They run in turn, in their order, first once without being timed: what else the machine does
    then touches all alike, and a work may use what the one before it left.

    Parameters
    ----------
    works
        By name.
    budget
        Time after which no further round begins, though at least `FEWEST_ROUNDS` do [s].
    """
    for work in works.values():
        work()
    least = dict.fromkeys(works, np.inf)
    rounds, begin = 0, time.perf_counter()
    while rounds < FEWEST_ROUNDS or time.perf_counter() - begin < budget:
        rounds += 1
        for name, work in works.items():
            start = time.perf_counter()
            work()
            least[name] = min(least[name], time.perf_counter() - start)
    return least
