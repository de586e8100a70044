"""Verdicts on series: steady, steady within its error, drifting, or too short to tell."""

from dataclasses import dataclass

import numpy as np

from softslip.analysis.observables.correlation import MeanEstimate, change_of, mean_of
from softslip.analysis.observables.falling import falls_as_power
from softslip.analysis.observables.series import FloatArray
from softslip.analysis.observables.truncation import steady_start

STEADY = "steady"
"""No trend beyond its error, or a small one; the mean is known well."""

WITHIN_ERROR = "steady within its error"
"""No trend was found, but the error of the mean is large."""

DRIFTING = "drifting"
"""A trend beyond its error, a transient that has not ended, or a creep."""

TOO_SHORT = "too short"
"""Too few records to tell."""

VERDICTS = (STEADY, WITHIN_ERROR, DRIFTING, TOO_SHORT)
"""All verdicts; a series that a run lacks has none."""

LEAST_BINS = 20
"""Fewest bins of a window that is judged."""

SIGNIFICANCE = 0.05
"""Level of the two-sided t-test on the trend."""

SMALL_DRIFT = 0.05
"""A relative change over the window that counts as steady even where it is significant."""

LARGE_ERROR = 0.05
"""Standard error of the mean, relative to the scale of the series, from which it is large."""

LATEST_START = 0.45
"""Share of the series beyond which a window's start says that the transient still lasts."""

LEAST_STRAIN = 0.5
"""Strain in the window of a flow, over the strain before it, which is mostly elastic."""

REARRANGING_STRAIN = 0.05
"""Strain in the window of a flow: by less, particles hardly change their neighbours. Jammed soft
particles yield at 0.05 to 0.1; those of the paper at σ_y over a modulus of about 0.6, 0.09."""


@dataclass(frozen=True)
class Window:
    """The end of a series, from a point on.

    Attributes
    ----------
    mean
        Mean over the window.
    change
        Linear change over the window.
    scale
        What changes and errors are relative to.
    bins
        Number of equal bins in the window.
    """

    mean: MeanEstimate
    change: MeanEstimate
    scale: float
    bins: int

    @property
    def drift(self) -> float:
        """The change relative to the scale; infinite about a scale of 0."""
        return relative(self.change.value, self.scale)

    @property
    def drift_error(self) -> float:
        """Standard error of the drift."""
        return abs(relative(self.change.error, self.scale))


def relative(change: float, scale: float) -> float:
    """Return a change over the size of a scale; infinite where that is 0 and the change is not."""
    if scale != 0:
        return change / abs(scale)
    return float(np.sign(change)) * np.inf if change else change


def window_of(values: FloatArray, scale: FloatArray) -> Window:
    """Measure mean and trend of equal bins; they are relative to the mean of ``scale``."""
    size = abs(float(scale.mean())) if len(scale) else 0.0
    return Window(mean_of(values), change_of(values), size, len(values))


def trend_found(drift: float, chance: float) -> bool:
    """Tell whether a trend is beyond its error and not small."""
    return chance < SIGNIFICANCE and abs(drift) > SMALL_DRIFT


def steady_verdict(error: float, scale: float) -> str:
    """Return which of the two steady verdicts a series without a trend has."""
    return STEADY if error <= LARGE_ERROR * abs(scale) else WITHIN_ERROR


def has_not_flowed(values: FloatArray, start: int, mean: MeanEstimate, length: float) -> bool:
    """Tell whether a bulk has strained too little in its window to have flowed.

    Before a material flows it strains elastically, by about σ/G, within the transient. A bulk that
    afterwards strains by less than half of that, or by less than makes particles change their
    neighbours, even at two standard errors above its mean rate, has not flowed but creeps, however
    steadily: its rate is no point of a flow curve.

    Parameters
    ----------
    values
        Rates in equal bins from time 0 on, shape (n,).
    start, mean
        First bin of the window, and its mean.
    length
        Of a bin.
    """
    before = float(values[:start].sum()) * length
    after = (mean.value + 2 * mean.error) * (len(values) - start) * length
    return after < max(LEAST_STRAIN * before, REARRANGING_STRAIN)


def judged(
    values: FloatArray, scale: FloatArray, falls: bool = False, flows: float | None = None
) -> tuple[int, str]:
    """Return where the window of a series starts, and the verdict on it.

    Parameters
    ----------
    values
        Equal bins from time 0 on, shape (n,).
    scale
        What its trend is relative to, in the same bins.
    falls
        Whether a fall as a power of time makes it drifting.
    flows
        Length of a bin of a rate of shear that must have flowed to be steady; None for others.
    """
    count = len(values)
    start = steady_start(values)
    window = window_of(values[start:], scale[start:])
    if window.bins < LEAST_BINS:
        return start, TOO_SHORT
    small = max(abs(window.drift), window.drift_error) <= SMALL_DRIFT
    creeps = (falls and falls_as_power(values, start)) or (
        flows is not None and has_not_flowed(values, start, window.mean, flows)
    )
    unfinished = start >= LATEST_START * count and not small
    if creeps or unfinished or trend_found(window.drift, window.change.chance):
        return start, DRIFTING
    return start, steady_verdict(window.mean.error, window.scale)
