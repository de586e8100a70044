"""Parameters as files state them: trees of mappings, and the same by dotted paths."""

from collections.abc import Mapping
from typing import Any


def flat_tree(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the values of a tree of parameters by their dotted paths."""
    flat: dict[str, Any] = {}
    for key, value in tree.items():
        if isinstance(value, Mapping):
            flat |= flat_tree(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def nested_tree(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tree whose values by their dotted paths are given."""
    tree: dict[str, Any] = {}
    for path, value in flat.items():
        *groups, key = path.split(".")
        inside = tree
        for name in groups:
            inside = inside.setdefault(name, {})
        inside[key] = value
    return tree


def value_in(tree: Mapping[str, Any], path: str) -> Any:
    """Return what is at a dotted path of a tree, None where there is nothing."""
    value: Any = tree
    for key in path.split("."):
        value = value.get(key) if isinstance(value, Mapping) else None
    return value
