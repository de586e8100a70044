"""Numbers, efforts and many values at once, as people read and write them."""

import math
from collections.abc import Iterable
from typing import Any

LONG = 360.0
"""Processor time from which it is given in hours [s]."""


def listed(values: Iterable[Any], most: int = 3) -> str:
    """Return values in few words: all of them, or the first and the last, and how many."""
    found = sorted(set(values), key=lambda each: (isinstance(each, str), each))
    if len(found) <= most:
        return ", ".join(map(shown, found))
    if isinstance(found[-1], str):
        return f"{len(found)} different"
    return f"{shown(found[0])} to {shown(found[-1])} ({len(found)})"


def shown(value: Any) -> str:
    """Return a number or word as people read and write it."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def effort(core_seconds: float) -> str:
    """Return processor time in the unit that suits it."""
    if core_seconds < LONG:
        return f"{core_seconds:.3g} core-seconds"
    return f"{core_seconds / 3600:.3g} core-hours"


def with_error(value: Any, error: Any = None) -> str:
    """Return a value to two digits of its error, to six where that is not known."""
    if value is None:
        return "unknown"
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, float):
        return str(value)
    if not isinstance(error, float) or not 0 < error < math.inf:
        return f"{value:g}" if error is None else f"{value:g} ± {error:g}"
    # No more than a number holds, and the error's first digit where it is larger than the value.
    digits = math.floor(math.log10(max(abs(value), error))) - math.floor(math.log10(error)) + 2
    return f"{value:#.{min(digits, 15)}g} ± {error:#.2g}".replace(". ", " ").removesuffix(".")
