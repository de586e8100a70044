"""Checkpoints: all that a stage needs to resume, in files that are whole or refused.

A checkpoint is one line with the format's version and the SHA-256 of the next line; a line of JSON
that says what it is of, with the SHA-256 of the rest; and the arrays in NumPy's own format, which
are read without pickle. Two generations are kept, each replaced in one step.
"""

import hashlib
import io
import json
import math
import os
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from softslip.errors import CheckpointError
from softslip.files.storage import replacing
from softslip.simulation.arrays import Arrays
from softslip.solver.state import PARTS, State

SUFFIX = ".checkpoint"

_MAGIC = "softslip-checkpoint"
_SCHEMA = 1
"""To be raised with every change of what is kept or how: fingerprints leave that code out."""


@dataclass(frozen=True)
class Identity:
    """What a stage's results depend on.

    Attributes
    ----------
    stage, run
        The stage and the identity of its run.
    parent
        SHA-256 of what the stage began with.
    fingerprint
        Of the stage's code.
    environment
        Python and the libraries that compute, with their versions.
    parameters
        Of the run, as a JSON object.
    """

    stage: str
    run: str
    parent: str
    fingerprint: str
    environment: str
    parameters: str


@dataclass(frozen=True)
class Header:
    """What a checkpoint says of itself without its arrays.

    Attributes
    ----------
    time, end
        Time of the state and of the end of the stage [time unit].
    step
        Steps since the stage began.
    seconds, core_seconds
        Wall-clock and processor time of work so far.
    restarts
        How often the stage had resumed before.
    written
        POSIX time of writing.
    identity
        Of the run that it belongs to.
    """

    time: float
    end: float
    step: int
    seconds: float
    core_seconds: float
    restarts: int
    written: float
    identity: Identity

    @property
    def stage(self) -> str:
        """The stage that it is of."""
        return self.identity.stage

    @property
    def run(self) -> str:
        """The run that it is of."""
        return self.identity.run

    @property
    def fingerprint(self) -> str:
        """That of the code that it is of."""
        return self.identity.fingerprint


def read_header(path: Path) -> Header:
    """Return what a checkpoint says of itself; its arrays are not looked at.

    Raises
    ------
    CheckpointError
        When it cannot be read, is damaged, or is of another format.
    """
    with _opened(path) as file:
        return _header(path, file)[0]


class Checkpoints:
    """The two generations of checkpoints of one run of a stage.

    Parameters
    ----------
    folder
        Where they are.
    identity
        What they must be of.
    say
        Told, in a sentence, what a person should know.
    required
        Whether there must be one to resume from.
    """

    def __init__(
        self,
        folder: Path,
        identity: Identity,
        say: Callable[[str], None],
        required: bool = False,
    ) -> None:
        stem = f"{identity.run}.{identity.fingerprint}"
        self.newest = folder / f"{stem}{SUFFIX}"
        self.previous = folder / f"{stem}.previous{SUFFIX}"
        self._identity, self._say, self._required = identity, say, required
        self._started, self._seconds = time.monotonic(), 0.0
        self._core_seconds, self._restarts = 0.0, 0

    def load(self) -> Arrays | None:
        """Return the arrays of the newest sound checkpoint, None where there is none.

        A damaged one is removed, so that it never takes the place of a sound one. One that began
        with another parent is ignored: the parent has been rerun since.

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
                header, arrays = _read(path)
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
            self._seconds, self._core_seconds = header.seconds, header.core_seconds
            self._restarts = header.restarts + 1
            self._say(f"resuming from {path.name}: t = {header.time:g} of {header.end:g}")
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
        header = Header(
            time=state.time,
            end=end,
            step=state.step,
            seconds=self._seconds + time.monotonic() - self._started,
            core_seconds=self.core_seconds,
            restarts=self._restarts,
            written=time.time(),
            identity=self._identity,
        )
        content = _content(header, arrays)
        with replacing(self.newest) as temporary:
            with temporary.open("wb") as file:
                file.write(content)
                file.flush()
                # The generation before gives way only to one that is safe.
                os.fsync(file.fileno())
            if self.newest.exists():
                self.newest.replace(self.previous)

    def finish(self) -> None:
        """Remove all but the newest generation, of a run whose result is written.

        Whoever started the run may have died meanwhile. Then Snakemake, started again, takes the
        result for incomplete, removes it and asks for it anew: little of it is done twice.
        """
        if self.newest.exists():
            self.previous.unlink(missing_ok=True)

    def _is_of_another_parent(self, found: Identity) -> bool:
        """Return whether a checkpoint is of this very run before its parent was rerun."""
        ours = self._identity
        like = replace(found, parent=ours.parent, parameters=ours.parameters)
        return like == ours and found.parent != ours.parent and not self._required

    @property
    def core_seconds(self) -> float:
        """Processor time of work so far, of earlier attempts up to their last checkpoint."""
        return self._core_seconds + time.process_time()

    @property
    def restarts(self) -> int:
        """How often the stage has resumed."""
        return self._restarts


def check_identity(path: Path, found: Identity, wanted: Identity) -> None:
    """Refuse a checkpoint of something else.

    Raises
    ------
    CheckpointError
        Naming the first key that differs, parameters by their paths.
    """
    ours, theirs = asdict(wanted), asdict(found)
    if ours["run"] != theirs["run"]:
        for key, value in _leaves(json.loads(ours["parameters"])).items():
            other = _leaves(json.loads(theirs["parameters"])).get(key)
            if other != value:
                raise _mismatch(path, key, other, value)
    # Parameters that the stage does not depend on, and are no part of the run's name, may differ.
    for key in ("stage", "run", "parent", "fingerprint", "environment"):
        if ours[key] != theirs[key]:
            raise _mismatch(path, key, theirs[key], ours[key])


def _mismatch(path: Path, key: str, found: object, wanted: object) -> CheckpointError:
    return CheckpointError(
        f"{path}: {key} is {found!r}, but this run has {wanted!r}; remove the file to begin again"
    )


def _leaves(tree: Any, path: str = "") -> dict[str, Any]:
    if not isinstance(tree, dict):
        return {path: tree}
    found: dict[str, Any] = {}
    for key, value in tree.items():
        found |= _leaves(value, f"{path}.{key}" if path else str(key))
    return found


def _content(header: Header, arrays: Arrays) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    rest = buffer.getvalue()
    words = asdict(header) | {"arrays": hashlib.sha256(rest).hexdigest()}
    line = json.dumps(words, sort_keys=True).encode()
    first = f"{_MAGIC} {_SCHEMA} {hashlib.sha256(line).hexdigest()}".encode()
    return b"\n".join((first, line, rest))


@contextmanager
def _opened(path: Path) -> Iterator[io.BufferedReader]:
    """Open a file, with what the system says against it in one sentence."""
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise CheckpointError(f"{path}: cannot be read ({error.strerror})") from error


def _header(path: Path, file: io.BufferedReader) -> tuple[Header, str]:
    """Return the header and the SHA-256 that the rest must have."""
    first, line = file.readline(200).split(), file.readline(1 << 20).rstrip(b"\n")
    if len(first) != 3 or first[0] != _MAGIC.encode():
        raise CheckpointError(f"{path}: is no checkpoint, or damaged")
    if first[1] != str(_SCHEMA).encode():
        raise CheckpointError(
            f"{path}: has schema {first[1].decode(errors='replace')!r}, not {_SCHEMA}"
        )
    if hashlib.sha256(line).hexdigest().encode() != first[2]:
        raise CheckpointError(f"{path}: is damaged (its header does not have its digest)")
    words = json.loads(line)
    digest = words.pop("arrays")
    return Header(**words | {"identity": Identity(**words["identity"])}), str(digest)


def _read(path: Path) -> tuple[Header, Arrays]:
    with _opened(path) as file:
        header, digest = _header(path, file)
        rest = file.read()
    if hashlib.sha256(rest).hexdigest() != digest:
        raise CheckpointError(f"{path}: is damaged (its arrays do not have their digest)")
    try:
        with np.load(io.BytesIO(rest), allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    except (ValueError, EOFError, zipfile.BadZipFile, KeyError) as error:
        raise CheckpointError(f"{path}: holds no arrays ({error})") from error
    for name, array in arrays.items():
        # A part in no format of NumPy's comes as it is.
        if not isinstance(array, np.ndarray):
            raise CheckpointError(f"{path}: holds no arrays ({name} is none)")
    return header, arrays


def state_from(arrays: Arrays, like: State) -> State:
    """Return the state that has given `State.parts`.

    Parameters
    ----------
    arrays
        Of a checkpoint.
    like
        A state of the same run, for its number of nodes.

    Raises
    ------
    CheckpointError
        Naming what is missing, has another type or shape, or lies out of range.
    """
    for name, dtype in PARTS.items():
        if name not in arrays:
            raise CheckpointError(f"state: {name} is missing")
        if arrays[name].dtype != dtype:
            raise CheckpointError(f"state: {name} is of type {arrays[name].dtype}")
    for name in ("particle_nodes", "wall_nodes"):
        wanted = getattr(like, name)
        if arrays[name].shape or int(arrays[name]) != wanted:
            raise CheckpointError(f"state: {name} is {arrays[name]}, but this run has {wanted}")
    vector, direction = arrays["vector"], arrays["direction"]
    if vector.shape != like.vector.shape or direction.shape not in ((0,), vector.shape):
        raise CheckpointError(
            f"state: vector has shape {vector.shape}, direction {direction.shape}, "
            f"but this run has {like.vector.shape}"
        )
    for name in PARTS:
        part = arrays[name]
        if name in ("vector", "direction"):
            if not np.isfinite(part).all():
                raise CheckpointError(f"state: {name} is not finite")
        elif part.shape or not (math.isfinite(part) and part >= 0):
            raise CheckpointError(f"state: {name} is {part}, not a number from 0 on")
    return State.of_parts({name: arrays[name] for name in PARTS})
