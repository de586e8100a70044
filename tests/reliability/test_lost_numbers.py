"""NaN and infinity, put wherever a run keeps or computes a number: found in the step they come."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scenes

from softslip.errors import NumericalError
from softslip.simulation import hydrodynamics, trajectory
from softslip.simulation.checkpoint import Identity
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.simulation.checkpointer import Checkpointer
from softslip.simulation.interruption import Interruption
from softslip.solver import contacts, control, health, membrane, suspension

pytestmark = [
    pytest.mark.reliability,
    # Infinity less infinity is warned of, on standard error; what counts is that the run stops.
    pytest.mark.filterwarnings("ignore::RuntimeWarning"),
]

IDENTITY = Identity("shear", "0" * 16, "1" * 64, "2" * 16, "python 3", "{}")

VALUES = [math.nan, math.inf, pytest.param(-math.inf, marks=pytest.mark.slow)]
ARRAYS = ["node_position", "tether", "wall_displacement", "wall_speed"]
SCALARS = ["time", "step_size", "spectral_radius"]
MEMORY = ["step_size", "spectral_radius", "direction"]
"""What a stepper remembers."""

AT = 6
"""Step at which numbers are lost, of some dozens."""


@pytest.fixture(params=["euler", "rkc2"])
def given(request: pytest.FixtureRequest) -> Any:
    stepping = {"integrator": request.param, "step": 0.002, "tolerance": 2e-3, "shear_time": 0.05}
    return scenes.parameters(rheometer={"stress": 0.5}, time_stepping=stepping)


@pytest.fixture
def scene(aged, given) -> tuple[Any, Any]:
    equations, _ = scenes.of_foam(aged, given)
    return equations, hydrodynamics._aged_state(aged, equations.layout)


def advance(scene, given, save: Callable[..., None] = trajectory.ignore) -> trajectory.Advanced:
    equations, state = scene
    stops = np.linspace(0.0, 0.05, 11)[1:]
    return trajectory.advance(equations, state, stops, given, trajectory.Callbacks(save=save))


def refused(scene, given, save: Callable[..., None] = trajectory.ignore) -> NumericalError:
    with pytest.raises(NumericalError) as caught:
        advance(scene, given, save)
    assert "\n" not in str(caught.value)
    return caught.value


def spoilt(state, name: str, value: float, place: int) -> Any:
    """Return a state with a number of one of its fields lost."""
    if name == "time":
        return dataclasses.replace(state, time=value)
    if name in MEMORY:
        direction = np.ones_like(state.vector)
        direction[place] = value
        lost = direction if name == "direction" else value
        memory = dataclasses.replace(state.memory, **{name: lost})
        return dataclasses.replace(state, memory=memory)
    lost = state.replace(state.vector.copy(), state.time, state.step)
    getattr(lost, name).flat[place] = value
    return lost


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("name", [*ARRAYS, "direction", *SCALARS])
def test_lost_before_the_first_step(scene, given, tally, name: str, value: float) -> None:
    counts = tally("lost numbers of a state")
    for place in (0, -1):
        error = refused((scene[0], spoilt(scene[1], name, value, place)), given)
        assert (error.field, error.step) == (name, 0)
        counts["found"] += 1


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("name", [*ARRAYS, "time", *MEMORY])
def test_lost_by_a_step(scene, given, monkeypatch, tally, name: str, value: float) -> None:
    """As the stepper hands the new state over."""
    integrate, steps = trajectory.INTEGRATORS[given.time_stepping.integrator], []

    def losing(*arguments: Any) -> Any:
        step = integrate(*arguments)
        steps.append(step)
        if len(steps) != AT:
            return step
        if name in ARRAYS:
            lost = spoilt(scene[1].replace(step.vector, 0.0, 0), name, value, -1)
            return dataclasses.replace(step, vector=lost.vector)
        if name == "time":
            return dataclasses.replace(step, time=value)
        other = np.where(np.arange(step.vector.size) == 7, value, 1.0)
        lost = other if name == "direction" else value
        return dataclasses.replace(step, memory=dataclasses.replace(step.memory, **{name: lost}))

    integrators = {given.time_stepping.integrator: losing}
    monkeypatch.setattr(trajectory, "INTEGRATORS", integrators)
    error = refused(scene, given)
    assert (error.field, error.step, len(steps)) == (name, AT, AT)
    tally("lost numbers of a state")["found"] += 1


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("name", [*ARRAYS, "direction"])
def test_lost_between_a_guard_and_the_step(scene, given, tally, name: str, value: float) -> None:
    """In memory, after the state was found to be sound and had been kept."""

    def lose(state, _) -> None:
        if state.step == AT:
            getattr(state.memory if name == "direction" else state, name).flat[-1] = value

    error = refused(scene, given, lose)
    assert error.field == name
    assert error.step in (AT, AT + 1)
    tally("lost numbers of a state")["found"] += 1


def lose_force(row: int) -> Callable[..., Any]:
    def spoil(result: Any, arguments: tuple[Any, ...], value: float) -> Any:
        arguments[-1][row, 1] = value
        return result

    return spoil


def lose_velocity(row: int, axis: int) -> Callable[..., Any]:
    def spoil(result: Any, _: tuple[Any, ...], value: float) -> Any:
        result = result.copy()
        result[row, axis] = value
        return result

    return spoil


def lose_all(_result: Any, _: tuple[Any, ...], value: float) -> Any:
    return value


class Mobility:
    """A Stokes solver that can be patched by its class."""

    def __init__(self, other: Any) -> None:
        self._other = other

    def velocities(self, positions: Any, forces: Any) -> Any:
        return self._other.velocities(positions, forces)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._other, name)


TERMS = {
    "tension": (membrane, "add_tension", lose_force(11), {"force"}),
    "contact": (contacts.Contacts, "add_forces", lose_force(12), {"force"}),
    "contact at a wall": (contacts.Contacts, "add_forces", lose_force(-1), {"force"}),
    "film": (contacts.Contacts, "add_forces", lose_all, {"film_thickness"}),
    "closing": (contacts.Contacts, "closing_rate", lose_all, {"closing_rate"}),
    "tethers": (suspension.Suspension, "positions", None, {"tether", "force"}),
    "traction": (control.StressControl, "traction", lose_all, {"traction"}),
    "node velocity": (Mobility, "velocities", lose_velocity(5, 1), {"node_velocity"}),
    "wall velocity": (
        Mobility,
        "velocities",
        lose_velocity(-1, 0),
        {"tether_rate", "wall_velocity", "tether", "wall_displacement"},
    ),
    "across a wall": (Mobility, "velocities", lose_velocity(-1, 1), {"tether_rate", "tether"}),
}
"""Where each term of the equations is computed, how it is lost, and what the error may name."""


@pytest.fixture
def losing(monkeypatch, scene) -> Callable[..., dict[str, int]]:
    """Return a function that makes a term lose numbers while the box says so."""
    equations, _ = scene
    equations._mobility = Mobility(equations._mobility)

    def patch(term: str, value: float) -> dict[str, int]:
        owner, name, spoil, _ = TERMS[term]
        original, box = getattr(owner, name), {"left": 0, "done": 0}

        def wrapped(*arguments: Any) -> Any:
            result = original(*arguments)
            if box["left"] <= 0:
                return result
            box["left"] -= 1
            box["done"] += 1
            if spoil is None:
                arguments[1].tether[0, 3, 1] = value
                return result
            return spoil(result, arguments, value)

        monkeypatch.setattr(owner, name, wrapped)
        return box

    return patch


def goes_unnoticed(term: str, value: float) -> bool:
    """Return whether a number is none that is lost: no film at all, and one that opens."""
    return term == "film" and value == math.inf


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("term", TERMS)
def test_lost_in_a_term(scene, given, losing, tally, term: str, value: float) -> None:
    """From one step on for good: within that step, under its own name."""
    if goes_unnoticed(term, value):
        pytest.skip("infinite where there is no film")
    if term == "closing" and given.time_stepping.integrator == "euler":
        pytest.skip("Euler steps are not shortened for films that close")
    box = losing(term, value)

    def lose(state, _) -> None:
        if state.step == AT:
            box["left"] = 10**9

    error = refused(scene, given, lose)
    assert error.field in TERMS[term][-1], str(error)
    assert error.step in (AT, AT + 1), str(error)
    tally("lost numbers of a term")["found"] += 1


@pytest.mark.parametrize("value", VALUES)
@pytest.mark.parametrize("term", TERMS)
def test_lost_for_a_moment(scene, given, losing, tally, term: str, value: float) -> None:
    """In one evaluation: it stops the run, or the step is tried again and all is sound."""
    if goes_unnoticed(term, value):
        pytest.skip("infinite where there is no film")
    counts, before = tally("lost numbers of a moment"), advance(scene, given)
    box = losing(term, value)

    def lose(state, _) -> None:
        if state.step == AT:
            box["left"] = 1

    try:
        after = advance(scene, given, lose)
    except NumericalError as error:
        late = error.step - AT
    else:
        late = -1
    if late >= 0:
        assert late <= 1, "later than the next guard"
        counts["found"] += 1
        return
    if not box["done"]:
        pytest.skip("not computed by this stepper")
    assert np.isfinite(after.state.vector).all()
    redone = after.rejections > before.rejections
    same = after.state.vector.tobytes() == before.state.vector.tobytes()
    assert redone or same, f"{term} was lost and nobody noticed"
    counts["tried again" if redone else "of no effect"] += 1


@pytest.mark.parametrize("term", ["tension", "node velocity"])
def test_what_was_kept_is_sound(
    aged, scene, given, losing, monkeypatch, tmp_path, tally, term: str
) -> None:
    """A run that stops so resumes from its last checkpoint with the same bits."""
    whole = hydrodynamics.shear(aged, given)
    said: list[str] = []
    folder = tmp_path / "checkpoints"

    def checkpointer() -> Checkpointer:
        return Checkpointer(Checkpoints(folder, IDENTITY, said.append), Interruption(), 0.0)

    with monkeypatch.context() as patch:
        patch.setattr(suspension, "RestWithoutForce", Mobility)
        box = losing(term, math.nan)
        first = checkpointer()
        save = first.save_if_due

        def saving(state, *others: Any) -> None:
            save(state, *others)
            box["left"] = 10**9 if state.step >= AT else 0

        first.save_if_due = saving
        with pytest.raises(NumericalError):
            hydrodynamics.shear(aged, given, checkpointer=first)
        box["left"] = -1
    assert health.check_finite(scene[1]) is None
    assert hydrodynamics.shear(aged, given, checkpointer=checkpointer()).identical(whole)
    assert "resuming from" in said[0]
    tally("checkpoints of runs that lost numbers")["resumed"] += 1
