"""Series made up from known steady values, with correlated noise."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy import signal

FloatArray = NDArray[np.float64]

RECORDS = 1000
"""Records of a series: those of a run of the paper's length in intervals of one time unit."""

NOISES = (0.1, 0.2, 0.4)
"""Standard deviations, over the steady value."""

MEMORIES = (2.0, 10.0, 50.0)
"""Records within which the correlation of the noise decays by e."""


def red_noise(count: int, memory: float, random: Generator) -> FloatArray:
    """Return noise of variance 1 whose correlation decays by e within so many records."""
    keep = np.exp(-1.0 / memory)
    shocks = random.standard_normal(count) * np.sqrt(1 - keep**2)
    shocks[0] /= np.sqrt(1 - keep**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -keep], shocks))


@dataclass(frozen=True)
class SeriesKind:
    """A kind of series.

    Attributes
    ----------
    words
        What it is, as the document says it.
    truth
        Its steady value, NaN where it has none.
    shape
        Its values without noise, at times [records].
    relative
        Whether noise is relative to the values; otherwise it is relative to 1, the scale.
    """

    words: str
    truth: float
    shape: Callable[[FloatArray], FloatArray]
    relative: bool = True

    def drawn(self, noise: float, memory: float, random: Generator) -> FloatArray:
        """Return one such series."""
        values = self.shape(np.asarray(np.arange(RECORDS) + 0.5, dtype=np.float64))
        scatter = noise * red_noise(RECORDS, memory, random)
        return values * (1 + scatter) if self.relative else values + scatter


def _ones(time: FloatArray) -> FloatArray:
    return time * 0.0 + 1.0


KINDS: Mapping[str, SeriesKind] = {
    "stationary": SeriesKind("stationary about 1", 1.0, _ones),
    "zero": SeriesKind("stationary about 0", 0.0, lambda time: 0.0 * time, relative=False),
    "negative": SeriesKind("stationary about −1", -1.0, lambda time: -_ones(time)),
    "relaxing": SeriesKind(
        "relaxes, 1 + 3 e^(−t/15), then stationary", 1.0, lambda time: 1 + 3 * np.exp(-time / 15)
    ),
    "yielding": SeriesKind(
        "creeps, yields at t ≈ 30, then flows",
        1.0,
        lambda time: 3.0 * (time + 0.5) ** -1.5 + 1.0 / (1.0 + (30.0 / time) ** 6),
    ),
    "creep": SeriesKind("creeps as t^−0.5", np.nan, lambda time: time**-0.5),
    "slow creep": SeriesKind("creeps as t^−0.3", np.nan, lambda time: time**-0.3),
    "unfinished": SeriesKind(
        "relaxes over half the run", np.nan, lambda time: 1 + np.exp(-2 * time / RECORDS)
    ),
}
"""Kinds of series by name."""


def conditions() -> Iterator[tuple[str, float, float]]:
    """Yield each kind with each noise and memory."""
    for kind in KINDS:
        for noise in NOISES:
            for memory in MEMORIES:
                yield kind, noise, memory
