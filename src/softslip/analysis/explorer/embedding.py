"""Arrays as a page has them: the bytes of their numbers, so that not one digit is lost."""

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

TYPES = {"f8": "<f8", "u4": "<u4", "u2": "<u2", "u1": "u1"}
"""Types of numbers by the names that `numbers.js` knows, all little-endian."""


def embedded(values: ArrayLike, kind: str = "f8") -> dict[str, str]:
    """Return numbers for JSON: their type, and their bytes in base64.

    Parameters
    ----------
    values
        Numbers that the type holds exactly, flattened in the order of their memory.
    kind
        One of `TYPES`.

    Raises
    ------
    ValueError
        When the type cannot hold a number.
    """
    given = np.asarray(values)
    cast = given.astype(TYPES[kind]).ravel()
    if not np.array_equal(cast, given.ravel(), equal_nan=kind == "f8"):
        raise ValueError(f"numbers from {given.min()} to {given.max()} do not fit into {kind}")
    return {"type": kind, "bytes": base64.b64encode(cast.tobytes()).decode("ascii")}


def restored(array: dict[str, Any]) -> np.ndarray[Any, np.dtype[Any]]:
    """Return the numbers that `embedded` made text of, as `numbers.js` does."""
    return np.frombuffer(base64.b64decode(array["bytes"]), dtype=TYPES[array["type"]])
