"""Figures from datasets: Dataset → Figure.

Every figure is drawn in one style, averages over seeds, facets over dimensions it does not know,
and says how many runs are missing. "Fig." is that of the paper.
"""

from pkgutil import resolve_name

import xarray as xr
from matplotlib.figure import Figure

from softslip.analysis.figures.drawing import save_figure
from softslip.analysis.figures.lineage import lineage
from softslip.files.products import FIGURES

__all__ = ["draw", "lineage", "save_figure"]


def draw(name: str, *datasets: xr.Dataset) -> Figure:
    """Draw one of `files.products.FIGURES` from the datasets that it shows."""
    figure: Figure = resolve_name(FIGURES[name].function)(*datasets)
    return figure
