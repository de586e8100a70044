"""Words that a shell offers after `softslip --install-completion`."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from softslip.cli.inherited import COMPLETED, COMPLETION, withhold

ASKED = """
source <({command} --show-completion)
COMP_WORDS=({words}) COMP_CWORD={number}
_softslip_completion {command}
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with scenarios, and with a command that is called softslip."""
    command = tmp_path / "softslip"
    # As pip writes it, so that the command knows what it is called.
    command.write_text(
        f"#!{sys.executable}\nimport sys\nfrom softslip.cli import main\nsys.exit(main())\n"
    )
    command.chmod(0o755)
    (tmp_path / "config").mkdir()
    for name in ("demo", "desk", "paper", "config"):
        (tmp_path / "config" / f"{name}.yaml").touch()
    return tmp_path


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("softslip stat", {"status"}),
        ("softslip plan --ag", {"--against"}),
        ("softslip plan de", {"demo", "desk"}),
        ("softslip query c", set()),
    ],
)
def test_bash_offers_commands_options_and_scenarios(
    folder: Path, line: str, expected: set[str]
) -> None:
    number = len(line.split()) - 1
    script = ASKED.format(command=folder / "softslip", words=line, number=number)
    command = ["bash", "--norc", "-c", script]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.stderr == ""
    assert set(done.stdout.split()) == expected


@pytest.mark.parametrize("shell", COMPLETED)
def test_a_command_is_completed_only_where_the_line_is_told(shell: str) -> None:
    line = {COMPLETION: shell, **dict.fromkeys(COMPLETED[shell], "1")}
    told = dict(line)
    withhold(told)
    assert line.items() <= told.items()
    for name in COMPLETED[shell]:
        untold = {key: value for key, value in line.items() if key != name}
        withhold(untold)
        assert COMPLETION not in untold


def test_a_line_without_a_number_of_its_word_is_not_completed() -> None:
    variables = {COMPLETION: "complete_bash", "COMP_WORDS": "softslip", "COMP_CWORD": "x"}
    withhold(variables)
    assert COMPLETION not in variables
