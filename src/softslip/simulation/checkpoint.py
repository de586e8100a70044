"""Checkpoints: all that a stage needs to resume, in files that are whole or refused.

A checkpoint is one line with the format's version and the SHA-256 of the next line; a line of JSON
that says what it is of, with the SHA-256 of the rest; and the arrays in NumPy's own format, which
are read without pickle.
"""

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from softslip.errors import CheckpointError
from softslip.simulation.arrays import Arrays
from softslip.solver.state import PARTS, State

SUFFIX = ".checkpoint"

END_SUFFIX = ".end.checkpoint"
"""Of the states at the ends of runs, which longer runs continue."""

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
        SHA-256 of the result that the stage starts from.
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
        Steps since the start of the stage.
    seconds, core_seconds
        Wall-clock and processor time of work so far.
    restarts
        How often the stage had resumed.
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


def read_header(path: Path) -> Header:
    """Return what a checkpoint says of itself; its arrays are not looked at.

    Raises
    ------
    CheckpointError
        When it cannot be read, is damaged, or is of another format.
    """
    with _opened(path) as file:
        return _header(path, file)[0]


def checkpoint_bytes(header: Header, arrays: Arrays) -> bytes:
    """Return the bytes of a checkpoint."""
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    rest = buffer.getvalue()
    entries = asdict(header) | {"arrays": hashlib.sha256(rest).hexdigest()}
    line = json.dumps(entries, sort_keys=True).encode()
    first = f"{_MAGIC} {_SCHEMA} {hashlib.sha256(line).hexdigest()}".encode()
    return b"\n".join((first, line, rest))


@contextmanager
def _opened(path: Path) -> Iterator[io.BufferedReader]:
    """Open a file; errors of the system become one sentence."""
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
    entries = json.loads(line)
    digest = entries.pop("arrays")
    return Header(**entries | {"identity": Identity(**entries["identity"])}), str(digest)


def read_checkpoint(path: Path) -> tuple[Header, Arrays]:
    """Return what a checkpoint says of itself, and its arrays.

    Raises
    ------
    CheckpointError
        When it cannot be read, is damaged, or is of another format.
    """
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
        # NumPy returns the bytes of an entry that is not in its format.
        if not isinstance(array, np.ndarray):
            raise CheckpointError(f"{path}: holds no arrays ({name} is none)")
    return header, arrays


def state_from(arrays: Arrays, like: State) -> State:
    """Return the state with the `State.parts` that a checkpoint holds.

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
        count = getattr(like, name)
        if arrays[name].shape or int(arrays[name]) != count:
            raise CheckpointError(f"state: {name} is {arrays[name]}, but this run has {count}")
    shapes = {name: arrays[name].shape for name in ("vector", "direction", "drift")}
    whole = like.vector.shape
    if shapes["vector"] != whole or not set(shapes.values()) <= {whole, (0,)}:
        found = {name: f"{name} {shape}" for name, shape in shapes.items()}
        found["vector"] = f"vector has shape {shapes['vector']}"
        said = ", ".join(found.values())
        raise CheckpointError(f"state: {said}, but this run has {whole}")
    for name in PARTS:
        part = arrays[name]
        if name in shapes:
            if not np.isfinite(part).all():
                raise CheckpointError(f"state: {name} is not finite")
        elif part.shape or not (math.isfinite(part) and part >= 0):
            raise CheckpointError(f"state: {name} is {part}, not a number from 0 on")
    return State.of_parts({name: arrays[name] for name in PARTS})
