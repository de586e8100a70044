import dataclasses
import threading

import numpy as np
import pytest
import scenes

from softslip.errors import CheckpointError, Interrupted, NumericalError
from softslip.files.storage import CONTENT_DIGEST, digests
from softslip.simulation import hydrodynamics
from softslip.simulation.checkpoint import Identity
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.simulation.checkpointer import Checkpointer
from softslip.simulation.interruption import Interruption
from softslip.solver.suspension import Suspension

IDENTITY = Identity("shear", "0" * 16, "1" * 64, "2" * 16, "python 3", "{}")

ROUTES = {
    "rkc2, stress": {"rheometer": {"stress": 0.5}},
    "rkc2, rate": {"rheometer": {"mode": "rate", "stress": None, "shear_rate": 0.05}},
    "imex_rkc2, stress": {"rheometer": {"stress": 0.5}},
    "imex_rkc2, rate": {"rheometer": {"mode": "rate", "stress": None, "shear_rate": 0.05}},
    "euler, stress": {"rheometer": {"stress": 0.5}},
    "euler, rate": {"rheometer": {"mode": "rate", "stress": None, "shear_rate": 0.05}},
}
"""What a run depends on that is stepped in another way."""


def parameters(route, **groups):
    stepper = {
        "rkc2": {"integrator": "rkc2", "step": 0.002, "tolerance": 2e-3},
        "imex_rkc2": {"integrator": "imex_rkc2", "step": 0.002, "tolerance": 2e-3},
        "euler": {"integrator": "euler", "step": 0.002},
    }[route.split(",")[0]]
    # Records, profiles and snapshots fall before, at and after the interruptions.
    recording = {"profile_interval": 0.07, "snapshots": [0.0, 0.05, 0.2], "stride": 2}
    return scenes.parameters(
        **ROUTES[route], time_stepping=stepper | {"shear_time": 0.2}, recording=recording, **groups
    )


class Breaking(Interruption):
    """A signal that comes after so many steps."""

    def __init__(self, steps):
        self.left = steps

    @property
    def name(self):
        self.left -= 1
        return "SIGTERM" if self.left < 0 else ""

    @name.setter
    def name(self, _):
        pass


def checkpointer(folder, steps=10**9, interval=1e9, identity=IDENTITY, said=None):
    said = [] if said is None else said
    return Checkpointer(Checkpoints(folder, identity, said.append), Breaking(steps), interval)


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("breaks", [(0,), (1,), (7,), (3, 0, 9)])
def test_an_interrupted_run_has_the_same_bytes(tmp_path, aged, route, breaks):
    given = parameters(route)
    whole = hydrodynamics.shear(aged, given)
    for steps in breaks:
        with pytest.raises(Interrupted, match=r"SIGTERM at t = .* of 0\.2; rerun the same command"):
            hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, 2 * steps))
    again = hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path))
    assert again.identical(whole)
    assert digests(again)[CONTENT_DIGEST] == digests(whole)[CONTENT_DIGEST]


def test_interrupted_ageing_has_the_same_bytes(tmp_path, foam):
    given = scenes.parameters(time_stepping={"ageing_time": 0.1})
    whole = hydrodynamics.age(foam, given)
    with pytest.raises(Interrupted):
        hydrodynamics.age(foam, given, checkpointer=checkpointer(tmp_path, 20))
    assert hydrodynamics.age(foam, given, checkpointer=checkpointer(tmp_path)).identical(whole)


def test_checkpoints_come_with_the_interval_and_change_nothing(tmp_path, aged):
    given = parameters("euler, stress")
    every = hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, interval=0.0))
    assert len(list(tmp_path.glob("*.checkpoint"))) == 2
    assert every.identical(
        hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path / "none"))
    )
    assert not (tmp_path / "none").exists()


def test_a_run_goes_on_from_the_generation_before_a_damaged_one(tmp_path, aged):
    given = parameters("euler, stress")
    whole = hydrodynamics.shear(aged, given)
    with pytest.raises(Interrupted):
        hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, 40, interval=0.0))
    newest = next(path for path in tmp_path.iterdir() if "previous" not in path.name)
    newest.write_bytes(newest.read_bytes()[:-1])
    said = []
    again = hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, said=said))
    assert again.identical(whole)
    assert "damaged" in said[0]
    assert "previous" in said[1]
    assert not newest.exists()


def test_a_state_that_is_unsound_never_becomes_a_checkpoint(tmp_path, aged, monkeypatch):
    """The run stops at the guard; what was kept before is still there, and goes on."""
    given = parameters("euler, stress")
    whole = hydrodynamics.shear(aged, given)
    evaluate, calls = Suspension.evaluate, []

    def spoilt(self, state):
        calls.append(1)
        found = evaluate(self, state)
        if len(calls) > 60:
            state.node_position[3, 0] = np.nan
        return found

    with monkeypatch.context() as patch:
        patch.setattr(Suspension, "evaluate", spoilt)
        with pytest.raises(NumericalError, match=r"node_position\[3\]"):
            hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, interval=0.0))
    assert hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path)).identical(whole)


def test_a_memory_of_a_longer_run_is_refused(tmp_path, aged):
    given = parameters("euler, stress")
    with pytest.raises(Interrupted):
        hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, 60))
    stepping = given.time_stepping.model_copy(update={"shear_time": 0.01})
    shorter = given.model_copy(update={"time_stepping": stepping})
    with pytest.raises(CheckpointError, match="does not fit this run"):
        hydrodynamics.shear(aged, shorter, checkpointer=checkpointer(tmp_path))


def test_without_a_checkpoint_there_is_nothing_to_resume(tmp_path, aged):
    checkpoints = Checkpoints(tmp_path, IDENTITY, lambda _: None, required=True)
    with pytest.raises(CheckpointError, match="no undamaged checkpoint; run without --resume"):
        hydrodynamics.shear(
            aged,
            parameters("euler, stress"),
            checkpointer=Checkpointer(checkpoints, Interruption()),
        )


@pytest.mark.parametrize("key", ["fingerprint", "environment", "stage", "run"])
def test_what_is_of_something_else_is_refused(tmp_path, aged, key):
    given = parameters("euler, stress")
    with pytest.raises(Interrupted):
        hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, 5))
    other = dataclasses.replace(IDENTITY, **{key: "other"})
    if key in ("fingerprint", "run"):
        (found,) = tmp_path.glob("*.checkpoint")
        names = {"fingerprint": f"{'0' * 16}.other", "run": f"other.{'2' * 16}"}
        found.rename(tmp_path / f"{names[key]}.checkpoint")
    with pytest.raises(CheckpointError, match=f"{key} is .*, but this run has 'other'"):
        hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, identity=other))


def test_with_another_parent_the_stage_begins_again(tmp_path, aged):
    given = parameters("euler, stress")
    with pytest.raises(Interrupted):
        hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, 5))
    other = dataclasses.replace(IDENTITY, parent="other")
    again = hydrodynamics.shear(aged, given, checkpointer=checkpointer(tmp_path, identity=other))
    assert again.identical(hydrodynamics.shear(aged, given))


def test_threads_change_no_byte(aged):
    given = scenes.parameters(
        hydrodynamics={"mobility": "ewald"}, time_stepping={"shear_time": 0.02}
    )
    one, *others = (hydrodynamics.shear(aged, given, threads=count) for count in (1, 2, 4, 2, 2, 2))
    assert all(other.identical(one) for other in others)
    assert threading.active_count() < 50
