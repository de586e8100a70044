"""A tiny scenario, and how Snakemake is asked about it."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from projects import TINY, copy_project


def snakemake(
    folder: Path,
    target: str,
    *words: str,
    settings: Mapping[str, str] | None = None,
    config: Sequence[str] = (),
) -> str:
    """Run Snakemake in a copy of the project, to a good end, and return what it said."""
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *words]
    chosen = ("--config", "scenario=tiny", *config, "--", target)
    environment = {**os.environ, **(settings or {})}
    done = subprocess.run(
        [*command, *chosen], cwd=folder, capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def made(folder: Path) -> Path:
    """Return a copy of the project with every result of the scenario."""
    copy_project(folder)
    (folder / "config" / "tiny.yaml").write_text(TINY)
    snakemake(folder, "all")
    return folder
