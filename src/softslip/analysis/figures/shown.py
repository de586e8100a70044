"""The numbers that a figure shows, kept with it as it is drawn.

A figure's functions hand over what they draw, under the names that it has in the datasets: some of
it is known to nobody else, such as a fitted curve over the range of its panel.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray


class Quantity(NamedTuple):
    """Values of one kind.

    Attributes
    ----------
    values
        One, or one for each point.
    unit
        Theirs, "1" for pure numbers and words.
    meaning
        A few words.
    """

    values: Any
    unit: str = "1"
    meaning: str = ""


@dataclass(frozen=True)
class Series:
    """A line, a set of points, bars or arrows of a figure.

    Attributes
    ----------
    panel
        In which panel it is.
    name
        What it is.
    points
        The values of each point by their names, shape (points,) each.
    at
        What all points have in common, such as their roughness, by its name.
    """

    panel: str
    name: str
    points: Mapping[str, Quantity]
    at: Mapping[str, Quantity]


_SHOWN: WeakKeyDictionary[Figure, list[Series]] = WeakKeyDictionary()


def show(
    axes: Axes,
    panel: str,
    name: str,
    points: Mapping[str, Quantity],
    at: Mapping[str, Quantity] | None = None,
) -> None:
    """Keep the numbers of something that is drawn.

    Parameters
    ----------
    axes
        In which it is drawn.
    panel, name, points, at
        See `Series`; one without any points is not kept.
    """
    figure = axes.get_figure(root=True)
    assert figure is not None, "axes without a figure"
    kept = {key: each._replace(values=np.array(each.values)) for key, each in points.items()}
    sizes = {np.shape(each.values) for each in kept.values()}
    assert len(sizes) == 1, f"{panel} {name}: columns of several shapes {sizes}"
    if sizes != {(0,)}:
        common = {
            key: each._replace(values=np.asarray(each.values).item())
            for key, each in (at or {}).items()
        }
        _SHOWN.setdefault(figure, []).append(Series(panel, name, kept, common))


def shown(figure: Figure) -> tuple[Series, ...]:
    """Return what a figure shows, in the order in which it was drawn."""
    return tuple(_SHOWN.get(figure, ()))


def quantity(array: xr.DataArray, values: ArrayLike | None = None) -> Quantity:
    """Return the values of an array, or others of its kind, with its unit and meaning."""
    unit, meaning = (str(array.attrs.get(key, "")) for key in ("units", "long_name"))
    return Quantity(array.values if values is None else values, unit or "1", meaning)


def place(data: xr.Dataset | xr.DataArray) -> dict[str, Quantity]:
    """Return the coordinates that all of some data have in common, where they are known."""
    single = {str(name): each for name, each in data.coords.items() if each.ndim == 0}
    return {name: quantity(each) for name, each in single.items() if _known(each.item())}


def along(array: xr.DataArray, chosen: NDArray[np.bool_]) -> dict[str, Quantity]:
    """Return the coordinates of some of an array's elements, in the order of its memory."""
    return {
        name: quantity(array[name], values.ravel()[chosen])
        for name, values in coordinates(array).items()
    }


def coordinates(array: xr.DataArray) -> dict[str, NDArray[Any]]:
    """Return the coordinate of each element along each dimension, of the array's shape.

    Where a dimension has no coordinate, it is numbered from 0.
    """
    found: dict[str, NDArray[Any]] = {}
    for axis, dim in enumerate(array.dims):
        shape = [1] * array.ndim
        shape[axis] = array.sizes[dim]
        found[str(dim)] = np.broadcast_to(array[dim].values.reshape(shape), array.shape)
    return found


def words(values: Iterable[Any]) -> NDArray[Any]:
    """Return an array of texts, of any length."""
    return np.array([str(each) for each in values], dtype=object)


def _known(value: Any) -> bool:
    return not isinstance(value, float) or bool(np.isfinite(value))
