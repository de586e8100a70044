"""The two generations of checkpoints of a run, each replaced in one step."""

import json
import os
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from softslip.errors import CheckpointError
from softslip.files.storage import replacing
from softslip.simulation.arrays import Arrays
from softslip.simulation.checkpoint import (
    SUFFIX,
    Header,
    Identity,
    checkpoint_bytes,
    read_checkpoint,
)
from softslip.simulation.end_state import EndState
from softslip.solver.state import State


class Checkpoints:
    """The two generations of checkpoints of one run of a stage.

    Parameters
    ----------
    folder
        Where they are.
    identity
        What they must be of.
    say
        Called with a sentence about what is resumed, removed or ignored.
    required
        Whether there must be one to resume from.
    end_state
        What the run continues where it has none itself.

    Attributes
    ----------
    newest, previous
        Where the generations are.
    source
        The one that was resumed from; the newest where there was none.
    """

    def __init__(
        self,
        folder: Path,
        identity: Identity,
        say: Callable[[str], None],
        required: bool = False,
        end_state: EndState | None = None,
    ) -> None:
        stem = f"{identity.run}.{identity.fingerprint}"
        self.newest = folder / f"{stem}{SUFFIX}"
        self.previous = folder / f"{stem}.previous{SUFFIX}"
        self.source = self.newest
        self._identity, self._say, self._required = identity, say, required
        self._end_state = end_state
        self._started, self._seconds = time.monotonic(), 0.0
        self._core_seconds, self._restarts = 0.0, 0

    def load(self) -> Arrays | None:
        """Return the arrays of the newest sound checkpoint, None where there is none.

        A damaged one is removed, so that it never takes the place of a sound one. One that started
        from another parent is ignored: the parent has been rerun since.

        Raises
        ------
        CheckpointError
            When a sound one is of something else than this run, or one is required and there is
            none.
        """
        for path in (self.newest, self.previous):
            if not path.exists():
                continue
            try:
                header, arrays = read_checkpoint(path)
            except CheckpointError as error:
                self._say(f"{error}; it is removed")
                path.unlink(missing_ok=True)
                continue
            if self._is_of_another_parent(header.identity):
                self._say(
                    f"{path.name} continues an earlier result of the stage before; starting again"
                )
                return None
            check_identity(path, header.identity, self._identity)
            self._say(f"resuming from {path.name}: t = {header.time:g} of {header.end:g}")
            self._take_up(header, path)
            return arrays
        if self._end_state and (found := self._end_state.load()):
            header, arrays = found
            path = self._end_state.path
            self._say(f"continuing a shorter run from {path.name}: t = {header.time:g}")
            self._take_up(header, path)
            return arrays
        if self._required:
            raise CheckpointError(
                f"{self.newest}: there is no undamaged checkpoint; run without --resume to start"
            )
        return None

    def save(self, arrays: Arrays, state: State, end: float) -> None:
        """Write a new generation in one step; the one before becomes the previous.

        Parameters
        ----------
        arrays
            All that is needed to resume.
        state
            The state among them, for its time and step.
        end
            Time at which the stage ends [time unit].

        Raises
        ------
        StorageError
            When it cannot be written; what was there before is still there.
        """
        content = checkpoint_bytes(self._header(state, end), arrays)
        with replacing(self.newest) as temporary:
            with temporary.open("wb") as file:
                file.write(content)
                file.flush()
                # The previous generation is replaced only by one that is on the disk.
                os.fsync(file.fileno())
            if self.newest.exists():
                self.newest.replace(self.previous)

    def save_end(self, arrays: Arrays, state: State) -> None:
        """Keep the state at the end of the run, so that a longer one can continue it.

        Raises
        ------
        StorageError
            When it cannot be written.
        """
        if self._end_state:
            self._end_state.save(self._header(state, state.time), arrays)

    def _header(self, state: State, end: float) -> Header:
        return Header(
            time=state.time,
            end=end,
            step=state.step,
            seconds=self._seconds + time.monotonic() - self._started,
            core_seconds=self.core_seconds,
            restarts=self._restarts,
            written=time.time(),
            identity=self._identity,
        )

    def _take_up(self, header: Header, path: Path) -> None:
        """Count the work before a checkpoint as that of this run."""
        self._seconds, self._core_seconds = header.seconds, header.core_seconds
        self._restarts, self.source = header.restarts + 1, path

    def finish(self) -> None:
        """Remove all but the newest generation, of a run whose result is written.

        If Snakemake was killed meanwhile, it takes the result for incomplete when it is started
        again, and reruns the stage: from the newest checkpoint, little is computed twice.
        """
        if self.newest.exists():
            self.previous.unlink(missing_ok=True)

    def _is_of_another_parent(self, stored: Identity) -> bool:
        """Return whether a checkpoint is of this very run before its parent was rerun."""
        ours = self._identity
        like = replace(stored, parent=ours.parent, parameters=ours.parameters)
        return like == ours and stored.parent != ours.parent and not self._required

    @property
    def core_seconds(self) -> float:
        """Processor time of work so far, of earlier attempts up to their last checkpoint."""
        return self._core_seconds + time.process_time()

    @property
    def restarts(self) -> int:
        """How often the stage has resumed."""
        return self._restarts


def check_identity(path: Path, stored: Identity, expected: Identity) -> None:
    """Refuse a checkpoint of something else.

    Raises
    ------
    CheckpointError
        Naming the first key that differs, parameters by their paths.
    """
    ours, theirs = asdict(expected), asdict(stored)
    if ours["run"] != theirs["run"]:
        for key, value in _leaves(json.loads(ours["parameters"])).items():
            other = _leaves(json.loads(theirs["parameters"])).get(key)
            if other != value:
                raise _mismatch(path, key, other, value)
    # Parameters that the stage does not depend on, and are no part of the run's name, may differ.
    for key in ("stage", "run", "parent", "fingerprint", "environment"):
        if ours[key] != theirs[key]:
            raise _mismatch(path, key, theirs[key], ours[key])


def _mismatch(path: Path, key: str, stored: object, expected: object) -> CheckpointError:
    return CheckpointError(
        f"{path}: {key} is {stored!r}, but this run has {expected!r}; "
        "remove the file to start again"
    )


def _leaves(tree: Any, path: str = "") -> dict[str, Any]:
    if not isinstance(tree, dict):
        return {path: tree}
    leaves: dict[str, Any] = {}
    for key, value in tree.items():
        leaves |= _leaves(value, f"{path}.{key}" if path else str(key))
    return leaves
