"""Arrays by name, and names that stand for groups of them: ``group/name``."""

from collections.abc import Mapping
from typing import Any

import numpy as np

Arrays = dict[str, np.ndarray[Any, np.dtype[Any]]]
"""Arrays by name."""


def under(group: str, arrays: Mapping[str, Any]) -> Arrays:
    """Return arrays with a group's name before theirs."""
    return {f"{group}/{name}": np.asarray(value) for name, value in arrays.items()}


def below(arrays: Arrays, group: str) -> Arrays:
    """Return the arrays of a group by their own names: the inverse of `under`."""
    start = f"{group}/"
    return {key.removeprefix(start): arrays[key] for key in arrays if key.startswith(start)}
