import copy
from pathlib import Path
from typing import Any

import pytest

from softslip.config.fidelity import LEVELS, with_level
from softslip.config.fields import all_fields, value_at
from softslip.config.parameters import Parameters
from softslip.config.reading import read_mapping
from softslip.errors import ConfigError

CONFIG = Path(__file__).parents[2] / "config"

COSTS_MORE = {
    "hydrodynamics.node_spacing": -1,
    "time_stepping.tolerance": -1,
}
"""Settings that come with the cost of a level, and the sign of their change."""


def settings(level: str) -> dict[str, Any]:
    return {
        f"{group}.{key}": value
        for group in LEVELS[level]
        for key, value in LEVELS[level][group].items()
    }


def test_no_level_is_the_papers_scheme() -> None:
    """Each setting of a level exists, and its default is the paper's value where it has one."""
    for path in {path for level in LEVELS for path in settings(level)}:
        field = all_fields(Parameters)[path]
        paper = (field.json_schema_extra or {}).get("paper")  # type: ignore[union-attr]
        assert paper is None or field.default == paper, f"{path} is not the paper's by default"
    nothing = Parameters()
    assert nothing.fidelity is None
    assert Parameters.from_mapping({"fidelity": None}) == nothing
    assert nothing.hydrodynamics.mobility == "grid"
    assert nothing.time_stepping.integrator == "euler"
    assert (nothing.membrane.order, nothing.membrane.area_restoring) == (2, 0.0)
    assert nothing.steric.refinement == 1


@pytest.mark.parametrize("level", LEVELS)
def test_a_level_sets_its_settings_and_nothing_else(level: str) -> None:
    found, wanted = Parameters.from_mapping({"fidelity": level}), settings(level)
    assert found.fidelity == level
    for path in set(all_fields(Parameters)) - {"fidelity", "accuracy"}:
        assert value_at(found, path) == wanted.get(path, value_at(Parameters(), path)), path


@pytest.mark.parametrize("level", LEVELS)
def test_what_a_scenario_gives_overrides_its_level(level: str) -> None:
    tree = {
        "fidelity": level,
        "steric": {"refinement": 5, "energy": 2e-9},
        "hydrodynamics": {"node_spacing": 1.0},
        "time_stepping": {"tolerance": 3e-3},
    }
    before = copy.deepcopy(tree)
    found, wanted = Parameters.from_mapping(tree), settings(level)
    given = {
        "steric.refinement": 5,
        "steric.energy": 2e-9,
        "hydrodynamics.node_spacing": 1.0,
        "time_stepping.tolerance": 3e-3,
    }
    for path, value in {**wanted, **given}.items():
        assert value_at(found, path) == value, path
    assert tree == before, "the tree that was given has changed"


def test_an_override_back_to_the_default_counts() -> None:
    """A key that is given wins even where it says what holds without any level."""
    tree = {
        "fidelity": "converged",
        "hydrodynamics": {"regularisation": None},
        "membrane": {"order": 2},
    }
    found = Parameters.from_mapping(tree)
    assert found.hydrodynamics.regularisation is None
    assert found.membrane.order == 2
    assert found.membrane.area_restoring == LEVELS["converged"]["membrane"]["area_restoring"]


def test_a_resolved_tree_resolves_to_itself() -> None:
    for level in LEVELS:
        once = Parameters.from_mapping({"fidelity": level})
        assert Parameters.from_mapping(once.model_dump()) == once


@pytest.mark.parametrize("level", ["fine", "Paper", "", 3, True, ["paper"]])
def test_an_unknown_level_is_refused_in_one_line(level: object) -> None:
    with pytest.raises(ConfigError) as caught:
        Parameters.from_mapping({"fidelity": level})
    message = str(caught.value)
    assert message.splitlines() == [message]
    assert message.startswith("fidelity: ")
    assert all(repr(name) in message for name in LEVELS), message
    assert "; for example" in message


def test_a_group_that_is_no_mapping_is_left_for_validation() -> None:
    assert with_level({"fidelity": "paper", "steric": 3})["steric"] == 3
    with pytest.raises(ConfigError, match=r"^steric: 3 must be"):
        Parameters.from_mapping({"fidelity": "paper", "steric": 3})


def test_levels_come_coarsest_first() -> None:
    levels = [settings(level) for level in LEVELS]
    for path, sign in COSTS_MORE.items():
        values = [level[path] for level in levels]
        assert values == sorted(values, reverse=sign < 0), f"{path} does not go one way: {values}"
        assert values[0] != values[-1]


@pytest.mark.parametrize("level", LEVELS)
def test_contact_points_of_every_level_are_too_close_to_interlock(level: str) -> None:
    """At most 2.5 of the paper's mesh sizes apart, where false friction is 2e-3."""
    found = Parameters.from_mapping({"fidelity": level})
    spacing = found.hydrodynamics.node_spacing / found.hydrodynamics.resolution
    assert spacing / found.steric.refinement * 8192 <= 2.5


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("name", ["demo", "paper"])
def test_every_level_runs_in_the_box_of_every_scenario(name: str, level: str) -> None:
    base = read_mapping(CONFIG / f"{name}.yaml")["base"]
    boxed = {key: base[key] for key in ("channel", "suspension") if key in base}
    found = Parameters.from_mapping({**boxed, "fidelity": level})
    assert found.hydrodynamics.mobility == "ewald"
