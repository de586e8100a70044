"""When a long stage writes a checkpoint, and how it resumes from one."""

import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Protocol

from softslip.errors import CheckpointError, Interrupted
from softslip.simulation.arrays import Arrays, below, under
from softslip.simulation.checkpoint import state_from
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.simulation.interruption import Interruption
from softslip.simulation.trajectory import Effort
from softslip.solver.state import State

INTERVAL = 60.0
"""Seconds between two checkpoints."""


class Resumable(Protocol):
    """Something besides the state that a stage needs to resume."""

    def memory(self) -> Arrays:
        """Return all it knows, as arrays by name."""
        ...

    def restore(self, memory: Arrays) -> None:
        """Resume from a `memory`."""
        ...


class Checkpointer:
    """Writes checkpoints of a stage from time to time, and when a signal asks it to stop.

    Parameters
    ----------
    checkpoints
        Of the run.
    interruption
        Looked at before each step.
    interval
        Seconds from one checkpoint to the next.
    """

    def __init__(
        self,
        checkpoints: Checkpoints,
        interruption: Interruption,
        interval: float = INTERVAL,
    ) -> None:
        self._checkpoints, self._interruption = checkpoints, interruption
        self._interval, self._last = interval, time.monotonic()

    def resume(self, like: State, others: Mapping[str, Resumable]) -> tuple[State, Effort] | None:
        """Return where a stage was interrupted, None where it starts.

        Parameters
        ----------
        like
            A state of the run, for its number of nodes.
        others
            What else resumes from the checkpoint, by name.

        Raises
        ------
        CheckpointError
            When a checkpoint is of another run.
        """
        arrays = self._checkpoints.load()
        if arrays is None:
            return None
        effort = below(arrays, "effort")
        try:
            state = state_from(below(arrays, "state"), like)
            for name, other in others.items():
                other.restore(below(arrays, name))
            counts = int(effort["evaluations"]), int(effort["rejections"])
            recent, causes = (
                tuple(int(count) for count in effort[name]) for name in ("recent", "causes")
            )
        except (CheckpointError, KeyError, ValueError, IndexError) as error:
            raise CheckpointError(
                f"{self._checkpoints.source}: does not fit this run ({error}); "
                "remove the file to start again"
            ) from error
        return state, Effort(*counts, recent, causes)

    def save_if_due(
        self, state: State, effort: Effort, end: float, others: Mapping[str, Resumable]
    ) -> None:
        """Write a checkpoint if one is due, and stop if a signal has come.

        Parameters
        ----------
        state, effort
            Where the stage is.
        end
            Time at which it ends [time unit].
        others
            See `resume`.

        Raises
        ------
        Interrupted
            After a signal, with the checkpoint written.
        StorageError
            When it cannot be written.
        """
        now = time.monotonic()
        if not self._interruption.name and now - self._last < self._interval:
            return
        self._checkpoints.save(_arrays(state, effort, others), state, end)
        self._last = now
        if self._interruption.name:
            raise Interrupted(
                f"by {self._interruption.name} at t = {state.time:g} of {end:g}; "
                "rerun the same command to resume"
            )

    def save_end(self, state: State, effort: Effort, others: Mapping[str, Resumable]) -> None:
        """Keep where the stage ended, for a longer run; parameters as for `save_if_due`.

        Raises
        ------
        StorageError
            When it cannot be written.
        """
        self._checkpoints.save_end(_arrays(state, effort, others), state)


def _arrays(state: State, effort: Effort, others: Mapping[str, Resumable]) -> Arrays:
    """Return all that is needed to resume, as arrays by name."""
    arrays = under("state", state.parts) | under("effort", asdict(effort))
    for name, other in others.items():
        arrays |= under(name, other.memory())
    return arrays
