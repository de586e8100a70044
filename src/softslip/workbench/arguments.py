"""From the arguments of a call to a scenario of a single run."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from softslip.config.parameters import Parameters
from softslip.config.scenario import Scenario, load_scenario
from softslip.errors import ConfigError
from softslip.messages import brief
from softslip.provenance.catalogue.runs import label_paths, shared_leaves

NAME = "python"
"""Name of the scenario of a call that names none."""


def single_run(scenario: str | None, given: Mapping[str, Any]) -> Scenario:
    """Return a scenario that has one run.

    Parameters
    ----------
    scenario
        Name or path of a scenario that the run starts from: its base, and the first value of each
        axis. None starts from the defaults.
    given
        Values that replace those. Names are those of `softslip query`: labels of axes and last
        parts of paths (``stress``), dotted paths (``rheometer.stress``), and groups with a mapping
        (``rheometer={"stress": 0.3}``).

    Raises
    ------
    ConfigError
        Naming the key, its value, the limit and a remedy.
    """
    base = None if scenario is None else load_scenario(scenario)
    tree: dict[str, Any] = {} if base is None else dict(base.tree)
    for axis in () if base is None else base.axes:
        _put(tree, axis.path, axis.values[0])
    for path, value in _by_path(given).items():
        _put(tree, path, value)
    parameters = Parameters.from_mapping(tree)
    name = NAME if base is None else base.name
    file = Path(f"{NAME}.yaml") if base is None else base.file
    return Scenario(name, "A single run.", tree, parameters, (), file)


def _by_path(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by the paths of their parameters.

    Raises
    ------
    ConfigError
        When a name stands for several parameters, or a parameter is given twice.
    """
    found: dict[str, Any] = {}
    for name, value in given.items():
        for path, each in _paths(name, value):
            if path in found:
                limit = f"is given for {path}, which has a value already"
                raise ConfigError(name, brief(each), limit, "give each parameter once")
            found[path] = _plain(each)
    return found


def _paths(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        yield from ((f"{name}.{key}", each) for key, each in value.items())
        return
    shared = shared_leaves().get(name)
    if shared is not None:
        group, _, key = shared[0].rpartition(".")
        raise ConfigError(
            name,
            brief(value),
            f"is given for the last part of several parameters, {', '.join(shared)}",
            f"name the group, such as {group}={{{key!r}: {brief(value)}}}",
        )
    yield label_paths().get(name, name), value


def _plain(value: Any) -> Any:
    """Return numbers and arrays of NumPy as Python has them."""
    return value.tolist() if hasattr(value, "tolist") else value


def _put(tree: dict[str, Any], path: str, value: Any) -> None:
    """Set a value of a tree; what is no group stays for validation to refuse."""
    group, _, key = path.partition(".")
    held = tree.get(group, {})
    tree[group] = {**held, key: value} if key and isinstance(held, Mapping) else value
