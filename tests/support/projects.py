"""Copies of the project in which Snakemake may do what it likes, and a scenario for them."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from softslip.config.scenario import Scenario
from softslip.files.expected_results import expected_results, run_shown
from softslip.files.products import FIGURES, MOVIE

ROOT = Path(__file__).parents[2]

TINY = """\
description: The smallest run through every stage; its numbers mean nothing.
base:
  fidelity: preview
  channel: {length: 0.046875, height: 0.046875, outer_gap: 0.0078125}
  packing: {equilibration_steps: 500}
  expansion: {ramp_steps: 500, relaxation_steps: 200, growth_nodes: 24}
  time_stepping: {ageing_time: 0.2, shear_time: 0.5, longest_step: 0.05}
  recording: {snapshots: [0.25], bulk_margin: null, stride: 2, profile_interval: 0.25}
"""
"""Eight particles: a fraction of a second a stage."""


def copy_project(folder: Path) -> Path:
    """Copy what the workflow is made of, without any results, and return the folder."""
    for name in ("workflow", "config", "profiles"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "Snakefile", folder)
    return folder


def drawings(scenario: Scenario, results: Path) -> Iterator[tuple[str, list[Path], Path]]:
    """Yield each figure of a scenario but those of single runs: name, datasets and file."""
    for each in expected_results(scenario):
        if each.rule in ("figure", MOVIE):
            entry = FIGURES[each.figure]
            names = [f"shear/{run_shown(entry, scenario)}"] if entry.sample else entry.parents
            yield each.figure, [results / f"{name}.nc" for name in names], results / each.name
