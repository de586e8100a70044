"""What a batch system is asked for fits what runs take, and what their checkpoints say is left."""

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from plans_synthetic import leave
from projects import ROOT
from runs_synthetic import Work

from softslip.config.parameters import Parameters
from softslip.config.scenario import Scenario
from softslip.config.stages import FLOWING, STAGES
from softslip.operations.costs import shipped
from softslip.operations.job_requests import (
    LEAST,
    MARGIN,
    MEMORY_STEP,
    SLACK,
    STARTING,
    STOPPING,
    JobRequests,
    stage_memory,
)

HOUR = 3600.0


def first(scenario: Scenario, stage: str) -> str:
    return next(iter(scenario.stage_table(stage)))


class Fixed(JobRequests):
    """Requests for runs of which so many seconds are left."""

    left = 0.0

    def __init__(self, left: float, longest: float = math.inf) -> None:
        self.left, self._longest = left, longest

    def seconds_left(self, stage: str, run: str) -> float:
        return self.left


@given(st.floats(0.0, 1e7), st.sampled_from(STAGES))
def test_a_run_that_takes_as_long_as_estimated_has_its_time(left: float, stage: str) -> None:
    seconds = 60 * Fixed(left).minutes(stage, "run")
    assert STARTING + left <= seconds
    if stage in FLOWING:
        assert seconds <= STARTING + MARGIN * left + STOPPING + 60
    else:
        assert seconds <= max(LEAST, STARTING + MARGIN * left + 60)


@given(st.floats(HOUR, 1e7), st.floats(1 / MARGIN, MARGIN), st.sampled_from(FLOWING))
def test_time_is_at_most_half_as_much_again_if_estimates_are_right_within_the_margin(
    used: float, error: float, stage: str
) -> None:
    requested = 60 * Fixed(used * error).minutes(stage, "run")
    assert used <= requested <= SLACK * used + STARTING + STOPPING + 60


@given(st.floats(0.0, 1e7), st.integers(2, 10_000), st.sampled_from(STAGES), st.integers(1, 4))
def test_no_job_is_asked_to_exceed_the_longest(
    left: float, longest: int, stage: str, attempt: int
) -> None:
    limit = Fixed(left, longest).minutes(stage, "run", attempt)
    assert limit == min(Fixed(left).minutes(stage, "run", attempt), longest)


def test_without_results_estimates_are_those_of_plans(scenario: Scenario, work: Work) -> None:
    requests = JobRequests(scenario, work.results)
    for stage in STAGES:
        run = first(scenario, stage)
        expected = shipped().estimate(stage, scenario.stage_table(stage)[run].parameters)
        assert requests.seconds_left(stage, run) == expected.core_seconds
    assert not work.results.exists(), "looking must make nothing"


def test_finished_runs_correct_the_estimate(scenario: Scenario, work: Work) -> None:
    done, other = list(scenario.stage_table("shear"))[:2]
    table = scenario.stage_table("shear")
    estimates = {
        run: shipped().estimate("shear", table[run].parameters).core_seconds
        for run in (done, other)
    }
    leave(work.results, "shear", done, seconds=3 * estimates[done])
    left = JobRequests(scenario, work.results).seconds_left("shear", other)
    assert left == pytest.approx(3 * estimates[other])
    uncorrected = JobRequests(scenario, work.results, corrected=False)
    assert uncorrected.seconds_left("shear", other) == estimates[other]


def test_an_interrupted_run_asks_for_what_is_left_at_its_own_rate(
    scenario: Scenario, work: Work
) -> None:
    run = first(scenario, "shear")
    requests = JobRequests(scenario, work.results)
    work.stop("shear", run, [(400.0, 2.0, 100), (800.0, 4.0, 200)])
    assert requests.seconds_left("shear", run) == pytest.approx(1200.0)
    # The next attempt sees the checkpoint that the one before has left.
    work.stop("shear", run, [(800.0, 4.0, 200), (1200.0, 9.0, 300)])
    assert requests.seconds_left("shear", run) == pytest.approx(80.0)


def test_checkpoints_of_other_code_or_damaged_ones_do_not_count(
    scenario: Scenario, work: Work
) -> None:
    run = first(scenario, "shear")
    requests = JobRequests(scenario, work.results)
    expected = requests.seconds_left("shear", run)
    work.stop("shear", run, code="0" * 16)
    assert requests.seconds_left("shear", run) == expected
    newest, previous = work.stop("shear", run, [(400.0, 2.0, 100), (800.0, 4.0, 200)])
    newest.write_bytes(b"x")
    assert requests.seconds_left("shear", run) == pytest.approx(1600.0)
    previous.write_bytes(b"x")
    assert requests.seconds_left("shear", run) == expected


def test_what_begins_again_gets_more_time_and_what_resumes_does_not() -> None:
    requests = Fixed(600.0)
    for stage in STAGES:
        first_time, third_time = (requests.minutes(stage, "run", attempt) for attempt in (1, 3))
        if stage in FLOWING:
            assert third_time == first_time
        else:
            assert third_time >= 3 * (first_time - 1)


def test_memory_grows_with_attempts_to_twice_as_much(scenario: Scenario, work: Work) -> None:
    requests = JobRequests(scenario, work.results)
    for stage in STAGES:
        run = first(scenario, stage)
        each = [requests.megabytes(stage, run, attempt) for attempt in (1, 2, 11, 12)]
        # Within the step that requests are multiples of.
        growth = 1.1 if stage in FLOWING else 2.0
        assert each[1] == pytest.approx(growth * each[0], abs=2 * MEMORY_STEP)
        assert each[0] < each[1] <= each[2] == each[3]
        assert each[3] == pytest.approx(2 * each[0], abs=2 * MEMORY_STEP)


def test_memory_grows_with_nodes_and_mesh() -> None:
    fine = Parameters.from_mapping({"fidelity": "preview", "hydrodynamics": {"node_spacing": 2}})
    coarse = Parameters.from_mapping({"fidelity": "preview", "hydrodynamics": {"node_spacing": 6}})
    mesh = Parameters.from_mapping({})
    memory = [stage_memory("shear", each) for each in (coarse, fine, mesh)]
    assert memory == sorted(memory)
    assert stage_memory("packing", fine) == stage_memory("packing", coarse)


def test_the_profile_for_slurm_names_the_stages_that_resume() -> None:
    profile = yaml.safe_load((ROOT / "profiles" / "slurm" / "config.yaml").read_text())
    assert tuple(profile["preemptible-rules"]) == FLOWING
    assert tuple(profile["set-resources"]) == (*FLOWING, "snapshot")
    for stage in FLOWING:
        asked = profile["set-resources"][stage]["slurm_extra"]
        warning = int(asked.strip("'").removeprefix("--signal=TERM@"))
        # The controller looks every half minute.
        assert warning + 30 == STOPPING
    grouped = [entry.partition("=")[0] for entry in profile["groups"]]
    assert {*grouped, *FLOWING} == set(STAGES)
