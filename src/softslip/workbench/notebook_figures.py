"""Figures in the output of a notebook."""

import io
import sys

from matplotlib.figure import Figure


def show_figures() -> None:
    """Have a notebook show a figure that a cell ends with.

    Figures of pyplot are shown by its own backend; ours belong to no window and no backend, so that
    a notebook which has not imported pyplot would print their names. What was registered for
    figures before is left. Outside IPython nothing is done.
    """
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is None:
        return
    pictures = shell.display_formatter.formatters["image/png"]
    try:
        pictures.lookup_by_type(Figure)
    except KeyError:
        pictures.for_type(Figure, _picture)


def _picture(figure: Figure) -> bytes:
    """Return a figure as a PNG."""
    from softslip.analysis.figures.drawing import house_style

    file = io.BytesIO()
    with house_style():
        figure.savefig(file, format="png")
    return file.getvalue()
