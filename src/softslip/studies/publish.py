"""What is published of the numerics: datasets and figures, tables of the document, settings."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from softslip.files.publication import Publication
from softslip.files.storage import read_dataset
from softslip.studies.bench.elements_markdown import elements_table
from softslip.studies.coverage.coverage_markdown import coverage_tables
from softslip.studies.stability.map_markdown import limits_table, verdicts_table
from softslip.studies.tradeoff.accuracy_markdown import accuracy_tables
from softslip.studies.tradeoff.choices import choices
from softslip.studies.validation.errors_markdown import errors_table

CHOICES = Path("src/softslip/config/accuracy.json")
"""What the key `accuracy` chooses from, below the project's folder."""

DATASETS = {
    "tradeoff": "tradeoff",
    "stability_map": "stability_map",
    "stability_limit": "limits",
    "elements": "elements",
    "coverage": "coverage",
}
"""Datasets of a study by file name, and the stage that each is of; validations are in a folder."""

FIGURES = ("validation", "tradeoff", "extrapolation", "stability_map", "stability_limit")
"""Figures of a study."""


def blocks_of(results: Path) -> dict[str, str]:
    """Return the generated parts of the document from a study's datasets.

    Raises
    ------
    DatasetError
        When a dataset is missing or unreadable.
    """
    read = {
        name: read_dataset(results / f"{name}.nc", stage=stage) for name, stage in DATASETS.items()
    }
    validations = [
        read_dataset(path, stage="validation")
        for path in sorted((results / "validation").glob("*.nc"))
    ]
    makers: dict[str, Callable[[], str]] = {
        "validation": lambda: errors_table(validations),
        "tradeoff": lambda: accuracy_tables(read["tradeoff"]),
        "stability": lambda: verdicts_table(read["stability_map"]),
        "limits": lambda: limits_table(read["stability_limit"]),
        "elements": lambda: elements_table(read["elements"]),
        "coverage": lambda: coverage_tables(read["coverage"]),
    }
    return {name: make().strip() for name, make in makers.items()}


def choices_text(rows: list[dict[str, Any]]) -> str:
    """Return the file that the key `accuracy` chooses from."""
    return json.dumps({"rows": rows}, indent=1) + "\n"


def _choices(results: Path) -> dict[Path, str]:
    """Return the settings that the key `accuracy` chooses from, as measured by a study."""
    tradeoff = read_dataset(results / "tradeoff.nc", stage="tradeoff")
    return {CHOICES: choices_text(choices(tradeoff))}


NUMERICS = Publication(
    folder=Path("results/published/numerics"),
    document=Path("docs/accuracy.md"),
    files=(
        *(f"{name}.nc" for name in DATASETS),
        *(f"{name}.png" for name in FIGURES),
        "validation/*.nc",
    ),
    made_by="finish the study with snakemake --cores 2 numerics",
    blocks=blocks_of,
    others=_choices,
)
"""What is published of a study of the numerics."""
