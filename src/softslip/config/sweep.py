"""Axes over parameters, and the parameters of one combination of their values."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from softslip.config.fields import extra
from softslip.config.parameters import Parameters, check_value, field_at
from softslip.config.reading import relocated
from softslip.errors import ConfigError
from softslip.messages import brief, key_text

LONGEST_NOTE = 200
"""Length above which a message shortens the list of swept values."""


@dataclass(frozen=True)
class Axis:
    """One swept parameter.

    Attributes
    ----------
    path
        Dotted parameter path, such as ``wall.roughness``.
    label
        Name of the dataset dimension.
    values
        What the parameter takes in turn, numbers or text, in the order of the file.
    """

    path: str
    label: str
    values: tuple[Any, ...]


def axes_of(tree: Mapping[Any, Any]) -> tuple[Axis, ...]:
    """Return the axes of a scenario file, which lists the values of each by its parameter's path.

    Raises
    ------
    ConfigError
        When a path names no single parameter, or its values are no list of different ones.
    """
    checked = {path: _axis_values(path, values) for path, values in tree.items()}
    return tuple(Axis(path, label, checked[path]) for path, label in labels_of(checked).items())


def labels_of(paths: Iterable[str]) -> dict[str, str]:
    """Return the dimensions that swept parameters become together, by their paths.

    Each is that of `label_of`, or the path itself with ``_`` for dots where several would share it.
    """
    labels = {path: label_of(path) for path in paths}
    shared = Counter(labels.values())
    return {
        path: label if shared[label] == 1 else path.replace(".", "_")
        for path, label in labels.items()
    }


def label_of(path: str) -> str:
    """Return the name of the dimension of a dataset that a parameter becomes when it is swept."""
    model, name = field_at(path)
    return str(extra(model.model_fields[name], "label") or name)


def _axis_values(path: object, values: object) -> tuple[Any, ...]:
    """Return an axis's values as the parameter tree holds them.

    Raises
    ------
    ConfigError
        When the path names no single parameter, or the values are no list of different ones.
    """
    if not isinstance(path, str):
        raise ConfigError(
            f"axes.{key_text(path)}",
            brief(values),
            "is given for a key that is not plain text",
            "name a parameter path, such as wall.roughness",
        )
    key = f"axes.{key_text(path)}"
    try:
        field_at(path, values)
    except ConfigError as error:
        raise relocated(error, key) from None
    if not isinstance(values, list) or not values:
        limit = "is an empty axis" if isinstance(values, list) else "is not a list"
        raise ConfigError(key, brief(values), limit, "list the values in brackets, such as [1, 2]")
    held: list[Any] = []
    for index, value in enumerate(values):
        try:
            one = check_value(path, value)
        except ConfigError as error:
            raise relocated(error, f"{key}[{index}]") from None
        if one is None or isinstance(one, tuple):
            raise ConfigError(
                f"{key}[{index}]",
                brief(value),
                "cannot label a dataset, which only a number or a word can",
                "leave it to base",
            )
        if one in held:
            raise ConfigError(
                f"{key}[{index}]",
                brief(value),
                f"is in the list already, at [{held.index(one)}]",
                "list each value once",
            )
        held.append(one)
    return tuple(held)


def combined(
    base: Mapping[str, Any], axes: tuple[Axis, ...], values: tuple[Any, ...]
) -> Parameters:
    """Return the parameters of one combination of the axes' values.

    Raises
    ------
    ConfigError
        With the key as the scenario file has it and the combination in brackets.
    """
    tree = dict(base)
    point = {axis.path: value for axis, value in zip(axes, values, strict=True)}
    for path, value in point.items():
        section, _, name = path.partition(".")
        tree[section] = {**dict(tree.get(section, {})), name: value} if name else value
    try:
        return Parameters.from_mapping(tree)
    except ConfigError as error:
        key = f"base.{error.key}"
        for axis in axes:
            if error.key == axis.path:
                key = f"axes.{axis.path}[{axis.values.index(point[axis.path])}]"
        combination = ", ".join(f"{path} = {brief(value)}" for path, value in point.items())
        if len(combination) > LONGEST_NOTE:
            combination = f"{combination[: LONGEST_NOTE - 3]}..."
        raise relocated(error, key, f"in the run with {combination}" if point else "") from None
