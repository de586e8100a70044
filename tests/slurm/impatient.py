"""Snakemake that looks at its jobs every few seconds.

The executor plugin waits ever longer, up to three minutes, as long as no job ends well.
"""

import sys

from snakemake.cli import main
from snakemake_executor_plugin_slurm import Executor

SECONDS = 5
"""Between two checks."""


def always(_: Executor) -> int:
    """Return the time until the next check."""
    return SECONDS


def ignore(_: Executor, seconds: int) -> None:
    """Leave the time until the next check as it is."""


if __name__ == "__main__":
    Executor.next_seconds_between_status_checks = property(always, ignore)
    main(sys.argv[1:])
