from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softslip.config.scenario import Scenario, load_scenario
from softslip.config.stages import STAGES
from softslip.config.sweep_order import halvings, priorities

SWEEP = """\
description: A sweep.
base: {fidelity: preview}
axes:
  seed: [1, 2, 3]
  wall.roughness: [0.0, 0.3, 0.59]
  rheometer.stress: [0.05, 0.1, 0.2, 0.3, 0.5]
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    (tmp_path / "sweep.yaml").write_text(SWEEP)
    return load_scenario(str(tmp_path / "sweep.yaml"))


def in_order(scenario: Scenario) -> list[tuple[int, float, float]]:
    """Return seed, roughness and stress of all runs as they are worked on."""
    rank = priorities(scenario)["shear"]
    runs = sorted(scenario.runs(), key=lambda run: -rank[run.ids["shear"]])
    names = ("seed", "roughness", "stress")
    return [tuple(run.coordinates[name] for name in names) for run in runs]


def test_a_sample_of_each_condition_is_done_before_the_second_of_any(scenario: Scenario) -> None:
    seeds = [seed for seed, _, _ in in_order(scenario)]
    assert seeds == [1] * 15 + [2] * 15 + [3] * 15


def test_ends_of_the_axes_come_first_and_then_what_lies_between(scenario: Scenario) -> None:
    conditions = [condition[1:] for condition in in_order(scenario)[:15]]
    assert set(conditions[:4]) == {(0.0, 0.05), (0.0, 0.5), (0.59, 0.05), (0.59, 0.5)}
    assert set(conditions[:9]) == {(b, s) for b in (0.0, 0.3, 0.59) for s in (0.05, 0.2, 0.5)}


def test_early_stages_have_the_priority_of_the_first_run_that_needs_them(
    scenario: Scenario,
) -> None:
    found = priorities(scenario)
    for stage in STAGES:
        assert set(found[stage]) == set(scenario.stage_table(stage))
        for run in scenario.runs():
            assert found[stage][run.ids[stage]] >= found["shear"][run.ids["shear"]] >= 1


@given(st.integers(1, 200))
def test_halving_reaches_every_value_once(length: int) -> None:
    levels = [halvings(index, length) for index in range(length)]
    assert levels[0] == levels[-1] == 0
    for level in range(1, max(levels) + 1):
        coarser = [index for index in range(length) if levels[index] < level]
        between = [index for index in range(length) if levels[index] == level]
        gaps = [sum(low < index for low in coarser) for index in between]
        assert len(set(gaps)) == len(gaps), "two new values between the same two"
    assert max(levels) <= length.bit_length()


def test_one_run_has_a_priority(tmp_path: Path) -> None:
    (tmp_path / "one.yaml").write_text("description: One.\nbase: {fidelity: preview}\n")
    found = priorities(load_scenario(str(tmp_path / "one.yaml")))
    assert [set(table.values()) for table in found.values()] == [{1}] * len(STAGES)
