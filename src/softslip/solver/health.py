"""Guards that stop a run whose numbers no longer mean anything."""

import math
from collections import deque
from collections.abc import Iterable
from typing import NoReturn

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.geometry import BoolArray, FloatArray, Layout
from softslip.solver.membrane import membrane_areas
from softslip.solver.state import State

LARGEST_MOVE = 0.5
"""Largest node displacement of one step, in contact ranges: a contact must not be jumped over."""

LARGEST_CLOSING = 0.5
"""Largest part of its thickness by which a film may close in one step that adapts."""

SMALLEST_FILM = 0.2
"""Smallest distance between nodes of two bodies, in contact ranges: the contact force there is
some 1e5 times that of a packing at rest, so that only an unresolved run comes near."""

LARGEST_AREA_ERROR = 0.05
"""Largest relative change of any particle's area."""


LEAST_SPACINGS = 0.85
"""Smallest film between two bodies, in node spacings: in packings at area fractions of 0.84 to 0.9,
films of 0.9 spacings and more led to shear rates that were right to 1 %, those below 0.84, of which
some went on to collapse, to errors of 11 % and more."""

THINNEST_FILM = 2.0 / math.sqrt(math.pi)
"""Smallest film between nodes of two bodies, in regularisation lengths: two sheets slide as if
their film were thinner by this, the mean distance of two points that are each smeared over ε."""

REJECTION_STEPS, LARGEST_REJECTION = 50, 1.0
"""Steps over which refused trials are counted, and how many of them to a step end a run."""

LARGEST_SLIP = 0.5
"""Largest difference of the printed control's wall speed from the fluid's, relative."""


def _refuse(field: str, bad: BoolArray, step: int, what: str, remedy: str) -> NoReturn:
    index = int(np.flatnonzero(bad)[0])
    raise NumericalError(field, index, step, f"{what}; {remedy}")


def longest_step(
    velocities: FloatArray,
    closing_rate: float,
    contact_range: float,
    step: int,
    heights: FloatArray | None = None,
) -> float:
    """Return the longest step that moves no node over a contact and closes no film.

    Parameters
    ----------
    velocities
        Of the particle nodes, shape (nodes, 2).
    closing_rate
        Largest -d(ln h)/dt of any film [1 / time unit].
    contact_range
        σ_LJ [length unit].
    step
        Number of the step, for the message.
    heights
        Of the nodes, shape (nodes,): then the uniform shear that fits the velocities best does
        not count, as it hardly moves two nodes in contact against each other [length unit].

    Returns
    -------
    float
        In time units; infinite when nothing moves.

    Raises
    ------
    NumericalError
        Naming the first node whose velocity is not a number, or the closing rate if that is none.
    """
    lost: BoolArray = ~np.isfinite(velocities.sum(axis=1))
    if lost.any():
        _refuse("node_velocity", lost, step, "is not finite", "use a smaller time_stepping.step")
    if not math.isfinite(closing_rate):
        raise NumericalError("closing_rate", 0, step, f"is {closing_rate}; {_SHORTER}")
    if heights is not None and len(heights):
        velocities = _without_shear(velocities, heights)
    fastest = np.abs(velocities).max(initial=0.0) / contact_range
    limits = [
        share / rate
        for share, rate in ((LARGEST_MOVE, fastest), (LARGEST_CLOSING, closing_rate))
        if rate > 0
    ]
    return float(min(limits, default=np.inf))


def _without_shear(velocities: FloatArray, heights: FloatArray) -> FloatArray:
    """Return velocities less their best fit by a uniform shear v_x = a + b y."""
    along, y = velocities[:, 0], heights - heights.mean()
    shear = float(np.einsum("i,i", along, y)) / max(
        float(np.einsum("i,i", y, y)), np.finfo(float).tiny
    )
    return np.column_stack((along - along.mean() - shear * y, velocities[:, 1]))


def check_move(velocities: FloatArray, time_step: float, contact_range: float, step: int) -> None:
    """Raise when a node would move too far in a step, or its velocity is not a number.

    Parameters
    ----------
    velocities
        Of the particle nodes, shape (nodes, 2).
    time_step
        Δt [time unit].
    contact_range
        σ_LJ [length unit].
    step
        Number of the step, for the message.

    Raises
    ------
    NumericalError
        Naming the fastest node.
    """
    if time_step <= longest_step(velocities, 0.0, contact_range, step):
        return
    speeds = np.abs(velocities).max(axis=1)
    worst = speeds.max()
    _refuse(
        "node_velocity",
        speeds == worst,
        step,
        f"{worst:.3g} moves the node by more than {LARGEST_MOVE:g} steric.length in a step",
        f"use a time_stepping.step well below {time_step:g}",
    )


def check_state(
    state: State,
    layout: Layout,
    film_thickness: float,
    *,
    order: int,
    height: float,
    contact_range: float,
    regularisation: float = 0.0,
    node_spacing: float = 0.0,
) -> None:
    """Raise when a state is not finite, leaks, has left the channel, or is about to cross.

    Parameters
    ----------
    state, layout
        What to check.
    film_thickness
        Smallest distance between contact points of two bodies [length unit].
    order
        Of the areas, see `solver.membrane.membrane_areas`.
    height
        H [length unit].
    contact_range
        σ_LJ [length unit].
    regularisation
        ε [length unit].
    node_spacing
        Largest distance Δs between the nodes of a membrane at rest [length unit].

    Raises
    ------
    NumericalError
        Naming field, index and step, and what to change.
    """
    check_finite(state)
    heights = state.node_position[:, 1]
    outside = (heights < 0) | (heights > height)
    if outside.any():
        _refuse(
            "node_position",
            outside,
            state.step,
            "lies behind a wall",
            f"{_SHORTER}, or a smaller hydrodynamics.node_spacing",
        )
    areas = membrane_areas(state.node_position, layout.offsets, order)
    error = areas / layout.reference_area - 1
    if (np.abs(error) > LARGEST_AREA_ERROR).any():
        _refuse(
            "area",
            np.abs(error) > LARGEST_AREA_ERROR,
            state.step,
            f"has changed by more than {LARGEST_AREA_ERROR:.0%}",
            f"{_SHORTER}, membrane.area_correction 'flux', or a larger membrane.area_restoring",
        )
    _check_film(film_thickness, contact_range, node_spacing, regularisation, state.step)


def check_finite(state: State) -> None:
    """Raise when anything in a state is not finite, what the stepper remembers included.

    Raises
    ------
    NumericalError
        Naming the field and the first component of it.
    """
    finite = np.isfinite(state.vector)
    if not finite.all():
        field, index = located(state, int(np.argmin(finite)))
        raise NumericalError(field, index, state.step, f"is not finite; {_SHORTER}")
    # A stepper may look at these many steps later, or compare with them, which hides a NaN.
    for field, part in state.parts.items():
        finite = np.isfinite(np.atleast_1d(part))
        if not finite.all():
            raise NumericalError(
                field, int(np.argmin(finite)), state.step, "is not finite; resume from a checkpoint"
            )


_SHORTER = "use a smaller time_stepping.step ('euler') or time_stepping.tolerance ('rkc2')"


def located(state: State, index: int) -> tuple[str, int]:
    """Return the array of a state, and the row in it, that a component of its vector belongs to."""
    ends = {
        "node_position": 2 * state.particle_nodes,
        "tether": 2 * state.particle_nodes + 4 * state.wall_nodes,
        "wall_displacement": state.vector.size - 2,
        "wall_speed": state.vector.size,
    }
    start = 0
    for name, end in ends.items():
        if index < end:
            return name, (index - start) // (1 if name.startswith("wall") else 2)
        start = end
    raise IndexError(f"A state of {state.vector.size} numbers has none with index {index}.")


def named(error: NumericalError, state: State) -> NumericalError:
    """Return a stepper's error about a component of a vector as one about an array of the state."""
    field, index = error.field, error.index
    if field == "state":
        field, index = located(state, index)
    return NumericalError(field, index, state.step, error.message)


def _check_film(
    film: float, contact_range: float, node_spacing: float, regularisation: float, step: int
) -> None:
    # Written so that NaN counts as too thin.
    if not film >= SMALLEST_FILM * contact_range:
        raise _too_thin(
            film,
            step,
            f"{SMALLEST_FILM:g} steric.length, membranes are about to cross",
            "a smaller hydrodynamics.node_spacing, a larger steric.energy, or a smaller "
            "time_stepping.step ('euler')",
        )
    if not film >= LEAST_SPACINGS * node_spacing:
        raise _too_thin(
            film,
            step,
            f"{LEAST_SPACINGS:g} of the distance between nodes, between which it collapses",
            "a hydrodynamics.node_spacing smaller by a fifth or more",
        )
    if not film >= THINNEST_FILM * regularisation:
        raise _too_thin(
            film,
            step,
            f"{THINNEST_FILM:.3g} regularisation lengths, over which its flow is smeared",
            "a smaller hydrodynamics.regularisation ('ewald'), a finer hydrodynamics.resolution "
            "('grid'), or a larger steric.energy or steric.length",
        )


def _too_thin(film: float, step: int, limit: str, remedy: str) -> NumericalError:
    return NumericalError("film_thickness", 0, step, f"{film:.3g} is below {limit}; use {remedy}")


def check_forces(forces: FloatArray, step: int) -> None:
    """Raise when a force on the fluid is not a number.

    Parameters
    ----------
    forces
        Of all nodes, shape (nodes, 2).
    step
        Number of the step, for the message.

    Raises
    ------
    NumericalError
        Naming the first node.
    """
    # One sum tells in nearly all cases; which node it is takes longer.
    if math.isfinite(float(np.sum(forces))):
        return
    lost: BoolArray = np.asarray(~np.isfinite(forces).all(axis=1))
    if lost.any():
        _refuse(
            "force",
            lost,
            step,
            "is not finite: two nodes coincide, or a number was lost",
            f"{_SHORTER}, or a smaller hydrodynamics.node_spacing",
        )


RATES = {
    "node_position": "node_velocity",
    "tether": "tether_rate",
    "wall_displacement": "wall_velocity",
    "wall_speed": "wall_acceleration",
}
"""What the rates of the arrays of a state are called."""


def check_rate(rate: FloatArray, state: State) -> None:
    """Raise when the rate of a state is not a number somewhere.

    Parameters
    ----------
    rate
        Of the state's vector.
    state
        Whose it is, for the arrays and the number of the step.

    Raises
    ------
    NumericalError
        Naming what the first such number is the rate of, see `RATES`.
    """
    if math.isfinite(float(np.sum(rate))):
        return
    finite = np.isfinite(rate)
    if not finite.all():
        field, index = located(state, int(np.argmin(finite)))
        raise NumericalError(RATES[field], index, state.step, f"is not finite; {_SHORTER}")


def check_control(wall_speed: FloatArray, velocity: FloatArray, step: int) -> None:
    """Raise when the printed control (Eq. 26) no longer has the walls in its hand.

    It asks each wall for a speed and holds its nodes to that by tethers. Once the speed it asks
    for is more than `LARGEST_SLIP` times the one that the fluid gives, the stress on the packing
    is whatever the feedback has made of it.

    Parameters
    ----------
    wall_speed
        Speeds that the control asks for, shape (2,); zero under the exact control.
    velocity
        Velocity of each wall, shape (2,).
    step
        Number of the step, for the message.

    Raises
    ------
    NumericalError
        Naming the wall.
    """
    if not wall_speed.any():
        return
    lost: BoolArray = np.abs(wall_speed - velocity) > LARGEST_SLIP * np.abs(velocity)
    lost &= wall_speed != 0.0
    if lost.any():
        _refuse(
            "wall_speed",
            lost,
            step,
            "asked for by the printed control has run away from the speed of the wall",
            "use rheometer.control 'exact'",
        )


class Rejections:
    """Counts refused trials of the latest steps of a run.

    Parameters
    ----------
    latest
        The counts of a run that resumes, oldest first.
    """

    def __init__(self, latest: Iterable[int] = ()) -> None:
        self._latest: deque[int] = deque(latest, maxlen=REJECTION_STEPS)

    @property
    def latest(self) -> tuple[int, ...]:
        """The counts of the last `REJECTION_STEPS` steps at most, oldest first."""
        return tuple(self._latest)

    def add(self, rejections: int, step: int) -> None:
        """Take note of an accepted step and the trials that were refused before it.

        Raises
        ------
        NumericalError
            When more trials were refused than accepted in the last `REJECTION_STEPS` steps.
        """
        self._latest.append(rejections)
        refused = sum(self._latest)
        if len(self._latest) == REJECTION_STEPS and refused > LARGEST_REJECTION * REJECTION_STEPS:
            raise NumericalError(
                "step_size",
                0,
                step,
                f"{refused} trial steps were refused in the last {REJECTION_STEPS} steps: the "
                "rate jumps, as it does where films are thinner than nodes are apart; use a "
                "smaller hydrodynamics.node_spacing or a larger steric.refinement",
            )
