"""How kernels are compiled, and where what was compiled is kept.

Numba keeps compiled functions from one process to the next and compiles again when the file of a
function has changed. It does not look at the files of the functions that were compiled into it:
after a change there, it would use the old ones. Nor does it look at its own settings. Here they are
kept in a folder that is named after the source of all kernels and after those settings.
"""

import hashlib
import os
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import llvmlite
import numba as nb

_PACKAGE = Path(__file__).parents[1]

_HAS_KERNELS = b"from softslip.solver.compilation import"

_PLACES_AND_THREADS = ("CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_DEFAULT_NUM_THREADS")
"""Settings of numba that differ between machines and change no kernel."""


def source_digest(folder: Path = _PACKAGE) -> str:
    """Return the first digits of a SHA-256 over all files below a folder that kernels depend on.

    These are all of the solver, as kernels contain constants of modules that have no kernel
    themselves, and the others that have kernels.
    """
    digest, solver = hashlib.sha256(), folder / "solver"
    for path in sorted(folder.rglob("*.py")):
        source = path.read_bytes()
        if path.is_relative_to(solver) or _HAS_KERNELS in source:
            digest.update(f"{path.relative_to(folder).as_posix()} {len(source)} ".encode())
            digest.update(source)
    return digest.hexdigest()[:16]


def settings_digest() -> str:
    """Return the first digits of a SHA-256 over numba's settings and the version of its compiler.

    Some of them, such as NUMBA_OPT and NUMBA_BOUNDSCHECK, change the last digits of what kernels
    give. Numba itself would use what it compiled under others.
    """
    settings = vars(nb.config).items()
    counted = sorted((name, repr(value)) for name, value in settings if name.isupper())
    lines = [f"{name}={value}" for name, value in counted if name not in _PLACES_AND_THREADS]
    lines.append(f"llvmlite={llvmlite.__version__}")
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def cache_folder() -> Path:
    """Return where compiled functions are stored.

    The folder of NUMBA_CACHE_DIR, one beside the source, one of the user's, or, where none of these
    may be written, a temporary one, which is said on standard error.
    """
    named, users = os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("XDG_CACHE_HOME")
    folders = [Path(named)] if named else [_PACKAGE / "__pycache__"]
    # Users without a name, as in containers, have no home.
    with suppress(RuntimeError):
        folders += [] if named else [Path(users or Path.home() / ".cache") / "softslip"]
    for folder in folders:
        if _is_writable(folder):
            return folder
    temporary = _private_folder(Path(tempfile.gettempdir()) / f"softslip-{os.geteuid()}")
    print(
        f"compiled functions are stored in {temporary}, as no other folder may be written; "
        "set NUMBA_CACHE_DIR to a folder that lasts",
        file=sys.stderr,
    )
    return temporary


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _private_folder(folder: Path) -> Path:
    """Return a folder that nobody else can put code into: the given one, or a new one."""
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.stat(follow_symlinks=False)
        ours = stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid()
        if ours and not status.st_mode & 0o077:
            return folder
    return Path(tempfile.mkdtemp(prefix="softslip-"))


# Numba makes its settings' names when it is imported.
nb.config.CACHE_DIR = str(  # type: ignore[attr-defined]
    cache_folder() / f"kernels-{source_digest()}-{settings_digest()}"
)

compiled = nb.njit(
    cache=True,
    nogil=True,
    fastmath={"contract", "reassoc", "nsz", "arcp"},
    error_model="numpy",
    forceinline=True,
)
"""How every kernel is compiled: with the floating-point freedoms that hide no NaN or Inf, free to
run beside another, and into its callers. Left to the compiler, a process that compiles and one that
loads from the cache may each call another copy, optimised otherwise, of the same function."""

compiled_exactly = nb.njit(cache=True, nogil=True, error_model="numpy")
"""The same without those freedoms, for sums over lists with members that do not count: how many
of those there are must not change the rounding of the others, as unrolling and fusing would."""
