"""One sample as the paper shows it: flowing, with its velocity field, and as it yields."""

import xarray as xr
from matplotlib.figure import Figure

from softslip.analysis import paper
from softslip.analysis.figures.drawing import named
from softslip.analysis.figures.membranes import snapshot

WINDOW = 12.0
"""Side of the part of a sample in which the velocity field is shown [mean radius]."""


def flowing_sample(run: xr.Dataset) -> Figure:
    """Draw the velocity field of a flowing sample at every point that was kept (Fig. 1).

    Parameters
    ----------
    run
        A shear run with snapshots: that of a scenario that is nearest to the paper's.
    """
    return snapshot(
        run,
        time=paper.FLOWING_SAMPLE.time,
        window=WINDOW,
        remark=_remark("Fig. 1", paper.FLOWING_SAMPLE),
    )


def yielding_sample(run: xr.Dataset) -> Figure:
    """Draw a sample as it yields (Fig. 3).

    Parameters
    ----------
    run
        A shear run with snapshots: that of a scenario that is nearest to the paper's.
    """
    remark = _remark("Fig. 3", paper.YIELDING_SAMPLE)
    return snapshot(run, time=paper.YIELDING_SAMPLE.time, remark=remark)


def _remark(figure: str, sample: paper.Sample) -> str:
    """Say what the paper shows."""
    parts = [named("stress", sample.stress)]
    if sample.roughness is not None:
        parts.append(named("roughness", sample.roughness))
    return f"paper, {figure}: {', '.join(parts)}, $t$ = {sample.time:g}"
