"""Errors that name the value, the limit and the remedy."""


class SoftslipError(Exception):
    """Base of every error that softslip raises on purpose; its text is meant for the user."""


class ConfigError(SoftslipError):
    """A scenario asks for something that cannot be run.

    Parameters
    ----------
    key
        Dotted path of the offending key, such as ``wall.roughness``.
    value
        What the scenario gave for it.
    limit
        The rule that the value breaks.
    remedy
        What to write instead.
    """

    def __init__(self, key: str, value: object, limit: str, remedy: str) -> None:
        super().__init__(" ".join(f"{key}: {value!r} {limit}; {remedy}".split()))
        self.key = key


class PackingError(SoftslipError):
    """LAMMPS is missing, failed, or left discs that overlap."""


class ExpansionError(SoftslipError):
    """The membranes could not be grown to the area fraction of the scenario without crossing."""


class NumericalError(SoftslipError):
    """A run left the range in which its numbers mean anything.

    Parameters
    ----------
    field
        Name of the offending field, such as ``node_position``.
    index
        First offending element of that field.
    step
        Number of the time step at which it was seen.
    message
        What is wrong and what to change.
    """

    def __init__(self, field: str, index: int, step: int, message: str) -> None:
        super().__init__(f"{field}[{index}] at step {step}: {message}")
        self.field = field
        self.index = index
        self.step = step
        self.message = message

    def at_step(self, step: int) -> "NumericalError":
        """Return the same error at another step, for those who raise it without knowing theirs."""
        return NumericalError(self.field, self.index, step, self.message)


class DatasetError(SoftslipError):
    """A dataset is missing, damaged, or not of the stage that was asked for."""


class CheckpointError(SoftslipError):
    """A checkpoint is missing, damaged, or not of the run that was asked for."""


class LockedError(SoftslipError):
    """A run is being worked on already, or its folder cannot be locked."""


class StorageError(SoftslipError):
    """A file could not be written; what was there before is still there."""


class Interrupted(SoftslipError):
    """A signal asked a run to stop; the same command resumes it."""
