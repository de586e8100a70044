"""Which numbers of a dataset may be held against the paper's: those of the paper's material."""

import json
from collections.abc import Mapping
from typing import Any

import xarray as xr

from softslip.config.paper_material import MATERIAL, departures
from softslip.config.sweep import label_of


def unlike(dataset: xr.Dataset, at: Mapping[str, Any] | None = None) -> tuple[tuple[str, Any], ...]:
    """Return what makes a material another one than the paper's; nothing where it is the paper's.

    Parameters
    ----------
    dataset
        Of a scenario, with its parameters among the attributes; without them all that it has no
        coordinate of is taken for the paper's.
    at
        Values of swept dimensions; single coordinates of the dataset count as well.

    Returns
    -------
    tuple of (str, Any)
        Name of the dimension, which the parameter is or would be, and value.
    """
    recorded = json.loads(str(dataset.attrs.get("parameters", "{}")))
    base, axes = recorded.get("base", {}), recorded.get("axes")
    single = {str(name): each.item() for name, each in dataset.coords.items() if each.ndim == 0}
    known = single | dict(at or {})
    values: dict[str, Any] = {}
    for path in MATERIAL:
        section, _, key = path.partition(".")
        if key in base.get(section, {}):
            values[path] = base[section][key]
        if axes is None or path in axes:
            spelled = (path.replace(".", "_"), label_of(path))
            values.update((path, known[name]) for name in spelled if name in known)
    return tuple((label_of(path), value) for path, value in departures(values))
