from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from refusals import CORRECTED, assert_refused, refused, tree

from softslip.config.parameters import Parameters

REFUSALS = {
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
        "'corrected' reaches further",
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
}


@pytest.mark.parametrize(("given_tree", "key", "value", "remedy"), REFUSALS.values(), ids=REFUSALS)
def test_values_that_contradict_each_other_are_refused_with_a_remedy(
    given_tree: dict[str, Any], key: str, value: str, remedy: str
) -> None:
    assert_refused(given_tree, key, value, remedy)


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
