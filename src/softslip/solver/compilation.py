"""How kernels are compiled, and where what was compiled is kept.

Numba keeps compiled functions from one process to the next and compiles again when the file of a
function has changed. It does not look at the files of the functions that were compiled into it:
after a change there, it would go on with the old ones. Here they are kept in a folder that is named
after the source of all kernels.
"""

import hashlib
import os
from pathlib import Path

import numba as nb

_PACKAGE = Path(__file__).parents[1]


def source_digest(folder: Path = _PACKAGE) -> str:
    """Return the first digits of a SHA-256 over all files below a folder that speak of kernels."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        source = path.read_bytes()
        if b"compiled" in source:
            digest.update(f"{path.relative_to(folder).as_posix()} {len(source)} ".encode())
            digest.update(source)
    return digest.hexdigest()[:16]


def _base() -> Path:
    """Return where compiled functions are kept: as told, beside the source, or with the user."""
    told = os.environ.get("NUMBA_CACHE_DIR")
    if told:
        return Path(told)
    if os.access(_PACKAGE, os.W_OK):
        return _PACKAGE / "__pycache__"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "softslip"


# Numba makes its settings' names when it is imported.
nb.config.CACHE_DIR = str(_base() / f"kernels-{source_digest()}")  # type: ignore[attr-defined]

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
