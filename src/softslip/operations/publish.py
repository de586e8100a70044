"""What is published of a scenario: datasets, figures and movie, and its tables in the document."""

from pathlib import Path

from softslip.analysis.comparison_markdown import comparison_table
from softslip.config.scenario import Scenario
from softslip.files.layout import DATASET
from softslip.files.products import COMPARISON, DATASETS, EFFORT, FITS, REPRODUCTION
from softslip.files.publication import Publication
from softslip.files.storage import read_dataset
from softslip.operations.results_markdown import (
    effort_table,
    laws_table,
    reproduction_table,
    scope_text,
)

DOCUMENT = Path("docs/results.md")
"""Document on published results, below the project's folder."""

PUBLISHED = Path("results/published")
"""Folder of published results, below the project's."""


def publication_of(scenario: Scenario) -> Publication:
    """Return what is published of a scenario.

    The document has generated parts called after the scenario: ``NAME_scope``,
    ``NAME_comparison``, ``NAME_laws`` and ``NAME_effort``.
    """
    name = scenario.name

    def blocks(results: Path) -> dict[str, str]:
        read = {
            stage: read_dataset(results / f"{stage}{DATASET}", stage=stage, run=name)
            for stage in ("flow_curve", FITS, COMPARISON, EFFORT)
        }
        return {
            f"{name}_scope": scope_text(scenario, read["flow_curve"], read[EFFORT]),
            f"{name}_comparison": comparison_table(read[COMPARISON]),
            f"{name}_laws": laws_table(read[FITS]),
            f"{name}_effort": effort_table(read[EFFORT]),
        }

    return Publication(
        folder=PUBLISHED / name,
        document=DOCUMENT,
        files=(*(f"{table}{DATASET}" for table in DATASETS), f"{EFFORT}{DATASET}", "figures/*.*"),
        made_by=f"finish it with snakemake --cores 2 --config scenario={name}",
        blocks=blocks,
    )


def reproduction_of(scenario: Scenario) -> Publication:
    """Return what is published of runs of a scenario that were made again.

    The document has the generated part ``NAME_reproduction``.
    """
    name = scenario.name

    def blocks(results: Path) -> dict[str, str]:
        path = results / f"{REPRODUCTION}{DATASET}"
        again = read_dataset(path, stage=REPRODUCTION, run=name)
        return {f"{name}_reproduction": reproduction_table(again)}

    return Publication(
        folder=PUBLISHED / name,
        document=DOCUMENT,
        files=(f"{REPRODUCTION}{DATASET}",),
        made_by=f"run softslip reproduce {name}",
        blocks=blocks,
    )
