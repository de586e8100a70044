"""The stages of a run and their identities.

A stage's identity is a hash of the parameters that it depends on and of its parent's identity,
so that runs which differ only in later stages share the earlier ones, and an axis added at the
value that was the base value changes no identity.
"""

import fnmatch
import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from operator import attrgetter
from typing import Any

from softslip.config.fields import all_fields, value_at
from softslip.config.parameters import Parameters
from softslip.errors import ConfigError

STAGES = ("packing", "expansion", "ageing", "shear")
"""The stages of a run, each the parent of the next."""

FLOWING = STAGES[2:]
"""Those with the solver: they can use several threads, and write checkpoints to resume from."""

DEPENDENCIES: Mapping[str, tuple[str, ...]] = {
    "packing": (
        "channel.length",
        "channel.height",
        "wall.roughness",
        "wall.bump_separation",
        "suspension.*",
        "packing.*",
        "seed",
    ),
    "expansion": (
        "expansion.*",
        "hydrodynamics.resolution",
        "hydrodynamics.node_spacing",
        "steric.length",
    ),
    "ageing": (
        "solvent.*",
        "channel.outer_gap",
        "channel.outside",
        "wall.stiffness",
        "membrane.*",
        "steric.*",
        "hydrodynamics.*",
        "time_stepping.integrator",
        "time_stepping.step",
        "time_stepping.tolerance",
        "time_stepping.longest_step",
        "time_stepping.ageing_time",
    ),
    # Ageing always runs the exact control at zero stress, so the rheometer comes in here.
    "shear": ("rheometer.*", "time_stepping.shear_time", "until.*", "recording.*"),
}
"""Parameters that each stage depends on besides those of its ancestors."""

LENGTH = ("time_stepping.shear_time", "until.error")
"""Parameters that only say how long a run is: two runs that differ in them have one trajectory."""

ID_DIGITS = 16
"""Hexadecimal digits of a stage's identity: 64 bits, safe from collisions for any sweep."""


def position(stage: str) -> int:
    """Return a stage's place in `STAGES`.

    Raises
    ------
    ConfigError
        When there is no such stage.
    """
    if stage not in STAGES:
        raise ConfigError("stage", stage, "does not exist", f"use one of {', '.join(STAGES)}")
    return STAGES.index(stage)


def _own_paths(stage: str) -> tuple[str, ...]:
    """Return the parameter paths that a stage's line of `DEPENDENCIES` names."""
    found: set[str] = set()
    for pattern in DEPENDENCIES[stage]:
        found |= set(fnmatch.filter(all_fields(Parameters), pattern))
    return tuple(sorted(found))


_OWN_PATHS = {stage: _own_paths(stage) for stage in STAGES}
_OWN_VALUES = {stage: attrgetter(*paths) for stage, paths in _OWN_PATHS.items()}


def stage_paths(stage: str) -> tuple[str, ...]:
    """Return every parameter path that a stage depends on, its ancestors' included, sorted.

    Raises
    ------
    ConfigError
        When there is no such stage.
    """
    upto = STAGES[: position(stage) + 1]
    return tuple(sorted({path for earlier in upto for path in _OWN_PATHS[earlier]}))


def stage_parameters(parameters: Parameters, stage: str) -> str:
    """Return the parameters that a stage depends on, as a JSON object with their groups.

    Two runs that share a stage differ in others, which the stage's result must not know.

    Raises
    ------
    ConfigError
        When there is no such stage.
    """
    tree: dict[str, Any] = {}
    for path in stage_paths(stage):
        *groups, key = path.split(".")
        group = tree
        for name in groups:
            group = group.setdefault(name, {})
        group[key] = _canonical(value_at(parameters, path))
    return json.dumps(tree, allow_nan=False)


def stage_ids(parameters: Parameters) -> dict[str, str]:
    """Return the identity of each stage of a run with these parameters.

    An identity is the beginning of the SHA-256 of canonical JSON: sorted keys, floats at full
    precision, with the parent's identity among the keys.
    """
    ids: dict[str, str] = {}
    parent: str | None = None
    for stage in STAGES:
        values = json.dumps(_OWN_VALUES[stage](parameters), allow_nan=False)
        parent = ids[stage] = _identity(stage, parent, values)
    return ids


def trajectory_id(parameters: Parameters) -> str:
    """Return the identity of a run's trajectory, that all runs share which differ in `LENGTH`."""
    values = dict(
        zip(_OWN_PATHS["shear"], _OWN_VALUES["shear"](parameters), strict=True)
    ) | dict.fromkeys(LENGTH)
    text = json.dumps(list(values.values()), allow_nan=False)
    return _identity("shear", stage_ids(parameters)["ageing"], text)


@lru_cache(maxsize=4096)
def _identity(stage: str, parent: str | None, values: str) -> str:
    """Return a stage's identity; the runs of a sweep share most of their earlier stages.

    The values are JSON, in which numbers that are written alike are alike.
    """
    held = {
        path: _canonical(value)
        for path, value in zip(_OWN_PATHS[stage], json.loads(values), strict=True)
    }
    content = {"stage": stage, "parent": parent, "parameters": held}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("ascii")).hexdigest()[:ID_DIGITS]


def _canonical(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_canonical(item) for item in value]
    return value + 0.0 if isinstance(value, float) else value  # Makes -0.0 the same as 0.0.
