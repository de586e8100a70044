"""From a target accuracy to settings: the cheapest ones whose measured error is small enough.

The rows come from the trade-off dataset, see docs/accuracy.md; `softslip numerics choices`
replaces them.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from softslip.errors import ConfigError

TABLE = "accuracy.json"
"""File of the package that holds the rows."""


@dataclass(frozen=True)
class Choice:
    """Settings with their measured error and cost.

    Attributes
    ----------
    settings
        Values by group and key of the parameter tree.
    error
        Largest relative error of slip velocity and shear rates over the scenes measured.
    cost
        Core-seconds per time unit over those of fidelity 'standard'.
    """

    settings: Mapping[str, Mapping[str, Any]]
    error: float
    cost: float

    def __str__(self) -> str:
        """Return the settings in words, with what they cost."""
        values = ", ".join(
            f"{group}.{key} {value}"
            for group, keys in self.settings.items()
            for key, value in keys.items()
        )
        return (
            f"{values} (measured error {self.error:.2g}, cost {self.cost:.2g} times that of "
            "fidelity standard)"
        )


@cache
def measured_choices() -> tuple[Choice, ...]:
    """Return the rows that come with this version, cheapest first."""
    text = (files(__package__) / TABLE).read_text(encoding="utf-8")
    return tuple(Choice(**row) for row in json.loads(text)["rows"])


def cheapest(target: float, choices: Sequence[Choice] | None = None) -> Choice:
    """Return the cheapest settings that meet a target relative error.

    Parameters
    ----------
    target
        Largest acceptable error.
    choices
        Rows to choose from; those of this version by default.

    Raises
    ------
    ConfigError
        When no row has so small an error.
    """
    rows = measured_choices() if choices is None else choices
    good = [row for row in rows if row.error <= target]
    if not good:
        least = min(row.error for row in rows)
        raise ConfigError(
            "accuracy",
            target,
            f"is below {least:.2g}, the smallest error that was measured",
            f"use at least {least:.2g}, or settings of your own (see docs/accuracy.md)",
        )
    return min(good, key=lambda row: row.cost)
