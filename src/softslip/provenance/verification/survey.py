"""A folder of results as a whole: which files are sound, and which are missing."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import softslip
from softslip.config.scenario import Scenario
from softslip.errors import DatasetError
from softslip.files.expected_results import expected_results
from softslip.messages import file_text
from softslip.provenance.archive import UNREADABLE, Archive
from softslip.provenance.environment import environment
from softslip.provenance.fingerprints import fingerprints
from softslip.provenance.product_labels import Product
from softslip.provenance.verification.consistency import Consistency
from softslip.provenance.verification.examination import Examination, examine

Progress = Callable[[int, int], None]
"""Called as progress(files read, files in all)."""


def _ignore(*_: object) -> None:
    """Show nothing."""


@dataclass(frozen=True)
class Verdict:
    """What was found out about one file.

    Attributes
    ----------
    name
        Of the file, below the folder of results.
    examined
        What it is and says.
    problems
        What is wrong, each in one sentence that names the file.
    remarks
        What is worth knowing and not wrong, in sentences of the same kind.
    foreign
        Whether it is none of the scenario's products, as the scenario is now.
    other_code
        Whether other code than there is now made it.
    """

    name: str
    examined: Examination
    problems: tuple[str, ...]
    remarks: tuple[str, ...]
    foreign: bool
    other_code: bool

    @property
    def product(self) -> Product | None:
        """What the file says of itself, if it can be believed."""
        return self.examined.product

    @property
    def sound(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems

    def as_mapping(self) -> dict[str, Any]:
        """Return it as JSON has it; what is not known is null."""
        product = self.product
        origin = {} if product is None else product.provenance
        keys = ("fingerprint", "commit", "dirty", "environment", "processor", "lock_sha256", "seed")
        return {
            "file": self.name,
            "stage": product and product.stage,
            "run": product and product.run,
            "digests": self.examined.state,
            "content_sha256": product and product.content,
            "record_sha256": product and product.record,
            "verdict": "sound" if self.sound else "problem",
            "problems": list(self.problems),
            "remarks": list(self.remarks),
            "of_this_scenario": None if product is None else not self.foreign,
            "by_this_code": None if product is None else not self.other_code,
            "made_by": {key: origin.get(key) for key in keys},
        }


@dataclass(frozen=True)
class Verification:
    """What was found out about the results of a scenario.

    Attributes
    ----------
    scenario, folder
        Which they are, and where.
    verdicts
        One for each file: the scenario's in the order of the chain, then all others by name.
    missing
        Names of the scenario's products that are not there.
    """

    scenario: Scenario
    folder: Path
    verdicts: tuple[Verdict, ...]
    missing: tuple[str, ...]

    @property
    def problems(self) -> tuple[str, ...]:
        """All that is wrong."""
        return tuple(problem for verdict in self.verdicts for problem in verdict.problems)

    def as_mapping(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return {
            "scenario": self.scenario.name,
            "results": str(self.folder),
            "verified_with": {
                "softslip": softslip.__version__,
                "environment": environment(),
                "fingerprints": fingerprints(),
            },
            "files": [verdict.as_mapping() for verdict in self.verdicts],
            "missing": list(self.missing),
        }


def verify(scenario: Scenario, folder: Path, progress: Progress = _ignore) -> Verification:
    """Recompute the digests of all results and test what they say of one another.

    Nothing is written, and nothing is rerun.

    Raises
    ------
    DatasetError
        When there is no such folder.
    """
    try:
        is_folder = folder.is_dir()
    except OSError as error:
        raise DatasetError(f"{file_text(folder)}: cannot be read ({error.strerror})") from error
    if not is_folder:
        raise DatasetError(f"{file_text(folder)}: is no folder; run the scenario, or give another")
    archive = Archive(folder)
    files = archive.files
    examined: dict[Path, Examination] = {}
    for number, path in enumerate(files):
        progress(number, len(files))
        examined[path] = examine(path)
    progress(len(files), len(files))
    for path, problem in archive.closed_folders.items():
        examined[path] = Examination(path, UNREADABLE, problem)
    claims = Consistency(scenario, folder, examined)
    order = {each.name: place for place, each in enumerate(expected_results(scenario))}
    verdicts = sorted(
        _verdicts(claims), key=lambda each: (order.get(each.name, len(order)), each.name)
    )
    present = {each.name for each in verdicts}
    # What lies in a folder that cannot be looked into may be there.
    closed = tuple(f"{path.relative_to(folder).as_posix()}/" for path in archive.closed_folders)
    everywhere = "./" in closed
    missing = (name for name in order if name not in present and not name.startswith(closed))
    return Verification(scenario, folder, tuple(verdicts), () if everywhere else tuple(missing))


def _verdicts(claims: Consistency) -> Iterator[Verdict]:
    for path, found in claims.examined.items():
        name, product = path.relative_to(claims.folder).as_posix(), found.product
        if product is None:
            yield Verdict(name, found, (found.problem,), (), False, False)
            continue
        problems, remarks = claims.test(product)
        foreign, other = claims.is_foreign(product), claims.is_of_other_code(product)
        yield Verdict(name, found, problems, remarks, foreign, other)
