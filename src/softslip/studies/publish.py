"""What is published of a study: datasets and figures, tables of the document, settings."""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from softslip.errors import ConfigError, DatasetError
from softslip.files.storage import read_dataset, replacing
from softslip.studies.bench.elements_markdown import elements_table
from softslip.studies.coverage.coverage_markdown import coverage_tables
from softslip.studies.stability.map_markdown import limits_table, verdicts_table
from softslip.studies.tradeoff.accuracy_markdown import accuracy_tables
from softslip.studies.tradeoff.choices import choices
from softslip.studies.validation.errors_markdown import errors_table

PUBLISHED = Path("results/published/numerics")
"""Folder of published studies, below the project's."""

DOCUMENT = Path("docs/accuracy.md")
"""Document with the generated tables, below the project's folder."""

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

Blocks = Mapping[str, str]
"""Generated parts of the document by name."""


def publish(results: Path, root: Path = Path()) -> list[Path]:
    """Publish a finished study: copy it, and rewrite the tables that come from it.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    DatasetError
        When a part of the study is missing or unreadable; then nothing is written.
    ConfigError
        When the document has lost a block.
    """
    sources = _sources(results)
    blocks = blocks_of(results)
    rows = choices(read_dataset(results / "tradeoff.nc", stage="tradeoff"))
    document = with_blocks((root / DOCUMENT).read_text(encoding="utf-8"), blocks)
    written = []
    for source in sources:
        target = root / PUBLISHED / source.relative_to(results)
        _replace(target, source.read_bytes())
        written.append(target)
    _replace(root / DOCUMENT, document.encode())
    _replace(root / CHOICES, choices_text(rows).encode())
    return [*written, root / DOCUMENT, root / CHOICES]


def choices_text(rows: list[dict[str, Any]]) -> str:
    """Return the file that the key `accuracy` chooses from."""
    return json.dumps({"rows": rows}, indent=1) + "\n"


def _sources(results: Path) -> list[Path]:
    """Return the files of a study that are published, in a fixed order."""
    found = [results / f"{name}.nc" for name in DATASETS]
    found += [results / f"{name}.png" for name in FIGURES]
    found += sorted((results / "validation").glob("*.nc"))
    for path in found:
        if not path.exists():
            raise DatasetError(f"{path}: is missing; finish the study with snakemake numerics")
    return found


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


def with_blocks(document: str, blocks: Blocks) -> str:
    """Return a document with its generated parts replaced.

    Raises
    ------
    ConfigError
        When the document does not have each part's two marks once.
    """
    for name, text in blocks.items():
        begin, end = f"<!-- begin {name}: generated -->", f"<!-- end {name} -->"
        pattern = re.escape(begin) + r"\n.*?" + re.escape(end)
        whole = f"{begin}\n\n{text}\n\n{end}"
        places = re.findall(pattern, document, flags=re.DOTALL)
        if len(places) != 1:
            limit = f"is generated for {len(places)} places of the document"
            raise ConfigError(str(DOCUMENT), name, limit, f"keep one of {begin} ... {end}")
        document = document.replace(places[0], whole)
    return document


def blocks_in(document: str) -> dict[str, str]:
    """Return the generated parts that a document has, by name."""
    pattern = r"<!-- begin (\w+): generated -->\n(.*?)<!-- end \1 -->"
    return {name: text.strip() for name, text in re.findall(pattern, document, flags=re.DOTALL)}


def _replace(path: Path, content: bytes) -> None:
    """Write a file that appears whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)
