"""Side-by-side times, and what the machine under them can do."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray

Tell = Callable[[str], None]
"""Called with one line at the beginning of each phase."""

Work = Callable[[], object]
"""What is timed."""

FEWEST_ROUNDS = 3
"""Rounds at least, so that a minimum means something."""

DEGREE, LANES = 32, 1024
"""Of the polynomial that measures multiply-adds, and arguments at once: they stay in the cache."""


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


@dataclass(frozen=True)
class Machine:
    """The roofline of one core, measured.

    Attributes
    ----------
    bandwidth
        Bytes read and written per second by a copy.
    rate
        Multiplications and additions per second.
    """

    bandwidth: float
    rate: float

    def attainable(self, moved: float, operations: float) -> float:
        """Return the least time that moving and calculating so much can take [s]."""
        return max(moved / self.bandwidth, operations / self.rate)


def measured_machine(footprint: int, budget: float) -> Machine:
    """Measure one core's bandwidth and arithmetic.

    Parameters
    ----------
    footprint
        Bytes that the copy touches: the data of what is judged, which may fit into a cache.
    budget
        See `alternately` [s].
    """
    source = np.ones(max(footprint // 16, 1))
    target = np.empty_like(source)
    # Of arguments below 1 no power underflows to the slow numbers near zero.
    arguments, values = np.linspace(0.5, 1.0, LANES), np.empty(LANES)
    sweeps = 500
    least = alternately(
        {
            "copy": lambda: np.copyto(target, source),
            "polynomial": lambda: _evaluate(arguments, sweeps, values),
        },
        budget,
    )
    return Machine(
        bandwidth=2 * source.nbytes / least["copy"],
        rate=2 * DEGREE * LANES * sweeps / least["polynomial"],
    )


@compiled
def _evaluate(arguments: FloatArray, sweeps: int, values: FloatArray) -> None:
    """Evaluate Σ x^k, k = 0 ... DEGREE, by Horner's rule, over and over."""
    for sweep in range(sweeps):
        first = 1.0 + sweep
        for k in range(arguments.size):
            x, value = arguments[k], first
            for _ in range(DEGREE):
                value = value * x + 1.0
            values[k] = value
