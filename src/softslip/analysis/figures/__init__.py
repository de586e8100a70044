"""Figures from datasets: Dataset → Figure.

Every figure is drawn in one style, averages over seeds, facets over dimensions it does not know,
and says how many runs are missing. "Fig." is that of the paper.
"""

from pkgutil import resolve_name

import xarray as xr
from matplotlib.figure import Figure

from softslip.analysis.figures.lineage import lineage
from softslip.analysis.figures.movie import Movie
from softslip.analysis.figures.saving import save_figure
from softslip.files.products import FIGURES

__all__ = ["Movie", "draw", "lineage", "save_figure"]


def draw(name: str, *datasets: xr.Dataset) -> Figure | Movie:
    """Draw one of `files.products.FIGURES` from the datasets that it shows."""
    figure: Figure | Movie = resolve_name(FIGURES[name].function)(*datasets)
    return figure
