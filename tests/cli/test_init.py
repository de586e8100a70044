"""`softslip init`: what it says, and names that are meant to do harm."""

import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from softslip.cli import app
from softslip.operations.project_folder import PARTS


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_says_how_to_go_on() -> None:
    done = CliRunner().invoke(app, ["init", "mine"])
    assert done.exit_code == 0, done.output
    assert "\n    cd mine\n    snakemake --cores 2\n" in done.output
    assert sorted(path.name for path in Path("mine").iterdir()) == sorted(PARTS)


@pytest.mark.parametrize("name", ["$(touch pwned)", "a b", "'", "~", "*", "é", "; touch pwned"])
def test_the_line_to_copy_leads_into_a_folder_of_any_name(name: str) -> None:
    done = CliRunner().invoke(app, ["init", name])
    assert done.exit_code == 0, done.output
    (line,) = (line for line in done.output.splitlines() if line.strip().startswith("cd "))
    assert shlex.split(line) == ["cd", name]
    assert Path(name, "workflow", "Snakefile").is_file()


@pytest.mark.parametrize("name", ["", "a\nb", "\x1b[31m"])
def test_a_name_that_is_no_plain_text_is_refused(folder: Path, name: str) -> None:
    done = CliRunner().invoke(app, ["init", name])
    assert done.exit_code == 2
    assert done.output.count("\n") == 1
    assert done.output.strip().isprintable()
    assert list(folder.iterdir()) == []
