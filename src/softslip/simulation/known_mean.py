"""How well a run knows the mean of a fluctuating observable, by the means of batches.

The later half of a run is cut into equal batches. Where their means show no trend, the standard
error of the overall mean follows from their scatter, raised by the correlation of neighbours
(Flyvbjerg & Petersen 1989; Glynn & Whitt 1991 on stopping by it). A verdict is looked for at a few
times that grow geometrically, and must be the same at two in a row, since each look is one more
chance to stop on an error that is small by luck.
"""

import numpy as np

from softslip.solver.geometry import FloatArray

BATCHES = 16
"""Batches of the later half: 15 degrees of freedom give the error itself to 18 %."""

RECORDS_PER_BATCH = 4
"""Records in a batch at the first look, on average; the shortest run is 128 records long."""

GROWTH = 1.2
"""Ratio of the times of two looks."""

TREND = 2.0
"""Standard errors of its slope beyond which the means of the batches have a trend."""


ROUNDING = 1e-12
"""Relative scatter of the batches' means below which an observable is constant."""


def is_known(
    looks: FloatArray, edges: FloatArray, means: FloatArray, time: float, wanted: float
) -> bool:
    """Whether a run knows an observable's mean at a look, and knew it at the one before.

    Parameters
    ----------
    looks
        See `look_times`.
    edges, means
        See `relative_error`; to the present time or beyond.
    time
        Of the look; at any other time nothing is known.
    wanted
        Largest relative standard error.
    """
    place = int(np.searchsorted(looks, time))
    if not 0 < place < looks.size or looks[place] != time:
        return False
    for look in looks[place - 1 : place + 1]:
        records = int(np.searchsorted(edges, look))
        if relative_error(edges[: records + 1], means[:records]) > wanted:
            return False
    return True


def look_times(edges: FloatArray) -> FloatArray:
    """Return the times at which a run looks how well it knows its means.

    Parameters
    ----------
    edges
        Increasing edges of the records that the run can have, shape (records + 1,).

    Returns
    -------
    numpy.ndarray
        Those edges, each at least `GROWTH` times the one before, whose later half holds
        `RECORDS_PER_BATCH` records a batch. They do not depend on how long the run is.
    """
    halves = np.searchsorted(edges, 0.5 * edges)
    filled = np.arange(edges.size) - halves >= BATCHES * RECORDS_PER_BATCH
    looks = list[float]()
    for edge in edges[filled]:
        if not looks or edge >= GROWTH * looks[-1]:
            looks.append(float(edge))
    return np.array(looks)


def relative_error(edges: FloatArray, means: FloatArray) -> float:
    """Return the relative standard error of an observable's mean over the later half of a run.

    Parameters
    ----------
    edges
        Increasing edges of the records, the first one 0, shape (records + 1,).
    means
        Of the observable, over each record, shape (records,).

    Returns
    -------
    float
        Infinite where the means of the batches have a trend or are correlated throughout, and
        where the mean is zero.
    """
    batches = _batch_means(edges, means)
    mean, deviations = float(batches.mean()), batches - batches.mean()
    variance = float(deviations @ deviations)
    if variance <= (ROUNDING * mean) ** 2:
        return 0.0 if mean else np.inf
    correlation = float(deviations[1:] @ deviations[:-1]) / variance
    if mean == 0 or correlation >= 0.5 or _has_trend(deviations):
        return np.inf
    widened = (1 + correlation) / (1 - correlation) if correlation > 0 else 1.0
    return float(np.sqrt(widened * variance / (BATCHES * (BATCHES - 1))) / abs(mean))


def _batch_means(edges: FloatArray, means: FloatArray) -> FloatArray:
    """Return the means of equal batches of the later half; records may lie across two of them."""
    integral = np.concatenate(([0.0], np.cumsum(means * np.diff(edges))))
    cuts = np.linspace(0.5 * edges[-1], edges[-1], BATCHES + 1)
    return np.asarray(np.diff(np.interp(cuts, edges, integral)) / np.diff(cuts))


def _has_trend(deviations: FloatArray) -> bool:
    """Whether a straight line through the batches rises or falls beyond its error."""
    place = np.arange(BATCHES) - 0.5 * (BATCHES - 1)
    spread = float(place @ place)
    slope = float(place @ deviations) / spread
    rest = deviations - slope * place
    return bool(abs(slope) > TREND * np.sqrt(float(rest @ rest) / (BATCHES - 2) / spread))
