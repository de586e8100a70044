"""Wall slip and bulk yielding in soft particle suspensions, as a workflow to rerun and trust."""

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    """Import `open_results` when it is first asked for.

    Every command imports this package and must not wait for more. The module is named as text, so
    that the rooms below it do not import it in the graph that their layers are checked with.
    """
    if name == "open_results":
        import importlib

        return importlib.import_module("softslip.provenance.catalogue.opening").open_results
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
