"""The trajectory of a state: evaluate, guard, record, write a checkpoint, step."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import NumericalError
from softslip.simulation.assembly import guard_of
from softslip.solver import step_limits
from softslip.solver.geometry import FloatArray
from softslip.solver.health import check_finite, named
from softslip.solver.integrators import INTEGRATORS, Accuracy, Solve, Vector
from softslip.solver.membrane import wrap_particles
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation, Suspension


@dataclass(frozen=True)
class Effort:
    """What a stage has taken so far; with its state, all that is needed to resume.

    Attributes
    ----------
    evaluations
        Evaluations of the equations of motion.
    rejections
        Trial steps that were refused and repeated with a shorter one.
    recent
        Refused trials of the latest steps, for `solver.step_limits.Rejections`.
    causes
        Steps whose length each of `solver.step_limits.CAUSES` has set.
    """

    evaluations: int = 1
    rejections: int = 0
    recent: tuple[int, ...] = ()
    causes: tuple[int, ...] = (0,) * len(step_limits.CAUSES)


Visit = Callable[[State, Evaluation], None]
"""Called before each step, and after the last, with the state and its evaluation."""

Progress = Callable[[int, int, float], None]
"""Called after each step as progress(parts done, parts of the stage, time)."""

Save = Callable[[State, Effort], None]
"""Called after each `Visit` but the last, where a stage can be interrupted and resumed."""


Ended = Callable[[State], bool]
"""Called after each `Visit`: whether the stage ends with this state, before its time."""


def ignore(*_: object) -> None:
    """Do nothing."""


def never(_: State) -> bool:
    """Return False: the stage ends at its time."""
    return False


@dataclass(frozen=True)
class Callbacks:
    """What a stage calls at every step: `Visit`, `Progress`, `Ended` and `Save`."""

    visit: Visit = ignore
    progress: Progress = ignore
    ended: Ended = never
    save: Save = ignore


@dataclass(frozen=True)
class Advanced:
    """Where a stage has got to, and what it took.

    Attributes
    ----------
    state, evaluation
        At the end.
    effort
        Of the whole stage.
    """

    state: State
    evaluation: Evaluation
    effort: Effort

    @property
    def evaluations(self) -> int:
        """Evaluations of the equations of motion."""
        return self.effort.evaluations

    @property
    def rejections(self) -> int:
        """Trial steps that were refused and repeated with a shorter one."""
        return self.effort.rejections

    @property
    def counts(self) -> dict[str, int]:
        """Counts for the attributes of a dataset."""
        return {
            "steps": self.state.step,
            "evaluations": self.evaluations,
            "rejections": self.rejections,
            **{
                f"steps_set_by_{cause}": count
                for cause, count in zip(step_limits.CAUSES, self.effort.causes, strict=True)
            },
        }


def advance(
    suspension: Suspension,
    state: State,
    stops: FloatArray,
    parameters: Parameters,
    callbacks: Callbacks = Callbacks(),
    past: Effort | None = None,
) -> Advanced:
    """Advance a state to the last of some times, or till it ends: guard, visit, save, step.

    Parameters
    ----------
    suspension
        The equations of motion.
    state
        Where to start; the time of a new stage is 0.
    stops
        Increasing times that steps end at, shape (stops,) [time unit].
    parameters
        Of the run.
    callbacks
        What is called on the way; the first and the last state are visited too.
    past
        What `Save` was called with for this state, where a stage resumes: the state is then not
        visited again, and everything after it has the same bits as without the interruption.

    Raises
    ------
    NumericalError
        When a guard of `solver.health` finds the numbers out of range, or no step is short
        enough.
    """
    unit = parameters.time_stepping.step
    if not state.memory.step_size:
        state = replace(state, memory=replace(state.memory, step_size=unit))
    integration = _Integration(suspension, state, parameters, past or Effort())
    end = float(stops[-1]) if len(stops) else state.time
    start, visited = state.step, past is not None
    while True:
        integration.guard(state)
        if state.step > start:
            callbacks.progress(round(state.time / unit), round(end / unit), state.time)
        if not visited:
            callbacks.visit(state, integration.latest)
        if state.time >= end or callbacks.ended(state):
            return Advanced(state, integration.latest, integration.effort)
        if not visited:
            callbacks.save(state, integration.effort)
        visited = False
        until = float(stops[np.searchsorted(stops, state.time, side="right")])
        state = integration.step(state, until)


class _Integration:
    """The integration of a stage's equations of motion, step by step, and what it has taken.

    Attributes
    ----------
    latest
        Evaluation of the present state.
    """

    def __init__(
        self, suspension: Suspension, state: State, parameters: Parameters, past: Effort
    ) -> None:
        stepping = parameters.time_stepping
        self._suspension, self._parameters = suspension, parameters
        self._guard = guard_of(parameters, suspension.layout)
        self._integrate = INTEGRATORS[stepping.integrator]
        self._longest_step = _LONGEST_STEP[stepping.integrator]
        self._adapts = stepping.integrator != "euler"
        self._accuracy = Accuracy(stepping.tolerance, suspension.error_scale(state))
        self._evaluations, self._rejections = past.evaluations, past.rejections
        self._rejected = step_limits.Rejections(past.recent)
        self._causes = dict(zip(step_limits.CAUSES, past.causes, strict=True))
        # The evaluation of a state from a checkpoint was counted before it was written.
        self.latest = suspension.evaluate(state)

    @property
    def effort(self) -> Effort:
        """What the stage has taken so far."""
        causes = tuple(self._causes.values())
        return Effort(self._evaluations, self._rejections, self._rejected.latest, causes)

    def guard(self, state: State) -> None:
        """Raise unless the present state and its evaluation are sound; see `solver.health`."""
        self._guard.check(state, self.latest)

    def step(self, state: State, until: float) -> State:
        """Return the state after one step, which ends at ``until`` at the latest."""

        def rate(vector: Vector, time: float) -> Vector:
            self._evaluations += 1
            self.latest = self._suspension.evaluate(state.replace(vector, time, state.step))
            return self.latest.rate

        def response(vector: Vector, shift: float) -> Solve:
            return self._suspension.response(state.like(vector), shift)

        limits = self._longest_step(state, self.latest, self._suspension, self._parameters)
        longest = min(limits.values())
        begin = state.vector, state.time, self.latest.rate, state.memory
        try:
            step = self._integrate(rate, *begin, self._accuracy, until, longest, response)
        except NumericalError as error:
            # The stepper only knows that no step has a value; what was lost is named here.
            check_finite(state)
            self._guard.check(state, self._suspension.evaluate(state))
            raise named(error, state) from error
        limits |= {"record": until - state.time}
        if self._adapts:
            # A trial that was refused had an error too large.
            limits["error"] = 0.0 if step.rejections else state.memory.step_size
        self._causes[step_limits.cause_of(step.time - state.time, limits)] += 1
        self._rejections += step.rejections
        self._rejected.add(step.rejections, state.step)
        position = state.like(step.vector).node_position
        wrap_particles(position, self._suspension.layout.offsets, self._parameters.channel.length)
        return replace(
            state, vector=step.vector, time=step.time, step=state.step + 1, memory=step.memory
        )


def _fixed(
    state: State, evaluation: Evaluation, suspension: Suspension, parameters: Parameters
) -> dict[str, float]:
    """Return the fixed step; refuse one that is longer than the motion allows."""
    step, velocities = parameters.time_stepping.step, state.like(evaluation.rate).node_position
    step_limits.check_move(velocities, step, parameters.steric.length, state.step)
    return {"longest": step}


def _adapted(
    state: State, evaluation: Evaluation, suspension: Suspension, parameters: Parameters
) -> dict[str, float]:
    """Return the longest step that films, motion and parameters allow, each by itself."""
    limits = step_limits.longest_steps(
        state.like(evaluation.rate).node_position,
        suspension.closing_rate(evaluation),
        parameters.steric.length,
        state.step,
        state.node_position[:, 1],
    )
    return limits | {"longest": parameters.time_stepping.longest_step}


_LONGEST_STEP = {"euler": _fixed, "rkc2": _adapted, "imex_rkc2": _adapted}
"""What limits the steps of each of `INTEGRATORS` apart from their error."""
