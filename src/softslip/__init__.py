"""Wall slip and bulk yielding in soft particle suspensions, as a workflow to rerun and trust."""

__version__ = "0.1.0"


_PUBLIC = {
    "open_results": "softslip.provenance.catalogue.opening",
    "shear": "softslip.workbench.run_chain",
}
"""What can be asked for, and the module of each; their datasets have an accessor besides."""


def __getattr__(name: str) -> object:
    """Import `open_results` or `shear` when it is first asked for.

    Every command imports this package and must not wait for more. The modules are named as text, so
    that the rooms below them do not import them in the graph that their layers are checked with.
    """
    if name in _PUBLIC:
        import importlib

        importlib.import_module("softslip.workbench.accessor")
        return getattr(importlib.import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return all names, also those that are imported when they are asked for."""
    return sorted({*globals(), *_PUBLIC})
