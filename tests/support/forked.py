"""Commands of the product in forks of a process that has imported all that they use.

Most of a short command's time is the start of Python and the imports. What is wrong with a folder
shows only later, so that hundreds of folders are tried in forks. What Python or a library reads
when started needs a process of its own: see `hostile.called`.
"""

import gc
import json
import os
import pkgutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import softslip
from softslip.cli import main
from softslip.cli.inherited import put_right

LONGEST = 120
"""After how long a command is ended [s]."""


class Forks:
    """A process whose forks run commands.

    Parameters
    ----------
    stream
        Line of a shell that starts it, as `hostile.WITHOUT_PRIVILEGES`, or None.
    """

    def __init__(self, stream: str | None = None) -> None:
        command = [sys.executable, __file__]
        if stream is not None:
            command = ["/bin/bash", "-c", stream, "bash", *command]
        self._folder = TemporaryDirectory(prefix="softslip-forks-")
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)

    def call(self, folder: Path | bytes, words: Sequence[str]) -> tuple[int, str, str]:
        """Run a command in a folder; return its exit status, output and errors."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        places = [str(Path(self._folder.name, name)) for name in ("output", "errors")]
        job = {"folder": os.fsdecode(folder), "words": list(words), "places": places}
        self._process.stdin.write(json.dumps(job) + "\n")
        self._process.stdin.flush()
        status = int(self._process.stdout.readline())
        output, errors = (Path(place).read_bytes().decode("utf-8", "replace") for place in places)
        return status, output, errors

    def close(self) -> None:
        """End the process."""
        self._process.communicate()
        self._folder.cleanup()


def serve() -> None:
    """Run commands that are asked for on standard input; in their forks, return after the command.

    The answer to each is its exit status.
    """
    put_right()
    for module in pkgutil.walk_packages(softslip.__path__, "softslip."):
        if not module.name.endswith("__main__"):
            import_module(module.name)
    # At their ends, forks would look at all that was imported, which takes longer than a command.
    gc.freeze()
    for line in sys.stdin:
        job = json.loads(line)
        child = os.fork()
        if child == 0:
            _run(**job)
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


def _run(folder: str, words: Sequence[str], places: Sequence[str]) -> None:
    """Run a command in this process and end as a process of its own would."""
    signal.alarm(LONGEST)
    nothing = os.open(os.devnull, os.O_RDONLY)
    output, errors = (os.open(place, os.O_WRONLY | os.O_CREAT | os.O_TRUNC) for place in places)
    for number, opened in enumerate((nothing, output, errors)):
        os.dup2(opened, number)
        os.close(opened)
    os.chdir(os.fsencode(folder))
    os.environ["PWD"] = folder
    sys.argv = ["softslip", *words]
    main()


if __name__ == "__main__":
    serve()
