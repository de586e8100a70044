"""Fitted parameters as text, and lines of fitted powers."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from softslip.analysis.figures.drawing import named, symbol
from softslip.analysis.figures.panels import Family
from softslip.analysis.figures.published import power_through
from softslip.analysis.figures.shown import place, quantity, show
from softslip.analysis.fits import FITTED
from softslip.files.quantities import POOLED

FloatArray = NDArray[np.float64]


def measured(fits: xr.Dataset, name: str) -> str:
    """Write a parameter with its error to the error's first two digits."""
    value, error = float(fits[name]), float(fits[f"{name}_error"])
    if not np.isfinite(error) or error <= 0:
        return f"{value:.3g} (error not known)"
    digits = max(1 - int(np.floor(np.log10(error))), 0)
    return rf"{value:.{digits}f} $\pm$ {error:.{digits}f}".replace("-", "−")


def draw_powers(
    axes: Axes,
    panel: str,
    name: str,
    points: dict[int, tuple[FloatArray, FloatArray]],
    laws: xr.Dataset,
    family: Family,
) -> None:
    """Draw lines of a fitted power through the middle of the points, with the exponents.

    There is one for all members of a family where they were fitted together, or else one for each.

    Parameters
    ----------
    axes, panel
        Where, with logarithmic axes.
    name
        Of the exponent.
    points
        Abscissas and values of each member, by its number.
    laws
        From `analysis.fits.fit_laws`.
    family
        Whose members have a colour each.
    """
    pooled = f"{POOLED}{name}"
    if pooled in laws and family.dim not in laws[pooled].dims:
        together = np.concatenate([np.stack(each) for each in points.values()], axis=1)
        whose = f"all {symbol(family.dim)}" if len(points) > 1 else ""
        _draw_power(axes, panel, pooled, (together[0], together[1]), laws, ("black", whose))
        return
    chosen = pooled if pooled in laws else name
    for number, each in points.items():
        whose = named(family.dim, family.values[number]) if len(points) > 1 else ""
        look = (family.colour(number), whose)
        _draw_power(axes, panel, chosen, each, family.laws_of(laws, number), look)


def _draw_power(
    axes: Axes,
    panel: str,
    name: str,
    points: tuple[FloatArray, FloatArray],
    laws: xr.Dataset,
    look: tuple[Any, str],
) -> None:
    """Draw one power where it was fitted, in a colour and with words for whose it is."""
    if str(laws[f"{name}_message"].item()) != FITTED:
        return
    colour, whose = look
    label = f"{', '.join(filter(None, ('fitted', whose)))}: power {measured(laws, name)}"
    power_through(axes, *points, float(laws[name]), color=colour, label=label)
    kept = {key: quantity(laws[key], [float(laws[key])]) for key in (name, f"{name}_error")}
    show(axes, panel, f"power fitted: {name.replace('_', ' ')}", kept, place(laws))
