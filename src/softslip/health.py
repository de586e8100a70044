"""Guards that stop a run whose numbers no longer mean anything."""

import numpy as np

from softslip.errors import NumericalError
from softslip.geometry import BoolArray, FloatArray, Layout
from softslip.membrane import membrane_areas
from softslip.state import State

LARGEST_MOVE = 0.5
"""Largest node displacement of one step, in contact ranges: a contact must not be jumped over."""

SMALLEST_FILM = 0.2
"""Smallest distance between nodes of two bodies, in contact ranges: the contact force there is
some 1e5 times that of a packing at rest, so that only an unresolved run comes near."""

LARGEST_AREA_ERROR = 0.05
"""Largest relative change of any particle's area."""


def _refuse(field: str, bad: BoolArray, step: int, what: str, remedy: str) -> None:
    index = int(np.flatnonzero(bad)[0])
    raise NumericalError(field, index, step, f"{what}; {remedy}")


def check_move(rate: FloatArray, time_step: float, contact_range: float, step: int) -> None:
    """Raise when a node would move too far in a step, or its velocity is not a number.

    Parameters
    ----------
    rate
        Velocities of the particle nodes, shape (nodes, 2).
    time_step
        Δt [time unit].
    contact_range
        σ_LJ [length unit].
    step
        Number of the step, for the message.

    Raises
    ------
    NumericalError
        Naming the first such node.
    """
    limit = LARGEST_MOVE * contact_range / time_step
    fine = np.abs(rate) <= limit
    if not fine.all():
        bad: BoolArray = np.logical_not(fine.all(axis=1))
        worst = np.abs(rate[int(np.flatnonzero(bad)[0])]).max()
        _refuse(
            "node_velocity",
            bad,
            step,
            f"{worst:.3g} moves the node by more than {LARGEST_MOVE:g} steric.length in a step",
            f"use a time_stepping.step well below {time_step:g}",
        )


def check_state(
    state: State,
    layout: Layout,
    reference_area: FloatArray,
    film_thickness: float,
    *,
    height: float,
    contact_range: float,
) -> None:
    """Raise when a state is not finite, leaks, has left the channel, or is about to cross.

    Parameters
    ----------
    state, layout
        What to check.
    reference_area
        Area that each particle should have, shape (particles,).
    film_thickness
        Smallest distance between nodes of two bodies [length unit].
    height
        H [length unit].
    contact_range
        σ_LJ [length unit].

    Raises
    ------
    NumericalError
        Naming field, index and step, and what to change.
    """
    finite = np.isfinite(state.vector)
    if not finite.all():
        _refuse("state", ~finite, state.step, "is not finite", "use a smaller time_stepping.step")
    heights = state.node_position[:, 1]
    outside = (heights < 0) | (heights > height)
    if outside.any():
        _refuse(
            "node_position",
            outside,
            state.step,
            "lies behind a wall",
            "use a smaller time_stepping.step or a finer hydrodynamics.node_spacing",
        )
    error = membrane_areas(state.node_position, layout.offsets) / reference_area - 1
    if (np.abs(error) > LARGEST_AREA_ERROR).any():
        _refuse(
            "area",
            np.abs(error) > LARGEST_AREA_ERROR,
            state.step,
            f"has changed by more than {LARGEST_AREA_ERROR:.0%}",
            "use a smaller time_stepping.step, or membrane.area_correction 'flux'",
        )
    if film_thickness < SMALLEST_FILM * contact_range:
        raise NumericalError(
            "film_thickness",
            0,
            state.step,
            f"{film_thickness:.3g} is below {SMALLEST_FILM:g} steric.length, membranes are about "
            "to cross; use a smaller time_stepping.step or a larger steric.energy",
        )
