import io
import json
import os
import signal
import sys
from types import ModuleType

import pytest
from rich.console import Console
from rich.progress import Progress

from softslip.operations import progress


def test_a_log_has_step_time_rate_and_remaining_time(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = iter([0.0, 5.0, 20.0, 40.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(now))
    with progress.progress_report("shear") as report:
        report(50, 400, 0.5)  # 5 s after the start: too early for a line
        report(200, 400, 2.0)
        report(400, 400, 4.0)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "shear: step 200 of 400, t = 2.000, 10.0 steps/s, 20 s to go",
        "shear: step 400 of 400, t = 4.000, 10.0 steps/s, 0 s to go",
    ]


def test_the_last_step_always_has_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.progress_report("ageing") as report:
        report(1, 2, 0.1)
        report(2, 2, 0.2)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, f"one line for the end, not {lines}"
    assert lines[0].startswith("ageing: step 2 of 2, t = 0.200,"), lines[0]


def test_a_terminal_gets_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=100)
    monkeypatch.setattr(progress, "Console", lambda **_: console)
    with progress.progress_report("shear") as report:
        report(300, 400, 3.0)
    shown = screen.getvalue()
    for part in ("shear", "75%", "t = 3.00", "steps/s"):
        assert part in shown, f"{part!r} is not in {shown!r}"


def test_a_program_gets_lines_of_json(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = iter([10.0, 10.1, 10.3, 10.31])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(now))
    with progress.json_report("shear") as report:
        report(1, 400, 0.01)
        report(2, 400, 0.02)  # too early for a line
        report(3, 400, 0.03)
        report(400, 400, 4.0)
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["done"] for line in lines] == [1, 3, 400]
    assert lines[-1] == {"stage": "shear", "done": 400, "steps": 400, "time": 4.0}


def test_work_that_nobody_watches_any_more_is_asked_to_stop_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    stopped: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    try:
        # Its buffer is as full as before when it is closed.
        with open(writer, "w", closefd=False) as pipe, monkeypatch.context() as patch:
            patch.setattr(sys, "stdout", pipe)
            with progress.json_report("shear") as report:
                report(1, 2, 0.1)
                report(2, 2, 0.2)
            os.dup2(os.open(os.devnull, os.O_WRONLY), writer)
    finally:
        signal.signal(signal.SIGTERM, before)
        os.close(writer)
    assert stopped == [signal.SIGTERM]


class Output:
    """Stands for an output of a notebook that can be replaced."""

    def __init__(self) -> None:
        self.pictures: list[str] = []

    def update(self, shown: Progress) -> None:
        self.pictures.append(shown._repr_mimebundle_([], [])["text/html"])


def test_a_notebook_gets_a_bar_that_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    output, displayed = Output(), ModuleType("IPython.display")

    def display(shown: Progress, display_id: bool) -> Output:
        assert display_id
        output.update(shown)
        return output

    displayed.display = display
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", displayed)
    console = Console(force_jupyter=True)
    monkeypatch.setattr(progress, "Console", lambda **_: console)
    with progress.progress_report("shear") as report:
        report(100, 400, 1.0)  # too early for another picture
        report(400, 400, 4.0)
    assert "100%" not in output.pictures[0]
    for part in ("shear", "100%", "t = 4.00"):
        assert part in output.pictures[-1]


def test_silence_is_silent(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.silent_report("shear") as report:
        report(1, 1, 1.0)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("notebook", [False, True])
def test_words_are_no_errors_in_a_notebook(
    notebook: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    console = Console(force_jupyter=notebook)
    monkeypatch.setattr(progress, "Console", lambda **_: console)
    progress.tell("a word")
    assert capsys.readouterr() == (("a word\n", "") if notebook else ("", "a word\n"))
