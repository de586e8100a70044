"""Whether the bulk's rates in time are one master curve at all roughnesses (Fig. 8c)."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from softslip.analysis.observables.series import FloatArray
from softslip.files.quantities import described

ROUGHNESS, SEED = "roughness", "seed"

LEAST_CURVES = 2
"""Fewest roughnesses whose curves can differ."""

LEAST_TIMES = 2
"""Fewest times of a curve."""

SHUFFLES = 999
"""Random exchanges of roughnesses among samples by which the chance of a spread is found."""


class Collapse(NamedTuple):
    """How far curves lie apart; NaN where it is not known.

    Attributes
    ----------
    spread
        Of the curves, over their rate: root mean square over the logarithm of time.
    expected
        What their errors let expect of curves that are one.
    ratio
        The one over the other.
    chance
        Of at least this spread where roughness makes no difference.
    curves
        Number of roughnesses.
    """

    spread: float = float("nan")
    expected: float = float("nan")
    ratio: float = float("nan")
    chance: float = float("nan")
    curves: int = 0


NAMES = {
    "spread": "master_curve_spread",
    "expected": "master_curve_expected_spread",
    "ratio": "master_curve_spread_ratio",
    "chance": "master_curve_spread_chance",
    "curves": "master_curves",
}
"""What the numbers of a collapse are called in datasets."""


def collapse(creep: xr.Dataset) -> xr.Dataset:
    """Measure how well γ̇_bulk(t) of all roughnesses falls on one curve at each stress.

    The curves γ̇_β(t) are means over seeds. At each time they scatter about their mean over
    roughnesses with a variance S², which is divided by the mean square of the rates of all runs,
    M²; the spread is the root of the mean of S²/M² over ln t, from the end of the first record to
    the end of the shortest run. Where curves are close it is the root mean square of the deviations
    of ln γ̇_β from their mean, in natural logarithms.

    Rates that scatter about zero have no logarithm. As rates are not divided by themselves but by
    M, which is never negative, no time and no run is left out for its value, which would bias the
    spread: where the bulk hardly flows the spread is about one, and so is what errors let expect.

    The expected spread is that of curves which differ by chance only, from the variance between
    seeds of one roughness, pooled over roughnesses. A ratio of 1 is a collapse within error. How
    far from 1 is too far follows from exchanging the roughnesses of runs of the same seed at
    random: the chance is the share of `SHUFFLES` exchanges with at least the spread found. It
    assumes nothing about how the curves are correlated in time, nor that packings of one seed at
    several roughnesses are independent. It is no smaller than the number of different exchanges
    allows: 1/4 with three seeds and two roughnesses.

    Parameters
    ----------
    creep
        From `analysis.observables.creep`.

    Returns
    -------
    xr.Dataset
        For every combination of the dimensions other than roughness and seed: the numbers of
        `Collapse`, called as `NAMES` says; NaN where there are no two roughnesses, the last three
        also where no roughness has two seeds.
    """
    rates = creep["shear_rate_bulk"]
    for dim in (ROUGHNESS, SEED):
        rates = rates if dim in rates.dims else rates.expand_dims(dim)
    dims = [str(dim) for dim in rates.dims if dim not in (ROUGHNESS, SEED, "time")]
    values = rates.transpose(*dims, ROUGHNESS, SEED, "time").values
    log_time = np.log(creep["time"].values.astype(np.float64))
    shape = tuple(rates.sizes[dim] for dim in dims)
    found = [collapse_of(values[place], log_time) for place in np.ndindex(*shape)]
    columns = {
        NAMES[field]: (dims, np.reshape([getattr(each, field) for each in found], shape))
        for field in Collapse._fields
    }
    coords = {dim: creep[dim] for dim in dims if dim in creep.coords}
    return described(xr.Dataset(columns, coords))


def collapse_of(rates: FloatArray, log_time: FloatArray) -> Collapse:
    """Measure the collapse of the curves of one stress; see `collapse`.

    Parameters
    ----------
    rates
        Shape (roughness, seed, time); NaN where a run is missing, or beyond its end.
    log_time
        Of their times, shape (time,).
    """
    done = np.asarray(np.isfinite(rates).any(axis=2))
    rates, done = rates[done.any(axis=1)], done[done.any(axis=1)]
    curves = len(rates)
    reached = np.isfinite(rates[done]).all(axis=0)
    if curves < LEAST_CURVES or reached.sum() < LEAST_TIMES:
        return Collapse(curves=curves)
    runs = np.where(done[..., None], rates[..., reached], 0.0)
    weight = np.gradient(log_time[reached])
    scale = (runs**2).sum(axis=(0, 1)) / done.sum()
    # Rates in units of their root mean square, and times by their share of the logarithmic axis.
    unit = np.sqrt(weight / weight.sum() / np.where(scale > 0, scale, 1.0))
    scaled = runs * unit
    counts = done.sum(axis=1)
    means = scaled.sum(axis=1) / counts[:, None]
    power = float(_variance_between(means))
    freedom = int(done.sum()) - curves
    if not freedom:
        return Collapse(spread=float(np.sqrt(power)), curves=curves)
    within = float(np.sum(((scaled - means[:, None]) ** 2)[done])) / freedom
    expected = within * float(np.mean(1 / counts))
    return Collapse(
        spread=float(np.sqrt(power)),
        expected=float(np.sqrt(expected)),
        ratio=float(np.sqrt(power / expected)) if expected > 0 else float("nan"),
        chance=_chance(scaled, done, power),
        curves=curves,
    )


def _variance_between(means: FloatArray) -> FloatArray:
    """Return the variance of curves of shape (..., roughness, time), summed over time."""
    return np.asarray(np.var(means, axis=-2, ddof=1).sum(axis=-1))


def _chance(scaled: FloatArray, done: NDArray[np.bool_], power: float) -> float:
    """Return how often the variance is at least as large with roughnesses exchanged at random."""
    random = np.random.default_rng(np.random.SeedSequence((*done.shape, SHUFFLES)))
    # Variances go by products of curves, for which as many coordinates as curves do.
    curves = scaled.reshape(-1, scaled.shape[-1])
    _, triangle = np.linalg.qr(curves.T)
    coordinates = triangle.T.reshape(*done.shape, -1)
    sums = np.zeros((SHUFFLES, len(done), coordinates.shape[-1]))
    for seed in range(done.shape[1]):
        there = np.flatnonzero(done[:, seed])
        order = random.permuted(np.tile(there, (SHUFFLES, 1)), axis=1)
        sums[:, there] += coordinates[order, seed]
    shuffled = _variance_between(sums / done.sum(axis=1)[:, None])
    # Exchanges that change nothing differ by rounding.
    larger = int(np.sum(shuffled >= power * (1 - 1e-9)))
    return (1 + larger) / (1 + SHUFFLES)
