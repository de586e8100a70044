"""Wall slip and bulk yielding in soft particle suspensions, as a workflow to rerun and trust."""

__version__ = "0.1.0"
