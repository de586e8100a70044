"""Wall slip and bulk yielding in soft particle suspensions, as a workflow to rerun and trust."""

__version__ = "0.1.0"


_PUBLIC = {
    "open_results": ("softslip.provenance.catalogue.opening",),
    "shear": ("softslip.workbench.run_chain", "softslip.workbench.accessor"),
}
"""What can be asked for, and the modules to import then: its own, and what its results need."""


def __getattr__(name: str) -> object:
    """Import `open_results` or `shear` when it is first asked for.

    Every command imports this package and must not wait for more. The modules are named as text, so
    that the rooms below them do not import them in the graph that their layers are checked with.
    """
    if name in _PUBLIC:
        import importlib

        own, *_ = (importlib.import_module(module) for module in _PUBLIC[name])
        return getattr(own, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return all names, also those that are imported when they are asked for."""
    return sorted({*globals(), *_PUBLIC})
