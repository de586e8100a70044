"""Guards that stop a run whose numbers no longer mean anything."""

import numpy as np

from softslip.errors import NumericalError
from softslip.geometry import BoolArray, FloatArray, Layout
from softslip.membrane import membrane_areas
from softslip.state import State

LARGEST_MOVE = 0.5
"""Largest node displacement of one step, in contact ranges: a contact must not be jumped over."""

LARGEST_CLOSING = 0.5
"""Largest part of its thickness by which a film may close in one step that adapts."""

SMALLEST_FILM = 0.2
"""Smallest distance between nodes of two bodies, in contact ranges: the contact force there is
some 1e5 times that of a packing at rest, so that only an unresolved run comes near."""

LARGEST_AREA_ERROR = 0.05
"""Largest relative change of any particle's area."""


def _refuse(field: str, bad: BoolArray, step: int, what: str, remedy: str) -> None:
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
        Naming the first node whose velocity is not a number.
    """
    lost: BoolArray = ~np.isfinite(velocities.sum(axis=1))
    if lost.any():
        _refuse("node_velocity", lost, step, "is not finite", "use a smaller time_stepping.step")
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
) -> None:
    """Raise when a state is not finite, leaks, has left the channel, or is about to cross.

    Parameters
    ----------
    state, layout
        What to check.
    film_thickness
        Smallest distance between nodes of two bodies [length unit].
    order
        Of the areas, see `softslip.membrane.membrane_areas`.
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
            "use a smaller time_stepping.step or hydrodynamics.node_spacing",
        )
    areas = membrane_areas(state.node_position, layout.offsets, order)
    error = areas / layout.reference_area - 1
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
