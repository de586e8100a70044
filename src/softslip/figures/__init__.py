"""Figures from datasets: Dataset → Figure.

Every figure is drawn in one style, averages over seeds, facets over dimensions it does not know,
and says how many runs are missing. "Fig." is that of the paper.
"""

from softslip.figures.benchmark import benchmark
from softslip.figures.drawing import save_figure
from softslip.figures.lineage import lineage
from softslip.figures.membranes import snapshot
from softslip.figures.rheology import flow_curves
from softslip.figures.stability import stability_limit, stability_map
from softslip.figures.tradeoff import extrapolation, tradeoff
from softslip.figures.trajectory import trajectory
from softslip.figures.transient import creep
from softslip.figures.validation import validation
from softslip.figures.velocity import profiles

__all__ = [
    "benchmark",
    "creep",
    "extrapolation",
    "flow_curves",
    "lineage",
    "profiles",
    "save_figure",
    "snapshot",
    "stability_limit",
    "stability_map",
    "tradeoff",
    "trajectory",
    "validation",
]
