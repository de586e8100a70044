"""The sacct for clusters without accounting answers what Snakemake asks of it by asking squeue."""

import os
import stat
import subprocess
from pathlib import Path

import pytest

SACCT = Path(__file__).parents[2] / "profiles" / "slurm" / "no-accounting" / "sacct"

SQUEUE = '#!/bin/sh\nprintf "%s;" "$@"\nexit $ANSWER\n'
"""Says what it was asked."""


def ask(folder: Path, *words: str, answer: int = 0) -> subprocess.CompletedProcess[str]:
    squeue = folder / "squeue"
    squeue.write_text(SQUEUE)
    squeue.chmod(0o755)
    found = os.environ | {"PATH": f"{folder}:{os.environ['PATH']}", "ANSWER": str(answer)}
    return subprocess.run([SACCT, *words], env=found, capture_output=True, text=True, check=False)


def test_it_can_be_run() -> None:
    assert SACCT.stat().st_mode & stat.S_IXUSR


@pytest.mark.parametrize("answer", [0, 1])
def test_states_are_those_of_the_jobs_of_a_workflow(tmp_path: Path, answer: int) -> None:
    asked = "-X --parsable2 --clusters all --noheader --format=JobIdRaw,State --name a-1"
    said = ask(tmp_path, *asked.split(), answer=answer)
    assert said.stdout == "--noheader;--states=all;--format=%i|%T;--name;a-1;"
    assert said.returncode == answer, "Snakemake asks again where squeue fails"


def test_the_node_of_a_lost_job_is_told(tmp_path: Path) -> None:
    said = ask(tmp_path, "-j", "17", "-n", "-X", "-o", "nodelist%-256")
    assert said.stdout == "--noheader;--states=all;--format=%N;--jobs;17;"


@pytest.mark.parametrize("asked", ["-j 17.0 --format=Reason --noheader", "-nu root -o Account%256"])
def test_of_anything_else_nothing_is_known(tmp_path: Path, asked: str) -> None:
    said = ask(tmp_path, *asked.split())
    assert (said.stdout, said.returncode) == ("", 0)
