"""Coverage of what is measured of a single run: averages, slip lengths, times."""

import numpy as np
import xarray as xr
from numpy.random import SeedSequence

from softslip.analysis.observables.correlation import MeanEstimate, estimate_named
from softslip.analysis.observables.slip_lengths import slip_lengths
from softslip.analysis.observables.steady import FLAGS, steady_state
from softslip.analysis.observables.timescales import slip_time, yielding_time
from softslip.studies.coverage.made_up_runs import RunKind
from softslip.studies.coverage.tallies import Tally, ends_of

KNOWN, UNKNOWN = "known", "unknown"
"""What is said of an observable."""


def run_tallies(kind: RunKind, draws: int, key: int) -> dict[str, Tally]:
    """Measure many runs of one kind; by the name of the observable."""
    tallies = {name: Tally() for name in kind.truths}
    for number in range(draws):
        random = np.random.default_rng(SeedSequence((3, key, number)))
        run = kind.drawn(random)
        parts = (steady_state, slip_lengths, yielding_time, slip_time)
        found = xr.merge([part(run) for part in parts])
        for name, tally in tallies.items():
            estimate = estimate_named(found, name)
            known = _determined(found, name, estimate)
            ends = ends_of(estimate) if known else None
            tally.add(KNOWN if known else UNKNOWN, ends, kind.truths[name], estimate.value)
    return tallies


def _determined(found: xr.Dataset, name: str, estimate: MeanEstimate) -> bool:
    """Tell whether an estimate is said to be determined: with an error, and steady where it may be.

    Averages of series that are not steady have bars that span their drift, and are no estimates.
    """
    known = bool(np.isfinite([estimate.value, estimate.error]).all())
    return known and (name not in FLAGS or bool(found[FLAGS[name]]))
