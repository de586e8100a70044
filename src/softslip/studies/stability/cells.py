"""The cells of the map: one run each, of parameters that stretch one axis, with its criterion."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from softslip.studies.boxes import Tree, merged
from softslip.studies.stability.map_design import MapDesign
from softslip.studies.stability.map_scenes import SCHEMES, Scheme, in_scheme

PATIENCE: Mapping[Scheme, float] = {"standard": 4.0, "literal": 1.0}
"""How much longer cells of the level are than those of the mesh, whose steps cost more."""


@dataclass(frozen=True)
class Cell:
    """One run of the map.

    Attributes
    ----------
    group, label, value
        The axis, and where on it the cell lies, in words and as a number.
    scheme
        Which scheme runs it.
    tree
        Parameters of the run.
    start
        Parameters of the packing, its growth and its ageing, at 'standard' but for those at rest.
    duration
        Length of the run [time unit].
    criterion
        'finer' compares with a finer run, 'rates' with its shear rate only, 'rest' with the
        state at the start; 'sharper' is 'finer', and also notes the difference from a run of a
        smaller regularisation length.
    """

    group: str
    label: str
    value: float
    scheme: Scheme
    tree: Tree
    start: Tree
    duration: float
    criterion: Literal["finer", "sharper", "rates", "rest"] = "finer"


def cells_along(
    group: str,
    design: MapDesign,
    starts: Mapping[float, Tree],
    *,
    change: Callable[[float], Tree] = lambda _: {},
    speed: float = 0.0,
    schemes: tuple[Scheme, ...] = SCHEMES,
) -> list[Cell]:
    """Return the cells of an axis.

    Parameters
    ----------
    group, design
        The axis and the design.
    starts
        What runs begin from, by the place on the axis.
    change
        What a run changes of its start besides, from its place.
    speed
        By how much a run is faster for each unit on the axis, and therefore shorter.
    schemes
        In which it is run.
    """
    return [
        Cell(
            group,
            f"{value:g}",
            value,
            scheme,
            merged(in_scheme(design, start, scheme), change(value)),
            start,
            design.duration / max(1.0, speed * value) * PATIENCE[scheme],
        )
        for scheme in schemes
        for value, start in starts.items()
    ]
