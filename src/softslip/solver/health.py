"""Guards that stop a run whose numbers no longer mean anything."""

import math
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.crossing import check_crossing
from softslip.solver.geometry import BoolArray, FloatArray, Layout
from softslip.solver.membrane import membrane_areas
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation

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

LARGEST_SLIP = 0.5
"""Largest difference of the printed control's wall speed from the fluid's, relative."""

SHORTER_STEP = "use a smaller time_stepping.step ('euler') or time_stepping.tolerance (others)"
"""What may help where a number was lost."""


def refuse(field: str, bad: BoolArray, step: int, what: str, remedy: str) -> NoReturn:
    """Raise an error about the first bad row of a field; ``what`` is wrong, and a remedy."""
    index = int(np.flatnonzero(bad)[0])
    raise NumericalError(field, index, step, f"{what}; {remedy}")


@dataclass(frozen=True)
class Guard:
    """Stops a run whose state, or what was computed from it, no longer means anything.

    Attributes
    ----------
    layout
        The run's nodes.
    length, height
        Period L_x and distance H of the walls' flat parts [length unit].
    order
        Of the areas, see `solver.membrane.membrane_areas`.
    contact_range
        σ_LJ [length unit].
    regularisation
        ε [length unit].
    node_spacing
        Largest distance Δs between the nodes of a membrane at rest [length unit].
    """

    layout: Layout
    length: float
    height: float
    order: int
    contact_range: float
    regularisation: float = 0.0
    node_spacing: float = 0.0

    def check(self, state: State, evaluation: Evaluation) -> None:
        """Raise when a state or its evaluation is unsound, or membranes cross.

        Raises
        ------
        NumericalError
            Naming field, index and step, and what to change.
        """
        self.check_state(state, evaluation.film_thickness)
        check_forces(evaluation.forces, state.step)
        check_rate(evaluation.rate, state)
        check_control(state.wall_speed, evaluation.wall_velocity, state.step)
        film = evaluation.film_thickness
        check_crossing(evaluation.positions, self.layout, self.length, film, state.step)

    def check_state(self, state: State, film_thickness: float) -> None:
        """Raise when a state is not finite, leaks, has left the channel, or is about to cross.

        Parameters
        ----------
        state
            What to check.
        film_thickness
            Smallest distance between contact points of two bodies [length unit].

        Raises
        ------
        NumericalError
            Naming field, index and step, and what to change.
        """
        check_finite(state)
        heights = state.node_position[:, 1]
        outside = (heights < 0) | (heights > self.height)
        if outside.any():
            refuse(
                "node_position",
                outside,
                state.step,
                "lies behind a wall",
                f"{SHORTER_STEP}, or a smaller hydrodynamics.node_spacing",
            )
        areas = membrane_areas(state.node_position, self.layout.offsets, self.order)
        error = np.abs(areas / self.layout.reference_area - 1)
        if (error > LARGEST_AREA_ERROR).any():
            refuse(
                "area",
                error > LARGEST_AREA_ERROR,
                state.step,
                f"has changed by more than {LARGEST_AREA_ERROR:.0%}",
                f"{SHORTER_STEP}, membrane.area_correction 'flux', or a larger "
                "membrane.area_restoring",
            )
        self._check_film(film_thickness, state.step)

    def _check_film(self, film: float, step: int) -> None:
        # Written so that NaN counts as too thin.
        if not film >= SMALLEST_FILM * self.contact_range:
            raise _too_thin(
                film,
                step,
                f"{SMALLEST_FILM:g} steric.length, membranes are about to cross",
                "a smaller hydrodynamics.node_spacing, a larger steric.energy, or a smaller "
                "time_stepping.step ('euler')",
            )
        if not film >= LEAST_SPACINGS * self.node_spacing:
            raise _too_thin(
                film,
                step,
                f"{LEAST_SPACINGS:g} of the distance between nodes, between which it collapses",
                "a hydrodynamics.node_spacing smaller by a fifth or more",
            )
        if not film >= THINNEST_FILM * self.regularisation:
            raise _too_thin(
                film,
                step,
                f"{THINNEST_FILM:.3g} regularisation lengths, over which its flow is smeared",
                "a smaller hydrodynamics.regularisation ('ewald'), a finer "
                "hydrodynamics.resolution ('grid'), or a larger steric.energy or steric.length",
            )


def _too_thin(film: float, step: int, limit: str, remedy: str) -> NumericalError:
    return NumericalError("film_thickness", 0, step, f"{film:.3g} is below {limit}; use {remedy}")


def check_finite(state: State) -> None:
    """Raise when anything in a state is not finite, what the stepper remembers included.

    Raises
    ------
    NumericalError
        Naming the field and the first component of it.
    """
    finite = np.isfinite(state.vector)
    if not finite.all():
        field, index = state.located(int(np.argmin(finite)))
        raise NumericalError(field, index, state.step, f"is not finite; {SHORTER_STEP}")
    # A stepper may look at these many steps later, or compare with them, which hides a NaN.
    for field, part in state.parts.items():
        finite = np.isfinite(np.atleast_1d(part))
        if not finite.all():
            raise NumericalError(
                field, int(np.argmin(finite)), state.step, "is not finite; resume from a checkpoint"
            )


def named(error: NumericalError, state: State) -> NumericalError:
    """Return a stepper's error about a component of a vector as one about an array of the state."""
    field, index = error.field, error.index
    if field == "state":
        field, index = state.located(index)
    return NumericalError(field, index, state.step, error.message)


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
        refuse(
            "force",
            lost,
            step,
            "is not finite: two nodes coincide, or a number was lost",
            f"{SHORTER_STEP}, or a smaller hydrodynamics.node_spacing",
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
        field, index = state.located(int(np.argmin(finite)))
        raise NumericalError(RATES[field], index, state.step, f"is not finite; {SHORTER_STEP}")


def check_control(wall_speed: FloatArray, velocity: FloatArray, step: int) -> None:
    """Raise when the printed control (Eq. 26) no longer governs the walls.

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
        refuse(
            "wall_speed",
            lost,
            step,
            "asked for by the printed control has run away from the speed of the wall",
            "use rheometer.control 'exact'",
        )
