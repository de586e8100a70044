"""Records of failed runs: written by the process that fails, read by `operations.scenario_status`.

A record lies beside the lock of its run, ``RUN.failure.json``, from the moment of the failure until
the run is rerun.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from softslip.errors import Interrupted, NumericalError, StorageError
from softslip.files.storage import replacing

FAILURE_SUFFIX = ".failure.json"


@dataclass(frozen=True)
class Failure:
    """Why a run failed.

    Attributes
    ----------
    error
        Type of the error.
    message
        Its text, which may have several lines.
    field, index, step
        Where a `NumericalError` was seen; None for others.
    failed_at
        UTC time of the failure, ISO 8601.
    """

    error: str
    message: str
    field: str | None = None
    index: int | None = None
    step: int | None = None
    failed_at: str | None = None

    def __str__(self) -> str:
        """Return the error as a command prints it, on one line."""
        text = " ".join(self.message.split())
        return f"{self.error}: {text}" if text else self.error


def failure_path(folder: Path, run: str) -> Path:
    """Return the file with the failure of a run."""
    return folder / f"{run}{FAILURE_SUFFIX}"


@contextmanager
def failure_recorded(folder: Path, run: str) -> Iterator[None]:
    """Record the error that ends the block; the record of an earlier attempt is removed first.

    A run that a signal interrupted has not failed. The lock of the run must be held.

    Parameters
    ----------
    folder
        Where the lock of the run is.
    run
        Name of the run.
    """
    path = failure_path(folder, run)
    path.unlink(missing_ok=True)
    try:
        yield
    except Interrupted:
        raise
    except Exception as error:
        failure = _failure(error)
        # On a full disk there is no record, and the error itself must still be seen.
        with suppress(StorageError, OSError), replacing(path) as temporary:
            temporary.write_text(json.dumps(asdict(failure)) + "\n")
        raise


def _failure(error: Exception) -> Failure:
    name, now = type(error).__name__, datetime.now(UTC).isoformat(timespec="seconds")
    if isinstance(error, NumericalError):
        index, step = int(error.index), int(error.step)
        return Failure(name, str(error), error.field, index, step, now)
    return Failure(name, str(error), failed_at=now)


def read_failure(path: Path) -> Failure | None:
    """Return why a run failed, None where the record is gone: a rerun has begun."""
    try:
        record = json.loads(path.read_bytes())
        return Failure(**{name: record[name] for name in Failure.__dataclass_fields__})
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, LookupError):
        return Failure("Failure", f"{path.name} cannot be read")
