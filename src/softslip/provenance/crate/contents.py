"""What goes into a research object: a scenario's results, and what they were made with."""

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from softslip.config.scenario import FOLDER, Scenario, load_scenario
from softslip.errors import ConfigError, DatasetError
from softslip.files.expected_results import ExpectedResult, expected_results, finished_shears
from softslip.files.layout import FIGURE
from softslip.files.stamps import check_figure
from softslip.files.storage import read_dataset
from softslip.messages import brief, enumerated, file_text
from softslip.provenance.archive import usual_place
from softslip.provenance.attribution import ROOT
from softslip.provenance.product_labels import Parent, Product, read_product

MOST_NAMED = 3
"""Missing results that a sentence names; of more it says the number."""


@dataclass(frozen=True)
class CrateFile:
    """A file of the research object.

    Attributes
    ----------
    name
        Its path in there, with slashes.
    source
        Where it is now, or its bytes.
    size
        Of the file [byte].
    sha256
        Of the file.
    """

    name: str
    source: Path | bytes
    size: int
    sha256: str


def crate_file(name: str, source: Path | bytes) -> CrateFile:
    """Return a file of the research object with its size and digest.

    Raises
    ------
    DatasetError
        When it cannot be read.
    """
    if isinstance(source, bytes):
        return CrateFile(name, source, len(source), hashlib.sha256(source).hexdigest())
    try:
        with source.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        return CrateFile(name, source, source.stat().st_size, digest)
    except OSError as error:
        raise DatasetError(f"{file_text(source)}: cannot be read ({error.strerror})") from error


@dataclass(frozen=True)
class Result:
    """A result that is there and has been checked.

    Attributes
    ----------
    expected
        Which it is.
    product
        Its labels.
    file
        The file itself.
    benchmark
        What Snakemake noted of its job, None where it was done without.
    """

    expected: ExpectedResult
    product: Product
    file: CrateFile
    benchmark: CrateFile | None

    @property
    def rule(self) -> str:
        """The step that made it."""
        return self.expected.rule


@dataclass(frozen=True)
class Contents:
    """What goes into a research object.

    Attributes
    ----------
    scenario
        Whose results they are.
    results
        Parents before children.
    missing
        Names of results that are not there.
    scenario_file
        The scenario.
    others
        What else the results were made with: the workflow, its settings, the locked environment.
    """

    scenario: Scenario
    results: tuple[Result, ...]
    missing: tuple[str, ...]
    scenario_file: CrateFile
    others: tuple[CrateFile, ...]

    @cached_property
    def by_work(self) -> Mapping[tuple[str, str], Result]:
        """The datasets among the results, by stage and run."""
        data = (each for each in self.results if not each.product.is_figure)
        return {(each.product.stage, each.product.run): each for each in data}

    @property
    def gaps(self) -> str:
        """A sentence about what is missing, nothing where nothing is."""
        if not self.missing:
            return ""
        total = len(self.missing) + len(self.results)
        named = enumerated(self.missing, MOST_NAMED)
        return f"{len(self.missing)} of {total} results are missing: {named}."

    def parents(self, result: Result) -> tuple[Result, ...]:
        """Return what a result was made from, as far as it is here."""
        keys = ((parent.stage, parent.run) for parent in result.product.parents)
        return tuple(self.by_work[key] for key in keys if key in self.by_work)


def collect(
    name_or_path: str, results: Path | None = None, *, partial: bool = False, project: Path = Path()
) -> Contents:
    """Find and check everything that goes into the research object of a scenario.

    Every result is read and its digests are checked, and it must have been made from the very
    results that are there now.

    Parameters
    ----------
    name_or_path
        Of the scenario, see `config.scenario.load_scenario`.
    results
        Folder of its results; ``results/NAME`` by default.
    partial
        Whether results may be missing.
    project
        Folder with the workflow.

    Raises
    ------
    ConfigError
        When there is no such scenario, or no workflow in the folder.
    DatasetError
        When results are missing, damaged, or made from others than those that are there.
    """
    scenario = load_scenario(name_or_path)
    folder = results or Path("results") / scenario.name
    there = finished_shears(folder) if partial else None
    # Where no run is done, all that the whole scenario has is missing.
    every = list(expected_results(scenario, there or None))
    missing = [each.name for each in every if not (folder / each.name).exists()]
    if missing and (not partial or len(missing) == len(every)):
        remedy = "" if len(missing) == len(every) else ", or give --partial"
        raise DatasetError(
            f"{file_text(folder)}: {len(missing)} of {len(every)} results are missing "
            f"({enumerated(missing, MOST_NAMED)}); run the workflow with "
            f"--config scenario={name_or_path}{remedy}"
        )
    top = f"results/{scenario.name}"
    path = Path(name_or_path)
    path = path if path.suffix == ".yaml" else FOLDER / f"{name_or_path}.yaml"
    scenario_file = crate_file(f"{FOLDER}/{scenario.name}.yaml", path)
    others = [each for each in _project_files(project) if each.name != scenario_file.name]
    absent = frozenset(missing)
    found = [_checked(each, folder, top) for each in every if each.name not in absent]
    contents = Contents(scenario, tuple(found), tuple(missing), scenario_file, tuple(others))
    for result in found:
        _check_parents(contents, result)
    return contents


def _checked(each: ExpectedResult, folder: Path, top: str) -> Result:
    """Read a result and make sure that it is what its name says, and whole."""
    path = folder / each.name
    file = crate_file(f"{top}/{each.name}", path)
    if each.stage == FIGURE:
        check_figure(path)
    else:
        read_dataset(path, stage=each.stage, run=each.run)
    product = read_product(path)
    names = {"stage": (product.stage, each.stage), "run": (product.run, each.run)}
    if each.stage == FIGURE:
        # Which figure it is, only its title says.
        names["title"] = (product.title, each.figure)
    for key, (stated, due) in names.items():
        if stated != due:
            raise DatasetError(f"{file_text(path)}: is of {key} {stated!r}, not {due!r}")
    for key in ("started", "ended", "fingerprint", "environment"):
        if key not in product.provenance:
            raise DatasetError(
                f"{file_text(path)}: does not say its {key}; it is of an earlier release: delete "
                "it and rerun its job"
            )
    noted = folder / each.benchmark
    benchmark = crate_file(f"{top}/{each.benchmark}", noted) if noted.is_file() else None
    return Result(each, product, file, benchmark)


def _check_parents(contents: Contents, result: Result) -> None:
    """Refuse a result that was made from others than those that are there."""
    path = file_text(result.product.path)
    parents = result.product.parents
    for parent in parents:
        here = contents.by_work.get((parent.stage, parent.run))
        if here is None and _is_missing(contents, parent):
            continue
        if here is None or here.product.content != parent.content:
            state = "is no part of the scenario" if here is None else "has changed since then"
            raise DatasetError(
                f"{path}: was made from {parent.stage} {parent.run}, which {state}; rerun the "
                "workflow"
            )
    if result.rule == "gather" and not contents.missing:
        runs = contents.scenario.stage_table("shear")
        if len(parents) != len(runs):
            raise DatasetError(
                f"{path}: was gathered from {len(parents)} of {len(runs)} runs; rerun the workflow"
            )


def _is_missing(contents: Contents, parent: Parent) -> bool:
    """Return whether a parent is a result of the scenario that is not there."""
    return usual_place(parent.stage, parent.run) in contents.missing


def _project_files(project: Path) -> Iterator[CrateFile]:
    """Yield the workflow, its settings, and what belongs to the code: lock, licence, citation."""
    if not (project / "workflow" / "Snakefile").is_file():
        raise ConfigError(
            "workflow",
            brief("workflow/Snakefile"),
            "is not in the current directory",
            "change to the project's folder, or write one with: softslip init DIR",
        )
    names = ["Snakefile", "config/defaults.yaml", "profiles/default/config.yaml"]
    inside = (path.relative_to(project) for path in (project / "workflow").rglob("*"))
    names += [path.as_posix() for path in inside if _is_source(project, path)]
    for name in sorted(names):
        if (project / name).is_file():
            yield crate_file(name, project / name)
    for name in ("CITATION.cff", "LICENSE", "requirements.lock"):
        if (ROOT / name).is_file():
            yield crate_file(name, ROOT / name)


def _is_source(project: Path, path: Path) -> bool:
    hidden = any(part.startswith((".", "__")) for part in path.parts)
    return not hidden and (project / path).is_file()
