"""What came of many draws: what was said of each, and whether its intervals held the truth."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from softslip.analysis.fits.likelihood import CONFIDENCE, MOST_FREEDOM
from softslip.analysis.observables.correlation import MeanEstimate

FloatArray = NDArray[np.float64]


@dataclass
class Tally:
    """What came of many draws.

    Attributes
    ----------
    covered
        For each confidence, whether the interval of each draw held the truth.
    said
        What was said of each draw: a verdict, or the message of a fit.
    differences
        By how much the estimate of each draw with intervals exceeds the truth.
    """

    covered: tuple[list[bool], ...] = field(default_factory=lambda: ([], []))
    said: list[str] = field(default_factory=list)
    differences: list[float] = field(default_factory=list)

    def add(
        self, said: str, ends: FloatArray | None, truth: float, value: float = float("nan")
    ) -> None:
        """Count one draw, with the ends of its intervals and its estimate where it has any."""
        self.said.append(said)
        if ends is None or not np.isfinite(truth) or np.isnan(ends).any():
            return
        for covered, (low, high) in zip(self.covered, ends, strict=True):
            covered.append(bool(low <= truth <= high))
        self.differences.append(value - truth)

    def share(self, *words: str) -> float:
        """Return the share of draws of which one of these was said."""
        return float(np.mean([each in words for each in self.said]))

    @property
    def intervals(self) -> int:
        """Number of draws with intervals and a truth."""
        return len(self.covered[0])

    def coverage(self) -> list[float]:
        """Return the share of intervals that held the truth, by confidence."""
        return [float(np.mean(each)) if each else float("nan") for each in self.covered]

    def median_difference(self) -> float:
        """Return the median difference of the estimates from the truth; NaN without any."""
        return float(np.median(self.differences)) if self.differences else float("nan")


def ends_of(estimate: MeanEstimate) -> FloatArray:
    """Return the ends of the intervals of an estimate, by confidence: value ± t error.

    Without degrees of freedom the quantile is that of the normal distribution.
    """
    freedom = estimate.freedom if np.isfinite(estimate.freedom) else MOST_FREEDOM
    quantiles = stats.t.ppf([0.5 * (1 + c) for c in CONFIDENCE], max(freedom, 1e-9))
    reach = quantiles * estimate.error
    return np.stack((estimate.value - reach, estimate.value + reach), axis=1)
