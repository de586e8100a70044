"""How long a step may be: no node jumps over a contact, no film closes, few trials are refused."""

import math
from collections import deque
from collections.abc import Iterable, Mapping

import numpy as np

from softslip.errors import NumericalError
from softslip.solver.geometry import BoolArray, FloatArray
from softslip.solver.health import SHORTER_STEP, refuse

LARGEST_MOVE = 0.5
"""Largest node displacement of one step, in contact ranges: a contact must not be jumped over."""

LARGEST_CLOSING = 0.5
"""Largest part of its thickness by which a film may close in one step that adapts."""

REJECTION_STEPS, LARGEST_REJECTION = 50, 1.0
"""Steps over which refused trials are counted, and how many of them to a step end a run."""


def longest_step(
    velocities: FloatArray,
    closing_rate: float,
    contact_range: float,
    step: int,
    heights: FloatArray | None = None,
) -> float:
    """Return the longest step that moves no node over a contact and closes no film.

    Parameters are those of `longest_steps`; infinite when nothing moves [time unit].

    Raises
    ------
    NumericalError
        Naming the first node whose velocity is not a number, or the closing rate if that is none.
    """
    limits = longest_steps(velocities, closing_rate, contact_range, step, heights)
    return min(limits.values())


def longest_steps(
    velocities: FloatArray,
    closing_rate: float,
    contact_range: float,
    step: int,
    heights: FloatArray | None = None,
) -> dict[str, float]:
    """Return the longest step that the ``motion`` of the nodes allows, and the closing ``film``.

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
    dict
        In time units; infinite when nothing moves.

    Raises
    ------
    NumericalError
        Naming the first node whose velocity is not a number, or the closing rate if that is none.
    """
    lost: BoolArray = ~np.isfinite(velocities.sum(axis=1))
    if lost.any():
        refuse("node_velocity", lost, step, "is not finite", "use a smaller time_stepping.step")
    if not math.isfinite(closing_rate):
        raise NumericalError("closing_rate", 0, step, f"is {closing_rate}; {SHORTER_STEP}")
    if heights is not None and len(heights):
        velocities = _without_shear(velocities, heights)
    fastest = np.abs(velocities).max(initial=0.0) / contact_range
    return {
        name: float(share / rate) if rate > 0 else math.inf
        for name, share, rate in (
            ("motion", LARGEST_MOVE, fastest),
            ("film", LARGEST_CLOSING, closing_rate),
        )
    }


CAUSES = ("error", "film", "motion", "record", "longest", "stiffness")
"""What sets the length of a step: the accepted error, a film that closes, the motion of the nodes,
a time that steps end at, the longest step that is asked for, or the most stages there are."""


def cause_of(taken: float, limits: Mapping[str, float]) -> str:
    """Return which of some limits has set a step's length, one of `CAUSES`.

    Parameters
    ----------
    taken
        Its length [time unit].
    limits
        The length that each cause but ``stiffness`` would have allowed [time unit]. Steps up to a
        record are shortened evenly, by less than half.
    """
    least = min(limits, key=lambda name: limits[name])
    return "stiffness" if taken < 0.5 * limits[least] * (1 - 1e-9) else least


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
    refuse(
        "node_velocity",
        speeds == worst,
        step,
        f"{worst:.3g} moves the node by more than {LARGEST_MOVE:g} steric.length in a step",
        f"use a time_stepping.step well below {time_step:g}",
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
