"""What a command says and how it ends reaches the caller."""

import os
import sys
from pathlib import Path

import pytest

from softslip.errors import ConfigError, Interrupted, NumericalError, SoftslipError, StorageError
from softslip.operations.failures import Failure
from softslip.workbench import stage_process
from softslip.workbench.stage_process import run_command


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function that has a program stand for all commands."""
    package = tmp_path / "softslip"
    package.mkdir()

    def write(text: str) -> None:
        (package / "__init__.py").write_text("")
        (package / "__main__.py").write_text(f"import sys, os\n{text}\n")

    monkeypatch.setattr(stage_process.softslip, "__file__", str(package / "__init__.py"))
    return write


def run(failure: Failure | None = None) -> tuple[tuple[str, ...], list[tuple[int, int, float]]]:
    told: list[tuple[int, int, float]] = []
    lines = run_command(["shear"], lambda *progress: told.append(progress), lambda: failure)
    return lines, told


def test_progress_and_words_are_handed_on(program) -> None:
    program(
        'print(\'{"stage": "shear", "done": 1, "steps": 2, "time": 0.5}\', flush=True)\n'
        'print("a word", file=sys.stderr)\n'
        'print("another", file=sys.stderr)'
    )
    assert run() == (("a word", "another"), [(1, 2, 0.5)])


def test_a_command_gets_its_arguments_and_asks_for_progress(program) -> None:
    program("print(sys.argv[1:], file=sys.stderr)")
    assert run()[0] == ("['shear', '--json-progress']",)


@pytest.mark.parametrize("kind", [StorageError, Interrupted])
def test_an_error_of_a_command_is_raised_again(program, kind: type[SoftslipError]) -> None:
    program(f"print('{kind.__name__}: x: is full', file=sys.stderr); sys.exit(1)")
    with pytest.raises(kind) as raised:
        run()
    assert type(raised.value) is kind
    assert str(raised.value) == "x: is full"


def test_a_numerical_error_says_where(program) -> None:
    text = "node_position[3] at step 7: is not finite; use a smaller step"
    program(f"print('NumericalError: {text}', file=sys.stderr); sys.exit(1)")
    with pytest.raises(NumericalError) as raised:
        run(Failure("NumericalError", text, "node_position", 3, 7))
    error = raised.value
    assert (error.field, error.index, error.step) == ("node_position", 3, 7)
    assert str(error) == text


def test_an_error_of_several_parts_keeps_its_words(program) -> None:
    program("print('ConfigError: a: 1 is wrong; use 2', file=sys.stderr); sys.exit(2)")
    with pytest.raises(SoftslipError, match="ConfigError: a: 1 is wrong; use 2") as raised:
        run()
    assert not isinstance(raised.value, ConfigError)


def test_a_command_that_crashes_leaves_its_last_words(program) -> None:
    program("print('something', file=sys.stderr); sys.stderr.flush(); os.abort()")
    with pytest.raises(SoftslipError, match="status -6, having said:\nsomething"):
        run()


def test_an_error_of_the_caller_ends_the_command(program, tmp_path: Path) -> None:
    program(
        "import signal, time\n"
        "def stop(*_):\n"
        f"    open({str(tmp_path / 'stopped')!r}, 'w').close()\n"
        "    sys.exit(75)\n"
        "signal.signal(signal.SIGINT, stop)\n"
        'print(\'{"stage": "s", "done": 1, "steps": 2, "time": 0.5}\', flush=True)\n'
        "time.sleep(60)"
    )

    def fail(*_: object) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_command(["shear"], fail, lambda: None)
    assert (tmp_path / "stopped").exists()


def test_the_command_is_that_of_this_python(program) -> None:
    program("print(sys.executable, file=sys.stderr)")
    assert run()[0] == (sys.executable,)


def test_an_installed_package_is_found_without_a_hint(
    program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program("print(os.environ.get('PYTHONPATH', ''), file=sys.stderr)")
    monkeypatch.setenv("PYTHONPATH", "elsewhere")
    assert run()[0] == (f"{tmp_path}{os.pathsep}elsewhere",)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(stage_process.site, "getsitepackages", lambda: [str(tmp_path)])
    assert run()[0] == (str(tmp_path),)
