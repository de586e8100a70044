"""Coverage of every estimator, measured on data made up from known truths."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.random import Generator, SeedSequence
from scipy import stats

from softslip.analysis.fits import FITTED, fit_laws, herschel_bulkley
from softslip.analysis.fits.likelihood import CONFIDENCE
from softslip.analysis.observables.correlation import MeanEstimate, mean_of
from softslip.analysis.observables.verdicts import STEADY, VERDICTS, WITHIN_ERROR, judged
from softslip.studies.coverage.made_up_curves import CURVES, CurveKind
from softslip.studies.coverage.made_up_series import KINDS, RECORDS, conditions

Tell = Callable[[str], None]

MESSAGES = {
    "pooled_yield_stress": "pooled_fit_message",
    "pooled_consistency": "pooled_fit_message",
    "pooled_flow_index": "pooled_fit_message",
}
"""Messages of parameters that are fitted together; others have one of their own."""


@dataclass
class Tally:
    """What came of many draws.

    Attributes
    ----------
    covered
        For each confidence, whether the interval of each draw held the truth.
    said
        What was said of each draw: a verdict, or the message of a fit.
    """

    covered: tuple[list[bool], ...] = field(default_factory=lambda: ([], []))
    said: list[str] = field(default_factory=list)

    def add(self, said: str, ends: np.ndarray | None, truth: float) -> None:
        """Count one draw, with the ends of its intervals where it has any."""
        self.said.append(said)
        if ends is None or not np.isfinite(truth) or np.isnan(ends).any():
            return
        for covered, (low, high) in zip(self.covered, ends, strict=True):
            covered.append(bool(low <= truth <= high))

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


def ends_of(estimate: MeanEstimate) -> np.ndarray:
    """Return the ends of the intervals of an estimate, by confidence."""
    quantiles = stats.t.ppf([0.5 * (1 + c) for c in CONFIDENCE], max(estimate.freedom, 1e-9))
    reach = quantiles * estimate.error
    return np.stack((estimate.value - reach, estimate.value + reach), axis=1)


def series_tally(kind: str, noise: float, memory: float, draws: int, key: int) -> Tally:
    """Judge many series of one kind, and average those that are steady."""
    tally, made = Tally(), KINDS[kind]
    for number in range(draws):
        random = np.random.default_rng(SeedSequence((1, key, number)))
        values = made.drawn(noise, memory, random)
        scale = values if made.truth != 0 else np.ones_like(values)
        start, verdict = judged(values, scale, falls=made.truth > 0 or np.isnan(made.truth))
        steady = verdict in (STEADY, WITHIN_ERROR)
        tally.add(verdict, ends_of(mean_of(values[start:])) if steady else None, made.truth)
    return tally


def curve_tallies(kind: CurveKind, draws: int, key: int) -> dict[str, Tally]:
    """Fit many flow curves of one kind; by the name of the parameter."""
    tallies = {name: Tally() for name in kind.truths}
    for number in range(draws):
        random = np.random.default_rng(SeedSequence((2, key, number)))
        _count(kind, random, tallies)
    return tallies


def _count(kind: CurveKind, random: Generator, tallies: dict[str, Tally]) -> None:
    curve = kind.drawn(random)
    fits = herschel_bulkley(curve) if kind.imposed_rate else fit_laws(curve)
    for name, tally in tallies.items():
        message = fits[MESSAGES.get(name, f"{name}_message")]
        ends = fits[f"{name}_interval"]
        if "roughness" in message.dims:
            message, ends = message.isel(roughness=0), ends.isel(roughness=0)
        said = str(message.item())
        tally.add(said if said == FITTED else "not fitted", ends.values, kind.truths[name])


def measure_coverage(draws: int, tell: Tell = lambda line: None) -> xr.Dataset:
    """Measure how often verdicts err, and how often intervals hold the truth.

    Parameters
    ----------
    draws
        Of each kind of series, and of flow curve.
    tell
        Is told of each kind before it begins.

    Returns
    -------
    xr.Dataset
        Along ``series``: ``kind``, ``noise``, ``memory``, the shares ``verdict_share`` along
        ``verdict``, ``series_coverage`` along ``confidence``, and ``series_intervals``, the number
        of intervals. Along ``estimate``: ``curve``, ``parameter``, ``truth`` (of the smoothest wall
        where it depends on roughness), ``fitted_share``, ``estimate_coverage`` and
        ``estimate_intervals``.
    """
    rows = []
    for number, (kind, noise, memory) in enumerate(conditions()):
        tell(f"{kind}, noise {noise:g}, memory {memory:g}")
        tally = series_tally(kind, noise, memory, draws, number)
        shares = [tally.share(verdict) for verdict in VERDICTS]
        rows.append((kind, noise, memory, shares, tally.coverage(), tally.intervals))
    found = list(_fitted(draws, tell))
    pure = {"units": "1"}
    return xr.Dataset(
        {
            "kind": ("series", [row[0] for row in rows], {"long_name": "kind of series"}),
            "noise": ("series", [row[1] for row in rows], pure | {"long_name": "relative noise"}),
            "memory": ("series", [row[2] for row in rows], pure | {"long_name": "its memory"}),
            "verdict_share": (
                ("series", "verdict"),
                [row[3] for row in rows],
                pure | {"long_name": "share of series with a verdict"},
            ),
            "series_coverage": (
                ("series", "confidence"),
                [row[4] for row in rows],
                pure | {"long_name": "share of intervals of steady means that hold the truth"},
            ),
            "series_intervals": (
                "series",
                [row[5] for row in rows],
                pure | {"long_name": "number of intervals of steady means"},
            ),
            "curve": ("estimate", [row[0] for row in found], {"long_name": "kind of flow curve"}),
            "parameter": ("estimate", [row[1] for row in found], {"long_name": "what is fitted"}),
            "truth": ("estimate", [row[2] for row in found], pure | {"long_name": "its value"}),
            "fitted_share": (
                "estimate",
                [row[3] for row in found],
                pure | {"long_name": "share of draws of which it is said to be fitted"},
            ),
            "estimate_coverage": (
                ("estimate", "confidence"),
                [row[4] for row in found],
                pure | {"long_name": "share of intervals that hold the truth"},
            ),
            "estimate_intervals": (
                "estimate",
                [row[5] for row in found],
                pure | {"long_name": "number of intervals"},
            ),
        },
        coords={
            "verdict": ("verdict", list(VERDICTS), {"long_name": "verdict on a series"}),
            "confidence": ("confidence", list(CONFIDENCE), pure | {"long_name": "confidence"}),
        },
        attrs={"draws": draws, "records": RECORDS},
    )


def _fitted(draws: int, tell: Tell) -> Iterator[tuple[str, str, float, float, list[float], int]]:
    for number, (name, kind) in enumerate(CURVES.items()):
        tell(kind.words)
        for parameter, tally in curve_tallies(kind, draws, number).items():
            truth = kind.truths[parameter]
            said = tally.share(FITTED)
            yield name, parameter, truth, said, tally.coverage(), tally.intervals
