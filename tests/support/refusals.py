"""Trees of parameters that are refused, and what their messages must say."""

from typing import Any

import pytest

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError

CORRECTED = {"mobility": "ewald", "quadrature": "corrected"}


def tree(path: str, value: object) -> dict[str, Any]:
    nested: Any = value
    for name in reversed(path.split(".")):
        nested = {name: nested}
    return dict(nested)


def refused(given_tree: dict[str, Any]) -> str:
    with pytest.raises(ConfigError) as caught:
        Parameters.from_mapping(given_tree)
    message = str(caught.value)
    assert message.splitlines() == [message], f"not one line: {message!r}"
    assert message.startswith(caught.value.key), f"{message!r} does not start with its key"
    return message


def assert_refused(given_tree: dict[str, Any], key: str, value: str, remedy: str) -> None:
    message = refused(given_tree)
    assert message.startswith(f"{key}: "), f"{key} is not in front of {message!r}"
    what, _, how = message.removeprefix(f"{key}: ").partition("; ")
    assert value in what, f"{value} is not in {what!r}"
    assert how, f"no remedy in {message!r}"
    assert remedy in message, f"{remedy!r} is not in {message!r}"
