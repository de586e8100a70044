"""Longer runs continue shorter ones of the same trajectory, with the bytes of one long run."""

import dataclasses
import json

import numpy as np
import pytest
import scenes
from checkpoints import state

from softslip.config.stages import stage_parameters, trajectory_id
from softslip.files.storage import CONTENT_DIGEST, digests
from softslip.simulation import hydrodynamics, known_mean
from softslip.simulation.checkpoint import Header, Identity, read_header
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.simulation.checkpointer import Checkpointer
from softslip.simulation.end_state import EndState
from softslip.simulation.interruption import Interruption
from softslip.simulation.record import interval_edges

STEPPERS = {
    "euler": {"integrator": "euler", "step": 0.002},
    "rkc2": {"integrator": "rkc2", "step": 0.002, "tolerance": 2e-3, "longest_step": 0.02},
    "imex_rkc2": {"integrator": "imex_rkc2", "step": 0.002, "tolerance": 2e-3},
}


def parameters(end, stepper="imex_rkc2", error=None, **groups):
    """Parameters of a run whose records end at multiples of 0.02, its profiles at those of 0.03."""
    recording = {"longest_interval": 0.02, "samples_per_decade": 1, "profile_interval": 0.03}
    return scenes.parameters(
        **{"rheometer": {"stress": 0.5}} | groups,
        time_stepping=STEPPERS[stepper] | {"shear_time": end},
        recording=recording | {"snapshots": [0.05], "stride": 2},
        until={"error": error},
    )


def identity_of(given, **changes):
    name = json.dumps([given.time_stepping.shear_time, given.until.error])
    identity = Identity("shear", name, "1" * 64, "2" * 16, "python 3", "")
    return dataclasses.replace(identity, parameters=stage_parameters(given, "shear"), **changes)


def end_state(folder, given, said, **changes):
    return EndState(folder, identity_of(given, **changes), trajectory_id(given), said.append)


def run(folder, aged, given):
    """Shear with checkpoints in a folder; return the result and what was said."""
    said = []
    checkpoints = Checkpoints(
        folder, identity_of(given), said.append, end_state=end_state(folder, given, said)
    )
    return hydrodynamics.shear(
        aged, given, checkpointer=Checkpointer(checkpoints, Interruption())
    ), said


def test_runs_of_round_length_end_with_a_whole_record_by_default():
    given = scenes.parameters()
    step, recording = given.time_stepping.step, given.recording
    longest = round(recording.longest_interval / step)
    for end in (100.0, 300.0, 1000.0, 3000.0):
        edges = interval_edges(round(end / step), recording.samples_per_decade, longest)
        assert edges[-1] == round(end / step)


@pytest.mark.parametrize("stepper", STEPPERS)
def test_a_longer_run_continues_with_the_same_bytes(tmp_path, aged, stepper):
    whole = hydrodynamics.shear(aged, parameters(0.2, stepper))
    part, said = run(tmp_path, aged, parameters(0.08, stepper))
    assert not said
    longer, said = run(tmp_path, aged, parameters(0.2, stepper))
    assert said == [f"continuing a shorter run from {next(tmp_path.iterdir()).name}: t = 0.08"]
    assert longer.identical(whole)
    assert digests(longer)[CONTENT_DIGEST] == digests(whole)[CONTENT_DIGEST]
    early = whole.sel(time=part["time"])
    for name in ("shear_rate_wall", "stress", "slip_velocity_wall"):
        if name in part:
            assert np.array_equal(part[name], early[name]), name


def test_any_number_of_times(tmp_path, aged):
    for end in (0.06, 0.1, 0.14, 0.2):
        longer, _ = run(tmp_path, aged, parameters(end))
    assert longer.identical(hydrodynamics.shear(aged, parameters(0.2)))
    (path,) = tmp_path.iterdir()
    assert read_header(path).time == 0.2


def test_the_end_that_cuts_off_a_record_is_not_kept(tmp_path, aged):
    """The longer run takes no step that ends there."""
    run(tmp_path, aged, parameters(0.05))
    assert not tmp_path.exists() or not list(tmp_path.iterdir())


def test_a_shorter_run_starts_from_the_beginning_and_leaves_the_longer_end(tmp_path, aged):
    run(tmp_path, aged, parameters(0.2))
    shorter, said = run(tmp_path, aged, parameters(0.1))
    assert "at t = 0.2, after the end of this run; starting from the beginning" in said[0]
    assert shorter.identical(hydrodynamics.shear(aged, parameters(0.1)))
    (path,) = tmp_path.iterdir()
    assert read_header(path).time == 0.2


def test_only_the_length_may_differ(tmp_path, aged):
    run(tmp_path, aged, parameters(0.08))
    _, said = run(tmp_path, aged, parameters(0.1, rheometer={"stress": 0.4}))
    assert not said
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("name", ["parent", "environment"])
def test_what_started_from_something_else_is_ignored(tmp_path, name):
    given, said = parameters(0.2), []
    end_state(tmp_path, given, said, **{name: "other"}).save(header(given, name), state().parts)
    assert end_state(tmp_path, given, said).load() is None
    assert f"is of another {name}; starting from the beginning" in said[0]


def header(given, *other, time=0.1):
    identity = identity_of(given, **dict.fromkeys(other, "other"))
    return Header(time, time, 7, 1.0, 2.0, 0, 3.0, identity)


def test_a_damaged_one_is_ignored_and_replaced(tmp_path):
    given, said = parameters(0.2), []
    kept = end_state(tmp_path, given, said)
    kept.save(header(given), state().parts)
    kept.path.write_bytes(kept.path.read_bytes()[:-1])
    assert kept.load() is None
    assert "damaged" in said[0]
    kept.path.write_bytes(b"nothing")
    kept.save(header(given), state().parts)
    found, _ = kept.load()
    assert found.time == 0.1


@pytest.mark.parametrize(
    ("theirs", "ours", "usable"),
    [
        (None, None, True),
        (0.05, None, True),
        (0.05, 0.05, True),
        (0.05, 0.03, True),
        (0.03, 0.05, False),
        (None, 0.05, False),
    ],
)
def test_what_would_have_ended_before_is_not_continued(tmp_path, theirs, ours, usable):
    said = []
    early, late = parameters(0.2, error=theirs), parameters(0.4, error=ours)
    end_state(tmp_path, early, said).save(header(early), state().parts)
    assert (end_state(tmp_path, late, said).load() is not None) == usable
    assert usable or "is of a run that was to end later" in said[0]


def test_the_file_of_the_longest_run_stays(tmp_path):
    given = parameters(0.4)
    kept = end_state(tmp_path, given, [])
    for time, wanted in ((0.1, 0.1), (0.3, 0.3), (0.2, 0.3)):
        kept.save(header(given, time=time), state().parts)
        assert kept.load()[0].time == wanted


def test_a_run_ends_by_its_error_and_can_be_prolonged(tmp_path, aged, monkeypatch):
    # So short a run is still yielding, and knows nothing.
    for module in (known_mean, hydrodynamics):
        monkeypatch.setattr(module, "relative_error", lambda edges, means: 0.5)
    recording = {"longest_interval": 0.002, "profile_interval": 0.05}
    given = {
        error: scenes.parameters(
            rheometer={"stress": 0.5},
            time_stepping=STEPPERS["rkc2"] | {"shear_time": 0.8},
            recording=recording,
            until={"error": error},
        )
        for error in (0.9, None)
    }
    whole = hydrodynamics.shear(aged, given[None])
    assert whole.attrs["ended_by"] == "time"
    assert "relative_error" not in whole.attrs
    short, _ = run(tmp_path, aged, given[0.9])
    assert short.attrs["ended_by"] == "error"
    assert short.attrs["relative_error"] == 0.5
    end = float(short["time"][-1])
    assert end == known_mean.look_times(np.append(0.0, whole["time"]))[1] < 0.8
    assert float(short["profile_time"][-1]) == end
    assert np.array_equal(short["stress"], whole["stress"].sel(time=short["time"]))
    longer, said = run(tmp_path, aged, given[None])
    assert "continuing a shorter run" in said[0]
    assert longer.identical(whole)
