"""A tiny scenario, and how Snakemake is asked about it."""

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

from projects import copy_project

SCENARIO = """\
description: The smallest run through every stage; nothing but what is made again is looked at.
base:
  fidelity: preview
  channel: {length: 0.046875, height: 0.046875, outer_gap: 0.0078125}
  packing: {equilibration_steps: 500}
  expansion: {ramp_steps: 500, relaxation_steps: 200, growth_nodes: 24}
  time_stepping: {ageing_time: 0.2, shear_time: 0.5, longest_step: 0.05}
  recording: {snapshots: [0.25], bulk_margin: null, stride: 2, profiles: 2}
"""


def snakemake(
    folder: Path, target: str, *words: str, settings: Mapping[str, str] | None = None
) -> str:
    """Run Snakemake in a copy of the project, to a good end, and return what it said."""
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *words]
    chosen = ("--config", "scenario=tiny", "--", target)
    environment = {**os.environ, **(settings or {})}
    done = subprocess.run(
        [*command, *chosen], cwd=folder, capture_output=True, text=True, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def made(folder: Path) -> Path:
    """Return a copy of the project with every result of the scenario."""
    copy_project(folder)
    (folder / "config" / "tiny.yaml").write_text(SCENARIO)
    snakemake(folder, "all")
    return folder
