"""Verdicts on series, and coverage of their means."""

import numpy as np
from numpy.random import SeedSequence

from softslip.analysis.observables.correlation import mean_of
from softslip.analysis.observables.verdicts import STEADY, WITHIN_ERROR, judged
from softslip.studies.coverage.made_up_series import KINDS
from softslip.studies.coverage.tallies import Tally, ends_of


def series_tally(kind: str, noise: float, memory: float, draws: int, key: int) -> Tally:
    """Judge many series of one kind, and average those that are steady."""
    tally, made = Tally(), KINDS[kind]
    for number in range(draws):
        random = np.random.default_rng(SeedSequence((1, key, number)))
        values = made.drawn(noise, memory, random)
        scale = values if made.truth != 0 else np.ones_like(values)
        start, verdict = judged(values, scale, falls=made.truth > 0 or np.isnan(made.truth))
        steady = verdict in (STEADY, WITHIN_ERROR)
        mean = mean_of(values[start:])
        tally.add(verdict, ends_of(mean) if steady else None, made.truth, mean.value)
    return tally
