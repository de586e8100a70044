"""What is published of a scenario: datasets, figures and movie, and its tables in the document."""

from pathlib import Path

from softslip.analysis.comparison_markdown import comparison_table
from softslip.config.scenario import Scenario
from softslip.config.stages import STAGES
from softslip.files.expected_results import expected_results
from softslip.files.layout import DATASET
from softslip.files.products import COMPARISON, DATASETS, EFFORT, FITS, REPRODUCTION
from softslip.files.publication import Publication
from softslip.files.storage import read_dataset, replacing
from softslip.operations.results_markdown import (
    effort_table,
    laws_table,
    reproduction_table,
    research_object_text,
    scope_text,
)
from softslip.provenance.crate import METADATA, Credits, collect, files_of

DOCUMENT = Path("docs/results.md")
"""Document on published results, below the project's folder."""

README = Path("README.md")
"""Document that has some of its generated parts too."""

RESEARCH_OBJECT = "research_object.json"
"""File that says what the research object of a scenario has in it, below the folder of results."""

PUBLISHED = Path("results/published")
"""Folder of published results, below the project's."""


def describe_research_object(name_or_path: str, results: Path) -> None:
    """Write what the research object of a scenario says of its files: `RESEARCH_OBJECT`.

    The research object itself, with every run, is what `softslip crate` makes of the same results;
    this is its ``ro-crate-metadata.json``, which names each file with its digest.

    Raises
    ------
    DatasetError
        When a result is damaged, or made from others than those that are there.
    """
    items = files_of(collect(name_or_path, results, partial=True), Credits())
    metadata = next(each for each in items if each.name == METADATA)
    if not isinstance(metadata.source, bytes):
        raise TypeError(f"{METADATA} is not made here")
    with replacing(results / RESEARCH_OBJECT) as temporary:
        temporary.write_bytes(metadata.source)


def publication_of(scenario: Scenario, runs: Path | None = None) -> Publication:
    """Return what is published of a scenario.

    The document has generated parts called after the scenario: ``NAME_scope`` and ``NAME_effort``,
    and where more than the seed is varied, so that there may be laws, ``NAME_comparison`` and
    ``NAME_laws``. The README has those that it names.

    Parameters
    ----------
    scenario
        Whose results they are.
    runs
        Folder of results whose finished runs are published too, None where they are not.
    """
    name = scenario.name
    has_laws = any(axis.label != "seed" for axis in scenario.axes)

    def blocks(results: Path) -> dict[str, str]:
        read = {
            stage: read_dataset(results / f"{stage}{DATASET}", stage=stage, run=name)
            for stage in ("flow_curve", FITS, COMPARISON, EFFORT)
        }
        scope = scope_text(scenario, read["flow_curve"], read[EFFORT])
        packed = research_object_text(name, (results / RESEARCH_OBJECT).read_bytes())
        found = {
            f"{name}_scope": f"{scope}\n\n{packed}",
            f"{name}_effort": effort_table(read[EFFORT]),
        }
        if has_laws:
            found[f"{name}_comparison"] = comparison_table(read[COMPARISON])
            found[f"{name}_laws"] = laws_table(read[FITS])
        return found

    finished = () if runs is None else _finished_runs(scenario, runs)
    tables = (*(f"{table}{DATASET}" for table in DATASETS), f"{EFFORT}{DATASET}", RESEARCH_OBJECT)
    return Publication(
        folder=PUBLISHED / name,
        document=DOCUMENT,
        files=(*tables, "figures/*.*", *finished),
        made_by=f"finish it with snakemake --cores 2 --config scenario={name}",
        blocks=blocks,
        further=(README,),
    )


def _finished_runs(scenario: Scenario, results: Path) -> tuple[str, ...]:
    """Return the files of a scenario's finished runs, below the folder of its results."""
    runs = (each.name for each in expected_results(scenario) if each.stage in STAGES)
    return tuple(name for name in runs if (results / name).exists())


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
