"""What a command inherits from whoever calls it, and its results must not depend on.

Notebooks, terminals, schedulers and package managers set variables that the libraries below read:
some change the last digits of results, others keep a library from being imported. None of them is a
setting of softslip, so that commands do without them. What Python itself has read by then is put
right too: how it warns, in which encoding it writes, and whether its standard streams are open.
"""

import errno
import os
import sys
import warnings
from collections.abc import Mapping, MutableMapping
from importlib.util import find_spec
from pathlib import Path
from typing import IO

from softslip.errors import ConfigError

FAMILIES = (
    *("BLIS_", "GOMP_", "GOTO_", "KMP_", "MKL_", "OMP_", "OPENBLAS_"),  # linear algebra
    *("LLVMLITE_", "NPY_", "NUMBA_", "NUMPY_", "PANDAS_", "PYFFTW_", "SCIPY_"),
    *("HDF5_", "LAMMPS", "MPLBACKEND", "MATPLOTLIBRC", "SOURCE_DATE_EPOCH", "PSUTIL_DEBUG"),
    *("FI_", "HYDI_", "HYDRA_", "MPICH_", "MPIR_", "OMPI_", "UCX_"),  # MPI, of which LAMMPS is one
    *("PILLOW_", "PYDANTIC_", "RUAMEL_", "YAMLDEBUG", "UNICODE_VERSION"),
    *("_SOFTSLIP_", "_TYPER", "TYPER_", "TERMINAL_WIDTH", "JUPYTER_COLUMNS", "JUPYTER_LINES"),
)
"""Beginnings of the variables that are withheld from the libraries that read them."""

KEPT = {
    "HDF5_USE_FILE_LOCKING": ("0", "1", "BEST_EFFORT", "FALSE", "TRUE"),
    "NUMBA_BOUNDSCHECK": ("0", "1"),
    "NUMBA_CACHE_DIR": None,
    "OPENBLAS_CORETYPE": None,
    "OPENBLAS_L2_SIZE": None,
}
"""Those among them that are left alone, if they have one of these values: where files cannot be
locked, what developers look for errors with, where compiled functions are stored, and for which
processor linear algebra is done, which administrators of virtual machines have to set."""

COMPLETION = "_SOFTSLIP_COMPLETE"
"""By what a shell asks for the words that may follow in a line, instead of the command itself."""

COMPLETED = {
    "complete_bash": ("COMP_WORDS", "COMP_CWORD"),
    "complete_zsh": ("_TYPER_COMPLETE_ARGS",),
    "complete_fish": ("_TYPER_COMPLETE_ARGS", "_TYPER_COMPLETE_FISH_ACTION"),
    "complete_powershell": ("_TYPER_COMPLETE_ARGS", "_TYPER_COMPLETE_WORD_TO_COMPLETE"),
}
"""Its values, and the variables by which that shell says what the line is so far."""

NUMBA_SETTINGS = ".numba_config.yaml"
"""File of the current folder that numba takes settings from when it is imported."""

QUIET = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)
"""Warnings for developers, which Python does not show by itself."""


def put_right() -> None:
    """Make this process independent of what it has inherited; to be called before all else."""
    _open_streams()
    withhold(os.environ)
    for stream in (sys.stdout, sys.stderr):
        # Signs that an encoding does not have, such as × in ASCII, are escaped.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    warnings.resetwarnings()
    for category in QUIET:
        warnings.simplefilter("ignore", category)


def withhold(variables: MutableMapping[str, str]) -> None:
    """Remove variables that libraries read, and set those by which they always give the same.

    Parameters
    ----------
    variables
        The process's, which are changed.
    """
    line = _line_to_complete(variables)
    for name in [name for name in variables if name.startswith(FAMILIES) and name not in line]:
        allowed = KEPT.get(name, ())
        if allowed is not None and variables[name] not in allowed:
            del variables[name]
    # Sums that are split over threads would depend on how many there are.
    variables["OPENBLAS_NUM_THREADS"] = "1"
    # Figures are drawn into files, by no settings but our own.
    variables["MPLBACKEND"] = "agg"
    package = find_spec("matplotlib")
    if package is not None and package.origin:
        variables["MATPLOTLIBRC"] = str(Path(package.origin).parent / "mpl-data" / "matplotlibrc")


def _line_to_complete(variables: Mapping[str, str]) -> tuple[str, ...]:
    """Return the variables by which a shell asks how a line may go on; none if it does not."""
    names = COMPLETED.get(variables.get(COMPLETION, ""), ())
    told = all(name in variables for name in names)
    # The number of the word that the cursor is in; only bash gives it.
    told = told and variables.get("COMP_CWORD", "0").isdecimal()
    return (COMPLETION, *names) if names and told else ()


def _open_streams() -> None:
    """Open standard streams that are closed: the next file would get the number of one of them.

    What a library prints would then go into that file.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stdin = sys.stdin or _nowhere("r")
    sys.stdout = sys.stdout or _nowhere("w")
    sys.stderr = sys.stderr or _nowhere("w")


def _nowhere(mode: str) -> IO[str]:
    return open(os.devnull, mode, encoding="utf-8")


def refuse_settings_of_numba() -> None:
    """Refuse a file of the current folder that numba reads, whatever is in it.

    Raises
    ------
    ConfigError
        When there is one.
    """
    if os.path.lexists(NUMBA_SETTINGS):
        limit = "is read by numba, so that numbers would depend on the current folder"
        raise ConfigError("folder", NUMBA_SETTINGS, limit, "move that file away")


def flushed(status: int) -> int:
    """Write out what a command has printed, and return its exit status: 1 where that fails."""
    try:
        sys.stdout.flush()
    except OSError as error:
        if error.errno != errno.EPIPE:  # Whoever reads has heard enough, as `head` has.
            reason = error.strerror or error
            print(f"StorageError: standard output: cannot be written ({reason})", file=sys.stderr)
        # Python would try again, and complain.
        sys.stdout = _nowhere("w")
        return status or 1
    return status
