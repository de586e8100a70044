"""The trajectory of a state: evaluate, guard, show, offer a checkpoint, step."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import NumericalError
from softslip.simulation.assembly import regularisation_of
from softslip.solver import health
from softslip.solver.crossing import check_crossing
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.integrators import INTEGRATORS, Accuracy, Vector
from softslip.solver.membrane import wrap_particles
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation, Suspension

Progress = Callable[[int, int, float], None]
"""Called as progress(parts done, parts of the stage, time)."""

Visit = Callable[[State, Evaluation], None]
"""Called before each step, and after the last, with the state and its evaluation."""


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


Keep = Callable[[State, Effort], None]
"""Called after each `Visit` but the last: here a stage can be interrupted and resumed."""


def _no_keep(*_: object) -> None:
    """Keep nothing."""


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
    visit: Visit,
    progress: Progress,
    keep: Keep = _no_keep,
    past: Effort | None = None,
) -> Advanced:
    """Advance a state to the last of some times: evaluate, guard, show, keep, step.

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
    visit
        Called with every state, the first and the last included.
    progress
        See `Progress`.
    keep
        See `Keep`.
    past
        What ``keep`` was given with this state, where a stage resumes: the state is then not
        visited again, and everything after it has the same bits as without the break.

    Raises
    ------
    NumericalError
        When a guard of `solver.health` finds the numbers out of range, or no step is short
        enough.
    """
    stepping = parameters.time_stepping
    integrate = INTEGRATORS[stepping.integrator]
    longest_step = _LONGEST_STEP[stepping.integrator]
    accuracy = Accuracy(stepping.tolerance, suspension.error_scale(state))
    if not state.memory.step_size:
        state = replace(state, memory=replace(state.memory, step_size=stepping.step))
    latest = suspension.evaluate(state)
    # Evaluating a state that was kept repeats the last evaluation before.
    effort = past or Effort()
    evaluations, rejections = effort.evaluations, effort.rejections
    refused = health.Rejections(effort.recent)
    seen = past is not None

    def rate(vector: Vector, time: float) -> Vector:
        nonlocal latest, evaluations
        evaluations += 1
        latest = suspension.evaluate(state.replace(vector, time, state.step))
        return latest.rate

    end = float(stops[-1]) if len(stops) else state.time
    start = state.step
    while True:
        _guard(state, latest, suspension.layout, parameters)
        if state.step > start:
            progress(round(state.time / stepping.step), round(end / stepping.step), state.time)
        if not seen:
            visit(state, latest)
            effort = Effort(evaluations, rejections, refused.latest)
        if state.time >= end:
            return Advanced(state, latest, effort)
        if not seen:
            keep(state, effort)
        seen = False
        until = float(stops[np.searchsorted(stops, state.time, side="right")])
        longest = longest_step(state, latest, suspension, parameters)
        try:
            step = integrate(
                rate,
                state.vector,
                state.time,
                latest.rate,
                state.memory,
                accuracy,
                until,
                longest,
            )
        except NumericalError as error:
            # The stepper only knows that no step has a value; what was lost is named here.
            health.check_finite(state)
            _guard(state, suspension.evaluate(state), suspension.layout, parameters)
            raise health.named(error, state) from error
        rejections += step.rejections
        refused.add(step.rejections, state.step)
        state = replace(
            state, vector=step.vector, time=step.time, step=state.step + 1, memory=step.memory
        )
        wrap_particles(state.node_position, suspension.layout.offsets, parameters.channel.length)


def _guard(state: State, evaluation: Evaluation, layout: Layout, parameters: Parameters) -> None:
    """Raise unless a state and its evaluation are sound; see `solver.health`."""
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
    film, length = evaluation.film_thickness, parameters.channel.length
    check_crossing(evaluation.positions, layout, length, film, state.step)


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
