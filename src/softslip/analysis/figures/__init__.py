"""Figures from datasets: Dataset → Figure.

Every figure is drawn in one style, averages over seeds, facets over dimensions it does not know,
and says how many runs are missing. "Fig." is that of the paper.
"""

from softslip.analysis.figures.benchmark import benchmark
from softslip.analysis.figures.drawing import save_figure
from softslip.analysis.figures.lineage import lineage
from softslip.analysis.figures.membranes import snapshot
from softslip.analysis.figures.rheology import flow_curves
from softslip.analysis.figures.stability import stability_limit, stability_map
from softslip.analysis.figures.tradeoff import extrapolation, tradeoff
from softslip.analysis.figures.trajectory import trajectory
from softslip.analysis.figures.transient import creep
from softslip.analysis.figures.validation import validation
from softslip.analysis.figures.velocity import profiles

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
