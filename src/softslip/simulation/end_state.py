"""The state at the end of a run, from which a longer run of the same trajectory continues."""

import json
from collections.abc import Callable
from pathlib import Path

from softslip.errors import CheckpointError
from softslip.files.storage import replacing
from softslip.simulation.arrays import Arrays
from softslip.simulation.checkpoint import (
    END_SUFFIX,
    Header,
    Identity,
    checkpoint_bytes,
    read_checkpoint,
    read_header,
)


def end_state_path(folder: Path, trajectory: str, fingerprint: str) -> Path:
    """Return where the end of the longest run of a trajectory is kept.

    Parameters
    ----------
    folder
        Of the stage's checkpoints.
    trajectory
        See `config.stages.trajectory_id`.
    fingerprint
        Of the stage's code.
    """
    return folder / f"{trajectory}.{fingerprint}{END_SUFFIX}"


class EndState:
    """The checkpoint at the end of the longest run of a trajectory so far.

    A run takes it up if everything before it would have the same bits: it is of the same
    trajectory, parent, code and libraries, is no later than the run's own end, and lies before
    the time at which the run would have ended by itself. Anything else is ignored, and the run
    starts from the beginning.

    Parameters
    ----------
    folder
        Where it is.
    identity
        Of the run.
    trajectory
        See `config.stages.trajectory_id`.
    say
        Called with a sentence about what is ignored.

    Attributes
    ----------
    path
        Where it is, one file for all runs of the trajectory.
    """

    def __init__(
        self, folder: Path, identity: Identity, trajectory: str, say: Callable[[str], None]
    ) -> None:
        self.path = end_state_path(folder, trajectory, identity.fingerprint)
        self._identity, self._say = identity, say

    def load(self) -> tuple[Header, Arrays] | None:
        """Return what the run can continue, None where there is nothing of the kind."""
        if not self.path.exists():
            return None
        try:
            header, arrays = read_checkpoint(self.path)
        except CheckpointError as error:
            self._say(f"{error}; starting from the beginning")
            return None
        reason = self._unusable(header)
        if reason:
            self._say(f"{self.path.name} {reason}; starting from the beginning")
            return None
        return header, arrays

    def save(self, header: Header, arrays: Arrays) -> None:
        """Keep the end of a run in one step, unless that of a longer one is there.

        Raises
        ------
        StorageError
            When it cannot be written.
        """
        if self.path.exists():
            try:
                stored = read_header(self.path)
            except CheckpointError:
                pass  # Damaged: it is replaced.
            else:
                if not self._unlike(stored) and stored.time >= header.time:
                    return
        with replacing(self.path) as temporary:
            temporary.write_bytes(checkpoint_bytes(header, arrays))

    def _unusable(self, header: Header) -> str:
        """Return why the run cannot continue this, empty if it can."""
        if unlike := self._unlike(header):
            return f"is of another {unlike}"
        ours, theirs = (
            json.loads(identity.parameters) for identity in (self._identity, header.identity)
        )
        if header.time > ours["time_stepping"]["shear_time"]:
            return f"is at t = {header.time:g}, after the end of this run"
        # A run that was to end at a larger error, or at none, has passed by the end of this one.
        if (ours["until"]["error"] or 0.0) > (theirs["until"]["error"] or 0.0):
            return "is of a run that was to end later"
        return ""

    def _unlike(self, header: Header) -> str:
        """Return in what a stored state differs from the run, apart from its length."""
        ours, theirs = self._identity, header.identity
        names = ("stage", "parent", "fingerprint", "environment")
        return next((name for name in names if getattr(ours, name) != getattr(theirs, name)), "")
