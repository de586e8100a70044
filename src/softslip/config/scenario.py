"""Scenario files: base parameters and axes over them, expanded into runs with stable identities."""

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

from softslip.config.parameters import Parameters, check_fields
from softslip.config.reading import in_file, read_mapping, relocated
from softslip.config.stages import STAGES, position, stage_ids
from softslip.config.sweep import Axis, axes_of, combined
from softslip.errors import ConfigError
from softslip.messages import brief, key_text

MOST_RUNS = 10_000
"""More runs than this are taken for a typo in an axis; each command checks them all,
which takes some seconds for so many."""

FOLDER = Path("config")
"""Folder of the named scenarios, below the current directory."""

SETTINGS = "config"
"""Name of the one file in the folder that is no scenario: the workflow's settings, where
Snakemake's tools look for them."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


@dataclass(frozen=True)
class SweepPoint:
    """One point of a sweep.

    Attributes
    ----------
    parameters
        Everything that determines the run.
    coordinates
        The value of each axis, under the axis's label.
    ids
        The identity of each of the run's stages.
    """

    parameters: Parameters
    coordinates: Mapping[str, Any]
    ids: Mapping[str, str]


@dataclass(frozen=True)
class StageRun:
    """One stage of one or more runs.

    Attributes
    ----------
    stage, id
        Which stage it is and its identity.
    parameters
        Those of the first run that needs it; `stages.stage_paths` says which of them it depends on.
    parent
        Identity of the stage before, None for a packing.
    """

    stage: str
    id: str
    parameters: Parameters
    parent: str | None

    @classmethod
    def of(cls, stage: str, parameters: Parameters, ids: Mapping[str, str]) -> "StageRun":
        """Return a stage of the run with these parameters, whose stages have these identities."""
        place = position(stage)
        parent = ids[STAGES[place - 1]] if place else None
        return cls(stage, ids[stage], parameters, parent)


@dataclass(frozen=True)
class Scenario:
    """Base parameters and the axes over them.

    Attributes
    ----------
    name
        The file's name without its suffix.
    description
        One sentence.
    tree
        The file's base as it stands, so that each run's fidelity can fill what it leaves out.
    base
        Parameters of the first run: the file's base, with each axis at its first value.
    axes
        In the order of the file; the last one varies fastest.
    file
        The file itself, as it was opened.
    """

    name: str
    description: str
    tree: Mapping[str, Any]
    base: Parameters
    axes: tuple[Axis, ...]
    file: Path = field(compare=False)

    def runs(self) -> tuple[SweepPoint, ...]:
        """Return the run of every combination of the axes' values.

        Raises
        ------
        ConfigError
            When the values of a combination contradict each other; `load_scenario` has seen to
            it that none of its scenarios does that.
        """
        return self._runs

    @cached_property
    def _runs(self) -> tuple[SweepPoint, ...]:
        return tuple(self._expand())

    def _expand(self) -> Iterator[SweepPoint]:
        for values in product(*(axis.values for axis in self.axes)):
            parameters = combined(self.tree, self.axes, values)
            coordinates = {axis.label: value for axis, value in zip(self.axes, values, strict=True)}
            yield SweepPoint(parameters, coordinates, stage_ids(parameters))

    def as_json(self) -> str:
        """Return all that the scenario's datasets depend on, as a JSON object."""
        axes = {axis.path: axis.values for axis in self.axes}
        return json.dumps({"base": self.base.model_dump(), "axes": axes}, allow_nan=False)

    def stage_table(self, stage: str) -> Mapping[str, StageRun]:
        """Return the distinct runs of a stage by their identity, in the order of `runs`.

        Raises
        ------
        ConfigError
            When there is no such stage.
        """
        return self._tables[position(stage)]

    @cached_property
    def _tables(self) -> tuple[Mapping[str, StageRun], ...]:
        tables: tuple[dict[str, StageRun], ...] = tuple({} for _ in STAGES)
        for run in self.runs():
            for stage, table in zip(STAGES, tables, strict=True):
                if run.ids[stage] not in table:
                    table[run.ids[stage]] = StageRun.of(stage, run.parameters, run.ids)
        return tables


def load_scenario(name_or_path: str) -> Scenario:
    """Read a scenario and check every one of its runs.

    Parameters
    ----------
    name_or_path
        The path of a file ending in ``.yaml``, or the name of one in the folder ``config``
        below the current directory, without its suffix.

    Raises
    ------
    ConfigError
        In one line with the file's name, the key path within it, the value, the limit and a
        remedy, when the file cannot be read or one of its runs cannot be run.
    """
    path = _scenario_path(name_or_path)
    tree = read_mapping(path)
    try:
        return _scenario(path, tree)
    except ConfigError as error:
        raise in_file(path, error) from None


def scenario_names(beginning: str = "") -> list[str]:
    """Return the names of the scenarios in the folder, those that begin so, in order."""
    names = (file.stem for file in FOLDER.glob("*.yaml"))
    return sorted(name for name in names if name != SETTINGS and name.startswith(beginning))


def _scenario_path(name_or_path: str) -> Path:
    path = Path(name_or_path)
    named = path.suffix != ".yaml"
    if not _NAME.fullmatch(name_or_path if named else path.stem):
        raise ConfigError(
            "scenario",
            brief(name_or_path),
            "is not a scenario's name, at most 64 letters, digits, - and _ (with .yaml for a path)",
            "rename the file, or give a name such as demo",
        )
    if not named:
        return path
    path = FOLDER / f"{name_or_path}.yaml"
    if name_or_path == SETTINGS or not path.exists():
        limit = f"is not in the folder {FOLDER} of the current directory"
        if path.exists():
            limit = "is the file of the workflow's settings, not of a scenario"
        names = scenario_names()
        elsewhere = "change to the project's folder, or write one with: softslip init DIR"
        remedy = f"use one of {', '.join(names)}" if names else elsewhere
        raise ConfigError("scenario", name_or_path, limit, remedy)
    return path


def _scenario(file: Path, tree: Mapping[Any, Any]) -> Scenario:
    for key, value in tree.items():
        if key not in ("description", "base", "axes"):
            raise ConfigError(
                key_text(key),
                brief(value),
                "is given for a key that does not exist",
                "the keys at the top are description, base and axes",
            )
    description = tree.get("description")
    if not isinstance(description, str) or not description.strip():
        raise ConfigError(
            "description", brief(description), "is not a sentence", "say what the scenario is for"
        )
    sentence = " ".join(description.split())
    if not sentence.isprintable():
        limit, remedy = "has characters that cannot be printed", "write plain text"
        raise ConfigError("description", brief(description), limit, remedy)
    base = _mapping(tree, "base")
    try:
        check_fields(base)
    except ConfigError as error:
        raise relocated(error, f"base.{error.key}") from None
    axes = axes_of(_mapping(tree, "axes"))
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_RUNS:
        raise ConfigError(
            "axes", count, f"runs are more than {MOST_RUNS}", "shorten an axis or leave one out"
        )
    first = combined(base, axes, tuple(axis.values[0] for axis in axes))
    scenario = Scenario(file.stem, sentence, base, first, axes, file)
    scenario.runs()
    return scenario


def _mapping(tree: Mapping[Any, Any], key: str) -> dict[Any, Any]:
    """Return what stands under a key at the top, where nothing means an empty mapping."""
    value = tree.get(key)
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise ConfigError(
            key, brief(value), "is not a mapping", "write 'key: value' lines under it"
        )
    return value
