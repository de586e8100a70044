import io

import pytest
from rich.console import Console

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
