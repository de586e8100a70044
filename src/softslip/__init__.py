"""Wall slip and bulk yielding in soft particle suspensions, as a workflow that can be rerun and trusted."""

__version__ = "0.1.0"
