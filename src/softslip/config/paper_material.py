"""Whether a suspension is the paper's: only then do its published numbers stand beside ours."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters

MATERIAL = (
    "solvent.viscosity",
    "suspension.area_fraction",
    "suspension.mean_radius",
    "suspension.size_ratio",
    "membrane.elastic_constant",
    "steric.length",
    "steric.energy",
    "wall.bump_separation",
)
"""Parameters of the material and of the walls' shape that the paper keeps fixed (Sec. III)."""

ROUNDING = 0.01
"""Relative difference up to which a number is the paper's, which gives few digits of some."""


def departures(values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the parameters of a material that are not the paper's.

    Parameters
    ----------
    values
        Parameters by their dotted paths; one that is not among them is at its default, the
        paper's. Those that the paper varies, and those of numerics, do not matter.

    Yields
    ------
    tuple of str and Any
        Path and value, in the order of `MATERIAL`.
    """
    fields = all_fields(Parameters)
    for path in MATERIAL:
        known = extra(fields[path], "paper")
        value = values.get(path, known)
        if not math.isclose(value, known, rel_tol=ROUNDING):
            yield path, value
