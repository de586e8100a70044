import json
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from refusals import assert_refused, refused, tree

from softslip.config.fields import all_fields, extra, value_at
from softslip.config.parameters import Parameters, check_fields, check_value, field_at
from softslip.errors import ConfigError
from softslip.simulation.sample import particle_radii

FIELDS = all_fields(Parameters)


def test_nothing_given_means_the_defaults() -> None:
    assert Parameters.from_mapping({}) == Parameters()


def test_the_paper_gives_its_own_number_of_particles() -> None:
    count = len(particle_radii(Parameters()))
    assert count == 800, f"{count} particles, not the paper's 800"


@pytest.mark.parametrize("path", FIELDS)
def test_every_field_says_what_it_is(path: str) -> None:
    field = FIELDS[path]
    assert extra(field, "symbol"), f"{path} has no symbol"
    assert extra(field, "unit"), f"{path} has no unit"
    assert (field.description or "").endswith("."), f"{path}: {field.description!r}"


@pytest.mark.parametrize(
    "path", [path for path, field in FIELDS.items() if extra(field, "paper") is not None]
)
def test_the_papers_values_are_within_the_bounds(path: str) -> None:
    paper = extra(FIELDS[path], "paper")
    assert check_value(path, paper) == paper


def test_models_are_frozen() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Parameters().wall.roughness = 0.5  # type: ignore[misc]


REFUSALS = {
    "unknown key": (tree("wall.roughnes", 0.5), "wall.roughnes", "0.5", "'wall.roughness'"),
    "key of another group": (tree("stress", 0.3), "stress", "0.3", "'rheometer.stress'"),
    "unknown group": (tree("wal", {}), "wal", "{}", "did you mean 'wall'?"),
    "key inside a number": (
        tree("wall.roughness.b", 1),
        "wall.roughness",
        "{'b': 1}",
        "is not a number",
    ),
    "number for a group": (tree("wall", 3), "wall", "3", "its keys are roughness,"),
    "nothing for a group": (tree("wall", None), "wall", "null", "its keys are roughness,"),
    "quoted number": (
        tree("wall.roughness", "1e-3"),
        "wall.roughness",
        "'1e-3'",
        "without quotes: 1e-3",
    ),
    "truth value": (tree("wall.roughness", True), "wall.roughness", "true", "is not a number"),
    "list for a number": (tree("seed", [1]), "seed", "[1]", "is not a whole number"),
    "fraction": (
        tree("hydrodynamics.resolution", 4096.5),
        "hydrodynamics.resolution",
        "4096.5",
        "",
    ),
    "whole float": (
        tree("hydrodynamics.resolution", 4096.0),
        "hydrodynamics.resolution",
        "4096.0",
        "without a fraction: 4096",
    ),
    "below a bound": (tree("wall.roughness", -0.1), "wall.roughness", "-0.1", "use a value ≥ 0"),
    "above a bound": (
        tree("suspension.area_fraction", 1.2),
        "suspension.area_fraction",
        "1.2",
        "≤ 0.95, such as 0.84, as the paper",
    ),
    "not finite": (tree("steric.energy", math.inf), "steric.energy", "inf", "must be a finite"),
    "not a number": (tree("steric.energy", math.nan), "steric.energy", "nan", "must be a finite"),
    "too long an integer": (tree("seed", 16**9999), "seed", "an integer of 39997 bits", "≤ 2147"),
    "word of no choice": (
        tree("rheometer.mode", "no"),
        "rheometer.mode",
        "'no'",
        "'stress' or 'rate'; for example 'stress'",
    ),
    "number for a list": (tree("recording.snapshots", 3), "recording.snapshots", "3", "such as ["),
    "word in a list": (
        tree("recording.snapshots", [1, "x"]),
        "recording.snapshots[1]",
        "'x'",
        "such as [",
    ),
    "order of no stencil": (tree("membrane.order", 4), "membrane.order", "4", "2 or 6"),
    "level of no fidelity": (tree("fidelity", "exact"), "fidelity", "'exact'", "for example"),
    "tolerance of nothing": (
        tree("time_stepping.tolerance", 0.0),
        "time_stepping.tolerance",
        "0.0",
        "> 0, ≤ 0.1, such as 0.002",
    ),
    "contact points beyond counting": (
        tree("steric.refinement", 9),
        "steric.refinement",
        "9",
        "≥ 1, ≤ 8",
    ),
    "key that is a number": ({1: 2}, "[1]", "1", "config/README.md"),
    "key that is no text": (tree("wall", {"\ud800": 2}), "wall", "\\ud800", "config/README.md"),
    "key with a new line": (tree("a\nb", 2), "'a\\nb'", "2", "the keys at the top are"),
}


@pytest.mark.parametrize(("given_tree", "key", "value", "remedy"), REFUSALS.values(), ids=REFUSALS)
def test_a_bad_value_is_refused_with_key_value_limit_and_remedy(
    given_tree: dict[str, Any], key: str, value: str, remedy: str
) -> None:
    assert_refused(given_tree, key, value, remedy)


@given(st.recursive(st.none() | st.floats() | st.text() | st.binary() | st.integers(), st.lists))
@settings(max_examples=200, deadline=None)
def test_any_value_is_held_or_refused_in_a_short_line(value: object) -> None:
    for path in ("wall.roughness", "seed", "rheometer.mode", "recording.snapshots"):
        try:
            check_value(path, value)
        except ConfigError as error:
            message = str(error)
            assert len(message.splitlines()) == 1, message
            assert len(message) < 400, f"{len(message)} characters"
            assert message.isprintable(), ascii(message)


def test_a_value_that_contains_itself_is_refused_in_a_short_line() -> None:
    knot: list[Any] = []
    knot.extend([knot] * 1000)
    assert len(refused(tree("wall.roughness", knot))) < 400


def test_single_values_are_checked_without_the_others() -> None:
    check_fields({"rheometer": {"mode": "rate"}})
    with pytest.raises(ConfigError, match=r"^rheometer\.mode: 'speed' must be"):
        check_fields({"rheometer": {"mode": "speed"}})


@pytest.mark.parametrize("path", FIELDS)
def test_the_default_of_every_field_is_held_as_it_is(path: str) -> None:
    default = value_at(Parameters(), path)
    assert check_value(path, default) == default
    model, name = field_at(path)
    assert model.model_fields[name] is FIELDS[path]


@pytest.mark.parametrize(
    ("path", "remedy"),
    [
        ("wall", "such as wall.roughness"),
        ("wall.rough", "did you mean 'wall.roughness'?"),
        ("roughness", "did you mean 'wall.roughness'?"),
        ("seed.x", "did you mean 'seed'?"),
        ("", "the keys at the top are fidelity, accuracy, solvent"),
        ("wall..roughness", "did you mean 'wall.roughness'?"),
    ],
)
def test_a_path_that_names_no_parameter_is_refused(path: str, remedy: str) -> None:
    with pytest.raises(ConfigError) as caught:
        field_at(path)
    assert remedy in str(caught.value), str(caught.value)


def test_parameters_survive_json() -> None:
    parameters = Parameters.from_mapping({"recording": {"snapshots": [1, 2.5]}, "seed": 7})
    again = Parameters.from_mapping(json.loads(parameters.model_dump_json()))
    assert again == parameters
