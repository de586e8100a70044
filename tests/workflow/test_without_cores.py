"""What is only looked at needs no number of cores."""

import subprocess
import sys
from pathlib import Path

import pytest
from projects import copy_project

pytestmark = pytest.mark.workflow


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of what the workflow is made of, without any results."""
    return copy_project(tmp_path_factory.mktemp("looked_at"))


@pytest.mark.parametrize(
    "question",
    [
        ("--summary",),
        ("--list-changes", "code"),
        ("--rulegraph",),
        ("--list-rules",),
        ("--unlock",),
    ],
    ids=lambda words: words[0],
)
def test_a_question_needs_no_number_of_cores(copy: Path, question: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "snakemake", *question]
    asked = subprocess.run(command, cwd=copy, capture_output=True, text=True, check=False)
    assert asked.returncode == 0, asked.stdout + asked.stderr


def test_the_report_needs_no_number_of_cores(whole: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    command = [
        sys.executable,
        "-m",
        "snakemake",
        "--config",
        "scenario=tiny",
        "--report",
        str(page),
    ]
    asked = subprocess.run(command, cwd=whole, capture_output=True, text=True, check=False)
    assert asked.returncode == 0, asked.stdout + asked.stderr
    assert "fig5" in page.read_text("utf-8")
