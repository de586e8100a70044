"""Calls mean what the same words mean in a scenario."""

from pathlib import Path

import numpy as np
import pytest

from softslip.config.parameters import Parameters
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES, stage_ids
from softslip.errors import ConfigError
from softslip.workbench.arguments import single_run

SCENARIO = """
description: Two stresses at two walls.
base:
  fidelity: preview
  channel: {length: 0.125, height: 0.21875, outer_gap: 0.03125}
axes:
  wall.roughness: [0.59, 0.0]
  rheometer.stress: [0.2, 0.4]
"""


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    path = tmp_path / "four.yaml"
    path.write_text(SCENARIO)
    return str(path)


def test_a_call_without_arguments_is_the_defaults() -> None:
    assert single_run(None, {}).base == Parameters()


def test_a_parameter_can_be_named_by_its_last_part_its_path_or_its_group() -> None:
    calls = ({"stress": 0.1}, {"rheometer.stress": 0.1}, {"rheometer": {"stress": 0.1}})
    ids = {single_run(None, given).runs()[0].ids["shear"] for given in calls}
    assert ids == {stage_ids(Parameters.from_mapping({"rheometer": {"stress": 0.1}}))["shear"]}


def test_a_label_of_an_axis_is_a_name() -> None:
    given = {"wall_separation": 0.1875, "outer_gap": 0.03125}
    assert single_run(None, given).base.channel.height == 0.1875


def test_a_level_of_fidelity_fills_in_what_a_call_leaves_open() -> None:
    given = {"fidelity": "preview", "hydrodynamics": {"node_spacing": 5.0}}
    made = single_run(None, given).base
    assert made == Parameters.from_mapping(given)
    assert made.membrane.order == 6


def test_a_scenario_gives_its_base_and_the_first_value_of_each_axis(scenario: str) -> None:
    first = load_scenario(scenario).runs()[0]
    assert single_run(scenario, {}).runs()[0].ids == first.ids


def test_a_call_reaches_each_run_of_a_scenario(scenario: str) -> None:
    for run in load_scenario(scenario).runs():
        assert single_run(scenario, run.coordinates).runs()[0].ids == run.ids


def test_a_scenario_of_a_call_has_one_run_of_each_stage(scenario: str) -> None:
    meant = single_run(scenario, {"stress": 0.3})
    assert [len(meant.stage_table(stage)) for stage in STAGES] == [1, 1, 1, 1]


def test_numbers_of_numpy_are_numbers() -> None:
    given = {"stress": np.float64(0.1), "seed": np.int64(3), "snapshots": np.array([1.0, 2.0])}
    made = single_run(None, given).base
    assert (made.rheometer.stress, made.seed, made.recording.snapshots) == (0.1, 3, (1.0, 2.0))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"sterss": 0.1}, ["sterss", "0.1", "does not exist", "rheometer.stress"]),
        ({"stress": -1.0}, ["rheometer.stress", "-1.0", "greater than or equal to 0"]),
        ({"stress": "0.1"}, ["rheometer.stress", "is not a number", "without quotes"]),
        ({"rheometer": 3}, ["rheometer", "3", "must be a group of keys"]),
        ({"rheometer": {"sterss": 1.0}}, ["rheometer.sterss", "rheometer.stress"]),
        ({"area_fraction": 0.8}, ["area_fraction", "suspension.area_fraction", "packing"]),
        ({"shear_rate": 0.1}, ["rheometer"]),
        (
            {"stress": 0.1, "rheometer": {"stress": 0.2}},
            ["rheometer", "0.2", "rheometer.stress", "once"],
        ),
    ],
)
def test_what_cannot_be_run_is_refused_in_one_sentence(given: dict, said: list[str]) -> None:
    with pytest.raises(ConfigError) as refused:
        single_run(None, given)
    text = str(refused.value)
    assert "\n" not in text
    assert [word for word in said if word not in text] == [], text


def test_a_scenario_that_is_not_there_is_refused_with_those_that_are() -> None:
    with pytest.raises(ConfigError, match="is not in the folder"):
        single_run("dmeo", {})
