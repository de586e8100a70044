"""What all figures share: style, colours, panels and labels."""

import functools
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import resources
from typing import Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that the colour-blind can tell apart (Okabe and Ito 2008)."""

MARKERS = ("o", "s", "^", "D", "v", "p", "<", ">")
"""One marker for each roughness, each of which can be filled, half filled and open."""

LETTERS_PER_INCH = 18
"""Letters of the small lines below a figure for each inch of its width."""

LINES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1.5, 1, 1.5)),
    (0, (9, 2)),
    (0, (1, 3)),
    (0, (9, 1.5, 1, 1.5, 1, 1.5)),
)
"""One line style for each roughness, as many as there are colours."""

WIDE, NARROW = 7.0, 3.4
"""Widths of two columns and of one [inch]."""

MOST_DECADES = 200.0
"""Ratio of the ends of a logarithmic axis up to which more than its decades are labelled."""

WITHIN_A_DECADE = 4.0
"""Ratio of the ends below which 1, 2 and 5 of a decade leave one label or none."""

SYMBOLS = {
    "stress": r"$\sigma$",
    "imposed_shear_rate": r"$\dot\gamma_\mathrm{wall}$",
    "roughness": r"$\beta$",
    "wall_separation": r"$H$",
    "area_fraction": r"$\phi$",
}
"""How a dimension is written in a legend, where that is not its parameter's symbol."""

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


@contextmanager
def house_style() -> Iterator[None]:
    """Use the house style and nothing of the user's own settings, and put those back after."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        with resources.as_file(resources.files(__package__) / "style.mplstyle") as path:
            matplotlib.rc_file(path, use_default_template=False)
        yield


def styled(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Make a function draw in the house style."""

    @functools.wraps(function)
    def wrapped(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Result:
        with house_style():
            return function(*args, **kwargs)

    return wrapped


def sequence(count: int) -> list[Any]:
    """Return colours for ordered values, dark for the largest, shape (count,)."""
    colours = matplotlib.colormaps["viridis_r"]
    return [colours(0.12 + 0.84 * place) for place in (np.arange(count) + 0.5) / max(count, 1)]


def symbol(label: str) -> str:
    """Return how a dimension is written: its parameter's symbol, or else its own name."""
    return SYMBOLS.get(label) or _symbols().get(label) or label.replace("_", " ")


@functools.cache
def _symbols() -> dict[str, str]:
    """Return the symbol of each parameter by the name of the dimension that it becomes."""
    found: dict[str, str] = {}
    for path, field in all_fields(Parameters).items():
        name = str(extra(field, "label") or path.rpartition(".")[2])
        written = _as_tex(str(extra(field, "symbol")))
        # A name that two sections share stands for neither.
        found[name] = "" if name in found else written
        found[path.replace(".", "_")] = written
    return found


def _as_tex(written: str) -> str:
    """Return a symbol of the configuration as TeX; words stay as they are."""
    if re.fullmatch(r"[A-Za-z]{3,}", written):
        return written
    upright = re.sub(r"_(\w{2,})", r"_\\mathrm{\1}", written)
    return f"${upright}$"


def named(label: str, value: Any) -> str:
    """Return a dimension's symbol and value for a legend or title; nothing if it has no value."""
    if isinstance(value, float | np.floating) and not np.isfinite(value):
        return ""
    text = f"{value:.3g}" if isinstance(value, float | np.floating) else str(value)
    return f"{symbol(label)} = {text}"


def label_decades(axis: Axis) -> None:
    """Label a logarithmic axis at 1, 2 and 5 of each decade, or at a few values within one."""
    low, high = sorted(axis.get_view_interval())
    if high < MOST_DECADES * low:
        few = high < WITHIN_A_DECADE * low
        axis.set_major_locator(MaxNLocator(4) if few else LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def grid_of_panels(
    rows: int, columns: int, *, width: float, height: float
) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure of equal panels, ``height`` inches for each row."""
    figure = Figure(figsize=(width, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, [list(row) for row in axes]


def note(figure: Figure, *lines: str) -> None:
    """Write small lines below a figure; sentences are parted by semicolons, not within a line."""
    sentences = [each for line in lines if line for each in line.split("; ")]
    if not sentences:
        return
    width = int(LETTERS_PER_INCH * figure.get_figwidth())
    filled = [sentences[0]]
    for each in sentences[1:]:
        joined = f"{filled[-1]}; {each}"
        filled = [*filled[:-1], joined] if len(joined) <= width else [*filled, each]
    figure.supxlabel("\n".join(filled), x=0.01, ha="left", fontsize=7.5, color="0.35")
