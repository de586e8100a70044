"""Wall slip and bulk yielding in soft particle suspensions, as a workflow to rerun and trust."""

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    """Import `open_results` when it is first asked for.

    Every stage imports this package, and must neither wait for more nor depend on its code: the
    module is named as text, which is no import in the graph that fingerprints are made from.
    """
    if name == "open_results":
        import importlib

        return importlib.import_module("softslip.provenance.catalogue.opening").open_results
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
