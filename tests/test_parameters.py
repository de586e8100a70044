import json
import math
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from softslip.errors import ConfigError
from softslip.fields import all_fields, extra, value_at
from softslip.geometry import particle_radii
from softslip.parameters import (
    SPLIT_OVER_REGULARISATION,
    SPLIT_OVER_SPACING,
    Parameters,
    check_fields,
    check_value,
    field_at,
    split_length,
)

FIELDS = all_fields(Parameters)


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


CORRECTED = {"mobility": "ewald", "quadrature": "corrected"}

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
    "time outside the run": (
        tree("recording.snapshots", [1, 2000]),
        "recording.snapshots[1]",
        "2000.0",
        "0 to 1000",
    ),
    "times out of order": (
        tree("recording.snapshots", [2, 2]),
        "recording.snapshots[1]",
        "2.0",
        "in increasing order",
    ),
    "bump larger than the channel": (
        {"wall": {"roughness": 3}, "channel": {"length": 0.046875}},
        "wall.roughness",
        "3.0",
        "use less than 2.77",
    ),
    "bump that the mesh cannot see": (
        tree("wall.roughness", 1e-3),
        "wall.roughness",
        "0.001",
        "use 0 for a smooth wall, or at least 0.007215",
    ),
    "bumps that overlap": (
        {"wall": {"roughness": 2, "bump_separation": 2}, "channel": {"length": 0.0625}},
        "wall.bump_separation",
        "2.0",
        "use a value well above 2",
    ),
    "area fraction that cannot fit": (
        {
            "wall": {"roughness": 2},
            "channel": {"height": 0.1171875, "outer_gap": 0.0234375},
            "suspension": {"area_fraction": 0.9},
        },
        "suspension.area_fraction",
        "0.9",
        "use at most 0.8",
    ),
    "no bulk": (tree("channel.height", 0.08), "channel.height", "0.08", "at least 0.08497"),
    "length off the mesh": (
        tree("channel.length", 0.3),
        "channel.length",
        "0.3",
        "the nearest value that fits is 0.300048828125",
    ),
    "gap off the mesh": (
        tree("channel.outer_gap", 0.56001),
        "channel.outer_gap",
        "0.56001",
        "the nearest value that fits is 0.56",
    ),
    "gap that rounds to nothing": (
        tree("channel.outer_gap", 1e-9),
        "channel.outer_gap",
        "1e-09",
        "the nearest value that fits is 6.347",
    ),
    "particles wider than the channel": (
        {"suspension": {"mean_radius": 0.25}, "recording": {"bulk_margin": None}},
        "suspension.mean_radius",
        "0.25",
        "use a smaller radius",
    ),
    "particles longer than the period": (
        {"suspension": {"mean_radius": 0.025}, "channel": {"length": 0.0546875}},
        "suspension.mean_radius",
        "0.025",
        "wider than the channel.length",
    ),
    "less than one particle": (
        tree("suspension.area_fraction", 1e-6),
        "suspension.mean_radius",
        "0.00846",
        "suspension.area_fraction 0",
    ),
    "too many particles": (
        tree("suspension.mean_radius", 1e-5),
        "suspension.mean_radius",
        "1e-05",
        "use another radius",
    ),
    "no stress": (tree("rheometer.stress", None), "rheometer.stress", "null", "give rheometer.str"),
    "stress and rate": (tree("rheometer.shear_rate", 1), "rheometer.shear_rate", "1.0", "to null"),
    "no rate": (
        {"rheometer": {"mode": "rate", "stress": None}},
        "rheometer.shear_rate",
        "null",
        "give rheometer.shear_rate",
    ),
    "printed control of a rate": (
        {"rheometer": {"mode": "rate", "stress": None, "shear_rate": 1, "control": "printed"}},
        "rheometer.control",
        "'printed'",
        "use 'exact'",
    ),
    "shorter than a step": (
        tree("time_stepping.shear_time", 1e-3),
        "time_stepping.shear_time",
        "0.001",
        "a smaller time_stepping.step",
    ),
    "too many steps": (
        tree("time_stepping.ageing_time", 1e300),
        "time_stepping.ageing_time",
        "1e+300",
        "a shorter ageing_time",
    ),
    "corrected sum on the mesh": (
        tree("hydrodynamics.quadrature", "corrected"),
        "hydrodynamics.quadrature",
        "corrected",
        "use mobility 'ewald'",
    ),
    "regularisation of the mesh": (
        tree("hydrodynamics.regularisation", 0.5),
        "hydrodynamics.regularisation",
        "0.5",
        "use mobility 'ewald'",
    ),
    "nodes that leak on the mesh": (
        tree("hydrodynamics.node_spacing", 4.01),
        "hydrodynamics.node_spacing",
        "4.01 is more than 4,",
        "use a smaller spacing",
    ),
    "nodes too far apart for the plain sum": (
        {"hydrodynamics": {"mobility": "ewald", "regularisation": 0.5, "node_spacing": 1.3}},
        "hydrodynamics.node_spacing",
        "1.3 is more than 1.25,",
        "'corrected' goes on",
    ),
    "nodes too far apart for the corrected sum": (
        {"hydrodynamics": {**CORRECTED, "regularisation": 0.05, "node_spacing": 5.1}},
        "hydrodynamics.node_spacing",
        "5.1 is more than 5,",
        "use a smaller spacing",
    ),
    "nodes farther apart than contacts reach": (
        {"hydrodynamics": {**CORRECTED, "node_spacing": 6.31}},
        "hydrodynamics.node_spacing",
        "6.31 is more than 6.3, 0.7 steric.length",
        "use a smaller spacing",
    ),
    "split beyond the gap": (
        {"hydrodynamics": {"mobility": "ewald", "split": 43.0}},
        "hydrodynamics.split",
        "43.0 makes the near sum reach 0.02887, beyond 0.02875",
        "use a split of at most 42.82",
    ),
    "split that is chosen beyond the gap": (
        {
            "hydrodynamics": {**CORRECTED, "node_spacing": 6.0},
            "channel": {"length": 0.0625, "height": 0.1240234375, "outer_gap": 0.0009765625},
        },
        "hydrodynamics.split",
        "null makes the split 1.455, below 1.5",
        "a channel.outer_gap with room",
    ),
    "split below the regularisation": (
        {"hydrodynamics": {"mobility": "ewald", "regularisation": 2.0, "split": 2.9}},
        "hydrodynamics.split",
        "2.9 makes the split 2.9, below 3,",
        "use null",
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
    message = refused(given_tree)
    assert message.startswith(f"{key}: "), f"{key} is not in front of {message!r}"
    what, _, how = message.removeprefix(f"{key}: ").partition("; ")
    assert value in what, f"{value} is not in {what!r}"
    assert how, f"no remedy in {message!r}"
    assert remedy in message, f"{remedy!r} is not in {message!r}"


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


@pytest.mark.parametrize("path", ["channel.length", "channel.outer_gap"])
@given(value=st.floats(0.01, 0.7), resolution=st.integers(256, 16384))
@settings(max_examples=100, deadline=None)
def test_the_size_that_is_suggested_fits_the_mesh(path: str, value: float, resolution: int) -> None:
    def with_size(size: float) -> dict[str, Any]:
        return {
            "channel": {"length": 1.0, "height": 0.44, "outer_gap": 0.56, path[8:]: size},
            "hydrodynamics": {"resolution": resolution},
            "suspension": {"area_fraction": 0},
        }

    total = value + (0.44 if path == "channel.outer_gap" else 0.0)
    assume(abs(total * resolution - round(total * resolution)) > 1e-5)
    message = refused(with_size(value))
    assert message.startswith(path), message
    Parameters.from_mapping(with_size(float(message.rpartition(" ")[2])))


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
        ("", "the keys at the top are fidelity, solvent"),
        ("wall..roughness", "did you mean 'wall.roughness'?"),
    ],
)
def test_a_path_that_names_no_parameter_is_refused(path: str, remedy: str) -> None:
    with pytest.raises(ConfigError) as caught:
        field_at(path)
    assert remedy in str(caught.value), str(caught.value)


@pytest.mark.parametrize(
    "hydrodynamics",
    [
        {"node_spacing": 4.0},
        {"mobility": "ewald", "node_spacing": 2.5},
        {"mobility": "ewald", "node_spacing": 1.25, "regularisation": 0.5},
        {**CORRECTED, "node_spacing": 6.3},
        {**CORRECTED, "node_spacing": 5.0, "regularisation": 0.05},
        {"mobility": "ewald", "split": 1.5},
        {"mobility": "ewald", "split": 42.81},
        {"mobility": "grid", "split": 64.0},
    ],
)
def test_values_at_their_limits_are_held(hydrodynamics: dict[str, Any]) -> None:
    held = Parameters.from_mapping({"hydrodynamics": hydrodynamics})
    for name, value in hydrodynamics.items():
        assert getattr(held.hydrodynamics, name) == value


def test_contacts_do_not_limit_the_nodes_of_a_channel_without_particles() -> None:
    given_tree = {"hydrodynamics": {**CORRECTED, "node_spacing": 12.0}}
    refused(given_tree)
    empty = {**given_tree, "suspension": {"area_fraction": 0.0}}
    assert Parameters.from_mapping(empty).hydrodynamics.node_spacing == 12.0


@pytest.mark.parametrize(
    ("hydrodynamics", "wanted"),
    [
        ({"split": 6.0}, 6.0),
        ({"node_spacing": 5.0, "quadrature": "corrected"}, SPLIT_OVER_SPACING * 5),
        ({"node_spacing": 0.5}, SPLIT_OVER_REGULARISATION),
        ({"node_spacing": 0.5, "regularisation": 2.0}, SPLIT_OVER_REGULARISATION * 2),
    ],
)
def test_a_split_is_chosen_where_none_is_given(
    hydrodynamics: dict[str, Any], wanted: float
) -> None:
    held = Parameters.from_mapping({"hydrodynamics": {"mobility": "ewald", **hydrodynamics}})
    assert split_length(held) * held.hydrodynamics.resolution == pytest.approx(wanted, rel=1e-14)


def test_parameters_survive_json() -> None:
    parameters = Parameters.from_mapping({"recording": {"snapshots": [1, 2.5]}, "seed": 7})
    again = Parameters.from_mapping(json.loads(parameters.model_dump_json()))
    assert again == parameters
