"""A study of the numerics: one YAML file with the values that each part goes through."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from softslip.config.reading import in_file, read_mapping, relocated
from softslip.errors import ConfigError
from softslip.messages import brief, key_text
from softslip.studies.stability.map_design import MapDesign
from softslip.studies.tradeoff.tradeoff_design import TradeoffDesign

STUDIES = Path("config/numerics")
"""Folder of the studies, below the current directory."""

PARTS = ("description", "validation", "tradeoff", "stability", "elements", "coverage")
"""Keys at the top of a study."""

DRAWS = 500
"""Draws by which coverage is measured, where a study gives none: it is then known to 2 %."""

P = TypeVar("P", TradeoffDesign, MapDesign)

_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


@dataclass(frozen=True)
class Validation:
    """A case, and the values that its parameters take in turn.

    Attributes
    ----------
    case
        Name of the case.
    axes
        Values by parameter; all combinations are solved.
    """

    case: str
    axes: Mapping[str, tuple[Any, ...]]


@dataclass(frozen=True)
class Study:
    """What is measured.

    Attributes
    ----------
    name
        The file's name without its suffix.
    validation
        Sweeps over cases with known solutions, by name.
    tradeoff, stability
        Designs of those parts.
    elements
        Options of the benchmark of scene elements.
    draws
        Made-up series and flow curves of each kind by which coverage is measured.
    """

    name: str
    validation: Mapping[str, Validation]
    tradeoff: TradeoffDesign
    stability: MapDesign
    elements: Mapping[str, Any]
    draws: int


def load_study(name: str) -> Study:
    """Read a study.

    Parameters
    ----------
    name
        Of a file in `STUDIES`, without its suffix.

    Raises
    ------
    ConfigError
        In one line with the file's name, the key, the value, the limit and a remedy.
    """
    path = STUDIES / f"{name}.yaml"
    if not _NAME.fullmatch(name) or not path.exists():
        present = ", ".join(sorted(file.stem for file in STUDIES.glob("*.yaml")))
        raise ConfigError(
            "numerics",
            brief(name),
            f"is no study in the folder {STUDIES} of the current directory",
            f"use one of {present}" if present else "change to the project's folder",
        )
    tree = read_mapping(path)
    try:
        return _study(name, tree)
    except ConfigError as error:
        raise in_file(path, error) from None


def _study(name: str, tree: Mapping[Any, Any]) -> Study:
    for key, value in tree.items():
        if key not in PARTS:
            raise ConfigError(
                key_text(key),
                brief(value),
                "is given for a key that does not exist",
                f"the keys at the top are {', '.join(PARTS)}",
            )
    sweeps = _mapping(tree, "validation")
    return Study(
        name,
        {each: _validation(each, values) for each, values in sweeps.items()},
        _design(TradeoffDesign, tree, "tradeoff"),
        _design(MapDesign, tree, "stability"),
        _elements(_mapping(tree, "elements")),
        _draws(_mapping(tree, "coverage")),
    )


def _mapping(tree: Mapping[Any, Any], key: str) -> dict[str, Any]:
    value = tree.get(key) or {}
    if not isinstance(value, dict):
        raise ConfigError(key, brief(value), "is no mapping", "write 'key: value' lines under it")
    return value


def _design(model: type[P], tree: Mapping[Any, Any], key: str) -> P:
    try:
        return model.of(_mapping(tree, key))
    except ConfigError as error:
        raise relocated(error, f"{key}.{error.key}") from None


def _validation(name: str, values: Any) -> Validation:
    key = f"validation.{key_text(name)}"
    if not _NAME.fullmatch(str(name)):
        raise ConfigError(
            key, brief(values), "is no name for a file", "use letters, digits, _ and -"
        )
    if not isinstance(values, dict):
        raise ConfigError(key, brief(values), "is no mapping", "list values by parameter")
    axes = {axis: listed for axis, listed in values.items() if axis != "case"}
    for axis, listed in axes.items():
        if not isinstance(listed, list) or not listed:
            raise ConfigError(
                f"{key}.{axis}", brief(listed), "is no list of values", "use brackets, such as [1]"
            )
    return Validation(
        str(values.get("case", name)), {axis: tuple(listed) for axis, listed in axes.items()}
    )


def _elements(values: dict[str, Any]) -> dict[str, Any]:
    known: dict[str, tuple[type, ...]] = {
        "particles": (int,),
        "fidelity": (str,),
        "budget": (int, float),
    }
    for key, value in values.items():
        if key not in known or not isinstance(value, known[key]) or isinstance(value, bool):
            raise ConfigError(
                f"elements.{key_text(key)}",
                brief(value),
                "is no option of the benchmark of scene elements",
                "give particles: a whole number, fidelity: a level, budget: seconds",
            )
    return values


def _draws(values: dict[str, Any]) -> int:
    """Return how many series and flow curves of each kind are made up."""
    for key, value in values.items():
        if key != "draws" or not isinstance(value, int) or isinstance(value, bool) or value < 1:
            raise ConfigError(
                f"coverage.{key_text(key)}",
                brief(value),
                "is no number of draws",
                "give draws: a whole number from 1 on",
            )
    return int(values.get("draws", DRAWS))
