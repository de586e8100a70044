"""Tests run on a mutant: in a process forked from one that has everything else imported."""

import importlib
import importlib.util
import math
import os
import resource
import signal
import sys
from collections.abc import Callable, Container
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec, SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

import grimp
import hypothesis
import pytest

TESTS = Path("tests").resolve()

PROFILE = "mutation"
"""Name of the profile of hypothesis: that of the suite, without shrinking what is found."""


@dataclass(frozen=True)
class Selection:
    """The tests that a module's mutants are run against.

    Attributes
    ----------
    files
        Of tests, below `tests/`.
    without
        Those of the tests that are left out, each a node of pytest's.
    only
        Expression that pytest selects by, "" for all.
    """

    files: tuple[str, ...]
    without: tuple[str, ...] = ()
    only: str = ""

    def arguments(self) -> list[str]:
        """Return pytest's arguments."""
        chosen = [str(TESTS / name) for name in self.files]
        chosen += [f"--deselect=tests/{name}" for name in self.without]
        return chosen + (["-k", self.only] if self.only else [])


@dataclass
class Witness:
    """Plugin of pytest that runs likely tests first and remembers the first failure.

    Parameters
    ----------
    likely
        Names of the tests that failed on other mutants of the same function.
    """

    likely: Container[str] = ()
    seen: list[str] = field(default_factory=list)

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Put the likely ones first."""
        items.sort(key=lambda item: item.name not in self.likely)

    def pytest_exception_interact(self, node: Any, call: Any) -> None:
        """Note which test failed by what."""
        self.seen.append(f"{node.name}: {call.excinfo.typename}")


def load_everything() -> None:
    """Import what mutants have in common, and name the profile of hypothesis."""
    importlib.import_module("softslip.cli")
    suite = hypothesis.settings(
        deadline=None,
        derandomize=True,
        database=None,
        max_examples=40,
        phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate),
        report_multiple_bugs=False,
    )
    hypothesis.settings.register_profile(PROFILE, suite)


def run_tests(selection: Selection, scratch: Path, likely: Container[str] = ()) -> tuple[bool, str]:
    """Run tests in this process, likely ones first; return if all passed, and what failed."""
    witness = Witness(likely)
    arguments = ["-x", "-q", "-p", "no:cacheprovider", "--tb=no", "--no-header", "--no-summary"]
    # Nobody reads why an assertion failed, and finding out takes longer than the tests.
    arguments += ["--assert=plain"]
    # What is not compiled warns where compiled code does not.
    arguments += ["-W", "ignore::RuntimeWarning", f"--hypothesis-profile={PROFILE}"]
    arguments += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    arguments += [f"--basetemp={scratch}", *selection.arguments()]
    code = pytest.main(arguments, plugins=[witness])
    return code == pytest.ExitCode.OK, (witness.seen or [f"exit status {int(code)}"])[0]


def forget(module: str, graph: grimp.ImportGraph) -> None:
    """Let a module, all that imports it, and the tests be imported again."""
    stale = {module, *graph.find_downstream_modules(module)}
    for name, loaded in list(sys.modules.items()):
        path = getattr(loaded, "__file__", None)
        if name in stale or (path and Path(path).parent == TESTS):
            del sys.modules[name]
            parent, _, own = name.rpartition(".")
            if parent in sys.modules and hasattr(sys.modules[parent], own):
                delattr(sys.modules[parent], own)


class _Loader(SourceFileLoader):
    def __init__(self, name: str, path: str, code: CodeType) -> None:
        super().__init__(name, path)
        self._code = code

    def get_code(self, fullname: str) -> CodeType:
        return self._code


@dataclass
class Substitute:
    """Importer of one module from another source than its file's.

    Parameters
    ----------
    module
        Its name.
    path
        Its file, which tracebacks name.
    source
        What is run.

    Raises
    ------
    SyntaxError
        When the source is none.
    """

    module: str
    path: Path
    source: str

    def __post_init__(self) -> None:
        self._code = compile(self.source, str(self.path), "exec", dont_inherit=True)

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Return the one module's, None for all others."""
        if name != self.module:
            return None
        loader = _Loader(name, str(self.path), self._code)
        return importlib.util.spec_from_file_location(name, self.path, loader=loader)


@dataclass(frozen=True)
class Fork:
    """A process that says in a line what became of it.

    Attributes
    ----------
    pid, pipe
        The process, and where its line is read.
    """

    pid: int
    pipe: int

    @classmethod
    def of(cls, work: Callable[[], str], seconds: float) -> "Fork":
        """Start one that may compute for some seconds, which waiting for others does not count."""
        reading, writing = os.pipe()
        pid = os.fork()
        if pid:
            os.close(writing)
            return cls(pid, reading)
        status = 1
        try:
            # The tests' output, and that of whatever a mutant says.
            nothing = os.open(os.devnull, os.O_RDWR)
            for stream in range(3):
                os.dup2(nothing, stream)
            limit = math.ceil(seconds)
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
            signal.signal(signal.SIGXCPU, signal.SIG_DFL)
            os.write(writing, work().encode()[:4000])
            status = 0
        except BaseException as error:
            os.write(writing, f"error {type(error).__name__}: {error}".encode()[:4000])
        finally:
            # Neither the parent's open database nor its buffers are this process's to close.
            os._exit(status)

    def ended(self) -> str | None:
        """Return its line, or the signal that ended it; None while it runs."""
        pid, status = os.waitpid(self.pid, os.WNOHANG)
        if not pid:
            return None
        line = os.read(self.pipe, 4096).decode()
        os.close(self.pipe)
        if os.WIFSIGNALED(status):
            return f"killed {signal.Signals(os.WTERMSIG(status)).name}"
        return line

    def kill(self) -> None:
        """End it: it waits for something that does not come."""
        os.kill(self.pid, signal.SIGKILL)
