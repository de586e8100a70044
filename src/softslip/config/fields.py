"""Fields of the parameter models: how they are declared, found by path, and refused.

Nothing here knows any particular parameter; every function is given the root of a tree of
pydantic models.
"""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from softslip.errors import ConfigError
from softslip.messages import NOTHING, brief, key_text


def quantity(
    default: Any,
    *,
    symbol: str,
    unit: str,
    description: str,
    paper: Any = None,
    label: str | None = None,
    **bounds: Any,
) -> Any:
    """Return a model field that carries its symbol, unit and the paper's value.

    Parameters
    ----------
    default
        Value where the scenario is silent.
    symbol, unit, description
        How the quantity is written, measured and explained; ``unit`` is "1" for a pure number.
    paper
        The paper's value, where it gives one.
    label
        Name of the dataset dimension when the quantity is swept; the key's own name otherwise.
    **bounds
        ``gt``, ``ge``, ``lt``, ``le`` as pydantic understands them.
    """
    extra = {"symbol": symbol, "unit": unit, "paper": paper, "label": label}
    return Field(
        default,
        description=description,
        json_schema_extra={key: value for key, value in extra.items() if value is not None},
        **bounds,
    )


def group(field: FieldInfo) -> type[BaseModel] | None:
    """Return the model of a field that is a group of fields, and None for any other field."""
    annotation = field.annotation
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return None


def extra(field: FieldInfo, key: str) -> Any:
    """Return what `quantity` says of a field: its symbol, unit, paper or label."""
    return field.json_schema_extra.get(key) if isinstance(field.json_schema_extra, dict) else None


def all_fields(root: type[BaseModel], prefix: str = "") -> dict[str, FieldInfo]:
    """Return every field that is not a group under its dotted path, in order of declaration."""
    found: dict[str, FieldInfo] = {}
    for name, field in root.model_fields.items():
        inside = group(field)
        if inside is None:
            found[prefix + name] = field
        else:
            found.update(all_fields(inside, f"{prefix}{name}."))
    return found


def value_at(tree: BaseModel, path: str) -> Any:
    """Return the value at a dotted path that is known to exist."""
    value: Any = tree
    for name in path.split("."):
        value = getattr(value, name)
    return value


def _innermost(root: type[BaseModel], sections: Sequence[str]) -> tuple[type[BaseModel], list[str]]:
    """Follow the names of groups as far as there are such; return the last and their names."""
    model, entered = root, list[str]()
    for section in sections:
        field = model.model_fields.get(section)
        inside = field and group(field)
        if inside is None:
            break
        model = inside
        entered.append(section)
    return model, entered


def owner(root: type[BaseModel], path: str, value: object = NOTHING) -> tuple[type[BaseModel], str]:
    """Return the model and the name of the field that a dotted path names.

    Parameters
    ----------
    root
        Model that the path starts from.
    path
        Such as ``wall.roughness``.
    value
        What the error message shows as the value given for the path.

    Raises
    ------
    ConfigError
        When there is no such field, or when it is a group of fields.
    """
    *sections, name = path.split(".")
    model, entered = _innermost(root, sections)
    if entered != sections or name not in model.model_fields:
        raise unknown(root, path, value)
    inside = group(model.model_fields[name])
    if inside is not None:
        first = next(iter(inside.model_fields))
        raise ConfigError(
            path,
            brief(value),
            "is given for a group of keys, not for one",
            f"name a key inside it, such as {path}.{first}",
        )
    return model, name


def unknown(root: type[BaseModel], path: str, value: object) -> ConfigError:
    """Return the error about a path that does not exist, with the nearest one that does."""
    model, entered = _innermost(root, path.split(".")[:-1])
    known = list(all_fields(root))
    leaf = path.rpartition(".")[2]
    by_leaf = {name.rpartition(".")[2]: name for name in reversed(known)}
    near = difflib.get_close_matches(path, known, n=1, cutoff=0.75)
    near = near or [by_leaf[name] for name in difflib.get_close_matches(leaf, by_leaf, n=1)]
    near = near or difflib.get_close_matches(path, root.model_fields, n=1)
    place = f"of {'.'.join(entered)}" if entered else "at the top"
    return ConfigError(
        key_text(path),
        brief(value),
        "is given for a key that does not exist",
        f"did you mean '{near[0]}'?"
        if near
        else f"the keys {place} are {', '.join(model.model_fields)}",
    )


def path_of(location: Iterable[int | str]) -> str:
    """Return a dotted path with indices in brackets, such as ``recording.snapshots[1]``."""
    path = ""
    for part in location:
        path += f"[{part}]" if isinstance(part, int) else f".{part}"
    return path.removeprefix(".")


def refusal(root: type[BaseModel], detail: ErrorDetails) -> ConfigError:
    """Turn one of pydantic's errors about a tree into one sentence."""
    location, kind, value = detail["loc"], detail["type"], detail["input"]
    if kind == "extra_forbidden":
        return unknown(root, path_of(location), value)
    if kind in {"invalid_key", "string_unicode"}:
        return ConfigError(
            key_text(path_of(location)) or "top",
            brief(value),
            "is given for a key that is not plain text",
            "see config/README.md for the keys",
        )
    path = path_of(part for part in location if isinstance(part, str))
    if kind == "model_type":
        model, _ = _innermost(root, path.split("."))
        names = ", ".join(model.model_fields)
        limit, remedy = "must be a group of keys", f"its keys are {names}"
    else:
        field = all_fields(root)[path]
        limit, remedy = _limit(detail), _remedy(field, kind, value)
    return ConfigError(path_of(location) or "top", brief(value), limit, remedy)


def _limit(detail: ErrorDetails) -> str:
    wording = {
        "float_type": "is not a number",
        "int_type": "is not a whole number",
        "tuple_type": "is not a list",
        "finite_number": "must be a finite number",
    }
    said = detail["msg"].removeprefix("Input ").replace("should ", "must ")
    return wording.get(detail["type"], said)


def bounds(field: FieldInfo) -> str:
    """Return the values that a field accepts, such as "> 0, ≤ 3", or an empty text."""
    signs: Mapping[str, str] = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
    parts = [
        f"{sign} {getattr(rule, name)!r}"
        for rule in field.metadata
        for name, sign in signs.items()
        if getattr(rule, name, None) is not None
    ]
    choices = [repr(choice) for choice in _choices(field.annotation)]
    return ", ".join(parts) or " or ".join(choices)


def _choices(annotation: Any) -> list[str | int]:
    """Return the values of a Literal, also where null is another choice."""
    found: list[str | int] = []
    for choice in get_args(annotation):
        found += [choice] if isinstance(choice, str | int) else _choices(choice)
    return found


def _remedy(field: FieldInfo, kind: str, value: object) -> str:
    if kind in {"float_type", "int_type"} and isinstance(value, str) and _is_number(value):
        return f"write it without quotes: {value.strip()}"
    if kind == "int_type" and isinstance(value, float) and value.is_integer():
        return f"write it without a fraction: {value:.0f}"
    if isinstance(field.default, tuple):
        return "write a list of numbers, such as [1.0, 2.5]"
    paper = extra(field, "paper")
    example, source = (field.default, "the default") if paper is None else (paper, "as the paper")
    if kind == "literal_error":
        return f"for example {brief(example)}, {source}"
    # A full stop ends the first sentence only before a capital: not in "Eq. 25".
    described = re.split(r"\. (?=[A-Z])", field.description or "")[0].rstrip(".")
    allowed = bounds(field)
    advice = f"use a value {allowed}, such as" if allowed else "for example"
    return f"{advice} {brief(example)}, {source} ({described})"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
