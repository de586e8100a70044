"""Coverage of every estimator, measured on data made up from known truths."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

import xarray as xr

from softslip.analysis.fits import FITTED
from softslip.analysis.fits.likelihood import CONFIDENCE
from softslip.analysis.fits.slip import EVIDENCE
from softslip.analysis.observables.verdicts import VERDICTS
from softslip.studies.coverage.made_up_curves import CURVES
from softslip.studies.coverage.made_up_runs import RUNS
from softslip.studies.coverage.made_up_series import RECORDS, conditions
from softslip.studies.coverage.measured_curves import FAVOURED, curve_tallies
from softslip.studies.coverage.measured_runs import KNOWN, run_tallies
from softslip.studies.coverage.measured_series import series_tally
from softslip.studies.coverage.tallies import Tally

Tell = Callable[[str], None]

Measured = TypeVar("Measured")

PURE = {"units": "1"}

Tallies = Mapping[str, Tally]


def measure_coverage(draws: int, tell: Tell = lambda line: None, processes: int = 1) -> xr.Dataset:
    """Measure how often verdicts err, and how often intervals hold the truth.

    Parameters
    ----------
    draws
        Of each kind of series, flow curve and run.
    tell
        Is told of each kind when it has been measured.
    processes
        That share the kinds among them; what comes out does not depend on their number.

    Returns
    -------
    xr.Dataset
        Along ``series``: ``kind``, ``noise``, ``memory``, the shares ``verdict_share`` along
        ``verdict``, ``series_coverage`` along ``confidence``, ``series_intervals``, the number of
        intervals, and ``series_difference``, the median of the means less the truth. Along
        ``estimate``: ``curve``, ``parameter``, ``truth`` (of the smoothest wall where it depends on
        roughness), ``fitted_share``, ``estimate_coverage``, ``estimate_intervals`` and
        ``estimate_difference``. Along ``slip_kind``: ``slip_curve``, ``slip_truth``, the true
        exponent of slip, and the shares ``favoured_share`` along ``favoured``. Along
        ``measurement``: ``run_kind``, ``observable``, ``observable_truth``, ``known_share``,
        ``measurement_coverage``, ``measurement_intervals`` and ``measurement_difference``.
    """
    series = list(conditions())
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        # What takes longest goes first, so that the processes end at about the same time.
        of_runs = [
            _begin(pool, tell, kind.words, run_tallies, kind, draws, key)
            for key, kind in enumerate(RUNS.values())
        ]
        of_curves = [
            _begin(pool, tell, kind.words, curve_tallies, kind, draws, key)
            for key, kind in enumerate(CURVES.values())
        ]
        of_series = [
            _begin(pool, tell, _words(*each), series_tally, *each, draws, key)
            for key, each in enumerate(series)
        ]
        try:
            parts = (
                _series(series, [each.result() for each in of_series]),
                *_curves(each.result() for each in of_curves),
                _runs(each.result() for each in of_runs),
            )
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    coords = {
        "confidence": ("confidence", list(CONFIDENCE), PURE | {"long_name": "confidence"}),
    }
    together = xr.merge(parts, join="exact", compat="no_conflicts")
    return together.assign_coords(coords).assign_attrs(draws=draws, runs=draws, records=RECORDS)


def _begin(
    pool: Executor, tell: Tell, words: str, measure: Callable[..., Measured], *of: Any
) -> Future[Measured]:
    """Measure a kind of data in another process; tell its words at the end."""
    future = pool.submit(measure, *of)
    future.add_done_callback(lambda _: tell(words))
    return future


def _words(kind: str, noise: float, memory: float) -> str:
    return f"{kind}, noise {noise:g}, memory {memory:g}"


Column = tuple[Any, Sequence[Any], dict[str, str]]


def _shares(dim: str, name: str, tallies: Iterable[Tally], words: str) -> dict[str, Column]:
    """Return the columns with the coverage of tallies, and the number of their intervals.

    And with the median difference of the estimates from their truths, in the truth's units.
    """
    counted = list(tallies)
    coverage, intervals = [each.coverage() for each in counted], [e.intervals for e in counted]
    share = PURE | {"long_name": f"share of intervals of {words} that hold the truth"}
    return {
        f"{name}_coverage": ((dim, "confidence"), coverage, share),
        f"{name}_intervals": (
            dim,
            intervals,
            PURE | {"long_name": f"number of intervals of {words}"},
        ),
        f"{name}_difference": (
            dim,
            [each.median_difference() for each in counted],
            PURE | {"long_name": f"median of {words} less its truth"},
        ),
    }


def _series(series: Iterable[tuple[str, float, float]], tallies: Sequence[Tally]) -> xr.Dataset:
    kinds, noises, memories = (list(column) for column in zip(*series, strict=True))
    share = PURE | {"long_name": "share of series with a verdict"}
    return xr.Dataset(
        {
            "kind": ("series", kinds, {"long_name": "kind of series"}),
            "noise": ("series", noises, PURE | {"long_name": "relative noise"}),
            "memory": ("series", memories, PURE | {"long_name": "its memory"}),
            "verdict_share": (
                ("series", "verdict"),
                [[tally.share(verdict) for verdict in VERDICTS] for tally in tallies],
                share,
            ),
            **_shares("series", "series", tallies, "steady means"),
        },
        coords={"verdict": ("verdict", list(VERDICTS), {"long_name": "verdict on a series"})},
    )


def _curves(measured: Iterable[Tallies]) -> tuple[xr.Dataset, xr.Dataset]:
    """Return the coverage of what is fitted, and what the evidence for linear slip favours."""
    rows, evidence = [], []
    for (name, kind), found in zip(CURVES.items(), measured, strict=True):
        for parameter, tally in found.items():
            if parameter == EVIDENCE:
                evidence.append((name, kind.truths["slip_exponent"], tally))
            else:
                rows.append((name, parameter, kind.truths[parameter], tally))
    curves, parameters, truths, tallies = (list(column) for column in zip(*rows, strict=True))
    slip_curves, exponents, said = (list(column) for column in zip(*evidence, strict=True))
    fitted = PURE | {"long_name": "share of draws of which it is said to be fitted"}
    favoured = PURE | {"long_name": "share of draws in which the evidence favours it"}
    return xr.Dataset(
        {
            "curve": ("estimate", curves, {"long_name": "kind of flow curve"}),
            "parameter": ("estimate", parameters, {"long_name": "what is fitted"}),
            "truth": ("estimate", truths, PURE | {"long_name": "its value"}),
            "fitted_share": ("estimate", [tally.share(FITTED) for tally in tallies], fitted),
            **_shares("estimate", "estimate", tallies, "what is fitted"),
        }
    ), xr.Dataset(
        {
            "slip_curve": ("slip_kind", slip_curves, {"long_name": "kind of flow curve"}),
            "slip_truth": (
                "slip_kind",
                exponents,
                PURE | {"long_name": "true exponent of the slip velocity above yield"},
            ),
            "favoured_share": (
                ("slip_kind", "favoured"),
                [[tally.share(each) for each in FAVOURED] for tally in said],
                favoured,
            ),
        },
        coords={"favoured": ("favoured", list(FAVOURED), {"long_name": "law of slip"})},
    )


def _runs(measured: Iterable[Tallies]) -> xr.Dataset:
    rows = []
    for (name, kind), found in zip(RUNS.items(), measured, strict=True):
        for observable, tally in found.items():
            rows.append((name, observable, kind.truths[observable], tally))
    runs, observables, truths, tallies = (list(column) for column in zip(*rows, strict=True))
    known = PURE | {"long_name": "share of runs of which it is said to be known"}
    return xr.Dataset(
        {
            "run_kind": ("measurement", runs, {"long_name": "kind of run"}),
            "observable": ("measurement", observables, {"long_name": "what is measured"}),
            "observable_truth": ("measurement", truths, PURE | {"long_name": "its value"}),
            "known_share": ("measurement", [tally.share(KNOWN) for tally in tallies], known),
            **_shares("measurement", "measurement", tallies, "what is measured"),
        }
    )
