"""Which intervals hold their truth more or less often than they claim."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from softslip.studies.coverage.made_up_curves import CURVES
from softslip.studies.coverage.made_up_runs import RUNS
from softslip.studies.coverage.made_up_series import KINDS

FEWEST_INTERVALS = 30
"""Intervals from which a share of them is told."""

CLOSE = 0.05
"""How far the share of intervals that hold may be from what they claim."""


class Claim(NamedTuple):
    """How often the intervals of one estimate, made of one kind of data, hold its truth.

    Attributes
    ----------
    kind
        Of the data, as the dataset names it.
    estimate
        Name of the estimate, of series their noise and memory.
    words
        What kind of data that is, as the document says it.
    intervals
        Their number.
    shares
        Of them that hold, for each confidence.
    """

    kind: str
    estimate: str
    words: str
    intervals: int
    shares: Sequence[float]

    def is_apart(self, claimed: ArrayLike) -> bool:
        """Tell whether a share of intervals differs from what it claims by over `CLOSE`."""
        return bool((np.abs(np.subtract(self.shares, claimed)) > CLOSE).any())


def claims(coverage: xr.Dataset) -> Iterator[Claim]:
    """Yield the estimates of a dataset with as many intervals as it takes to tell their share.

    Parameters
    ----------
    coverage
        From `studies.coverage.measure_coverage`.
    """
    for dim, (kind, estimate, words) in _ALONG.items():
        for number in range(coverage.sizes[dim]):
            row = coverage.isel({dim: number})
            intervals, name = int(row[f"{dim}_intervals"]), str(row[kind].item())
            shares = [float(each) for each in row[f"{dim}_coverage"].values]
            if intervals >= FEWEST_INTERVALS and np.isfinite(shares).all():
                yield Claim(name, estimate(row), words(name), intervals, shares)


def _noise_and_memory(row: xr.Dataset) -> str:
    return f"noise {100 * float(row['noise']):.0f} %, memory {float(row['memory']):g}"


_ALONG: dict[str, tuple[str, Callable[[xr.Dataset], str], Callable[[str], str]]] = {
    "series": ("kind", _noise_and_memory, lambda name: KINDS[name].words),
    "measurement": (
        "run_kind",
        lambda row: str(row["observable"].item()),
        lambda name: RUNS[name].words,
    ),
    "estimate": (
        "curve",
        lambda row: str(row["parameter"].item()),
        lambda name: CURVES[name].words,
    ),
}
"""For each dimension, the variable with the kind of data, how an estimate and a kind are named."""
