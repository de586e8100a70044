"""The trajectory of a state: evaluate, guard, show, offer a checkpoint, step."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import NumericalError
from softslip.simulation.assembly import regularisation_of
from softslip.solver import health
from softslip.solver.crossing import check_crossing
from softslip.solver.geometry import FloatArray
from softslip.solver.integrators import INTEGRATORS, Accuracy, Vector
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
        Refused trials of the latest steps, for `solver.health.Rejections`.
    """

    evaluations: int = 1
    rejections: int = 0
    recent: tuple[int, ...] = ()


Visit = Callable[[State, Evaluation], None]
"""Called before each step, and after the last, with the state and its evaluation."""

Progress = Callable[[int, int, float], None]
"""Called after each step as progress(parts done, parts of the stage, time)."""

Keep = Callable[[State, Effort], None]
"""Called after each `Visit` but the last: here a stage can be interrupted and resumed."""


def ignore(*_: object) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Watch:
    """Who is called on the way of a stage: `Visit`, `Progress` and `Keep`."""

    visit: Visit = ignore
    progress: Progress = ignore
    keep: Keep = ignore


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
        }


def advance(
    suspension: Suspension,
    state: State,
    stops: FloatArray,
    parameters: Parameters,
    watch: Watch = Watch(),
    past: Effort | None = None,
) -> Advanced:
    """Advance a state to the last of some times: evaluate, guard, visit, keep, step.

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
    watch
        Who is called on the way; the first and the last state are visited too.
    past
        What `Keep` was called with for this state, where a stage resumes: the state is then not
        visited again, and everything after it has the same bits as without the break.

    Raises
    ------
    NumericalError
        When a guard of `solver.health` finds the numbers out of range, or no step is short
        enough.
    """
    course = _Course(suspension, state, parameters, past or Effort())
    whole = parameters.time_stepping.step
    if not state.memory.step_size:
        state = replace(state, memory=replace(state.memory, step_size=whole))
    end = float(stops[-1]) if len(stops) else state.time
    start, visited = state.step, past is not None
    while True:
        course.guard(state)
        if state.step > start:
            watch.progress(round(state.time / whole), round(end / whole), state.time)
        if not visited:
            watch.visit(state, course.latest)
        if state.time >= end:
            return Advanced(state, course.latest, course.effort)
        if not visited:
            watch.keep(state, course.effort)
        visited = False
        state = course.step(state, float(stops[np.searchsorted(stops, state.time, side="right")]))


class _Course:
    """The equations of motion on the way of a stage, and what they have taken.

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
        self._integrate = INTEGRATORS[stepping.integrator]
        self._longest_step = _LONGEST_STEP[stepping.integrator]
        self._accuracy = Accuracy(stepping.tolerance, suspension.error_scale(state))
        self._evaluations, self._rejections = past.evaluations, past.rejections
        self._refused = health.Rejections(past.recent)
        # Evaluating a state that was kept repeats the last evaluation before.
        self.latest = suspension.evaluate(state)

    @property
    def effort(self) -> Effort:
        """What the stage has taken so far."""
        return Effort(self._evaluations, self._rejections, self._refused.latest)

    def step(self, state: State, until: float) -> State:
        """Return the state after one step, which ends at a time at the latest."""

        def rate(vector: Vector, time: float) -> Vector:
            self._evaluations += 1
            self.latest = self._suspension.evaluate(state.replace(vector, time, state.step))
            return self.latest.rate

        longest = self._longest_step(state, self.latest, self._suspension, self._parameters)
        begin = state.vector, state.time, self.latest.rate, state.memory
        try:
            step = self._integrate(rate, *begin, self._accuracy, until, longest)
        except NumericalError as error:
            # The stepper only knows that no step has a value; what was lost is named here.
            health.check_finite(state)
            self.latest = self._suspension.evaluate(state)
            self.guard(state)
            raise health.named(error, state) from error
        self._rejections += step.rejections
        self._refused.add(step.rejections, state.step)
        wrapped = replace(
            state, vector=step.vector, time=step.time, step=state.step + 1, memory=step.memory
        )
        offsets, length = self._suspension.layout.offsets, self._parameters.channel.length
        wrap_particles(wrapped.node_position, offsets, length)
        return wrapped

    def guard(self, state: State) -> None:
        """Raise unless a state and its evaluation are sound; see `solver.health`."""
        evaluation, layout = self.latest, self._suspension.layout
        parameters, length = self._parameters, self._parameters.channel.length
        health.check_state(
            state,
            layout,
            evaluation.film_thickness,
            order=parameters.membrane.order,
            height=parameters.channel.height,
            contact_range=parameters.steric.length,
            regularisation=regularisation_of(parameters),
            node_spacing=float(layout.spacing.max(initial=0.0)),
        )
        health.check_forces(evaluation.forces, state.step)
        health.check_rate(evaluation.rate, state)
        health.check_control(state.wall_speed, evaluation.wall_velocity, state.step)
        check_crossing(evaluation.positions, layout, length, evaluation.film_thickness, state.step)


def _fixed(
    state: State, evaluation: Evaluation, suspension: Suspension, parameters: Parameters
) -> float:
    """Return the fixed step; refuse one that is longer than the motion allows."""
    step, velocities = parameters.time_stepping.step, state.like(evaluation.rate).node_position
    health.check_move(velocities, step, parameters.steric.length, state.step)
    return step


def _adapted(
    state: State, evaluation: Evaluation, suspension: Suspension, parameters: Parameters
) -> float:
    """Return the longest step that the motion and the parameters allow."""
    longest = health.longest_step(
        state.like(evaluation.rate).node_position,
        suspension.closing_rate(evaluation),
        parameters.steric.length,
        state.step,
        state.node_position[:, 1],
    )
    return min(longest, parameters.time_stepping.longest_step)


_LONGEST_STEP = {"euler": _fixed, "rkc2": _adapted}
"""What limits the steps of each of `INTEGRATORS`."""
