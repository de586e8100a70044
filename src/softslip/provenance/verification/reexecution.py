"""Results recomputed by their own commands, in a folder of their own, and compared.

What a command needs is what the result says it was made from: the runs' parents, and of a table
exactly the runs that it has, linked into the folder. Nothing is written where results are.
"""

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softslip.config.scenario import FOLDER as SCENARIOS
from softslip.config.stages import FLOWING
from softslip.errors import CheckpointError, DatasetError
from softslip.files.layout import CHECKPOINTS, FIGURE
from softslip.files.products import DATASETS, PAGES, TABLES, WITHOUT_RULE
from softslip.messages import enumerated, file_text
from softslip.provenance.archive import Archive
from softslip.provenance.fingerprints import fingerprint
from softslip.provenance.product_labels import Product
from softslip.provenance.verification.agreement import DIFFERS, Agreement, compare
from softslip.provenance.verification.survey import Verdict, Verification
from softslip.provenance.verification.tolerances import Difference
from softslip.simulation.checkpoint import SUFFIX, read_header

WHOLE, STRETCH = "whole", "last stretch"
"""How much of a result is recomputed."""

FAILED = "failed"
"""Verdict on what could not be rerun."""

Runner = Callable[[Sequence[str], Path], str]
"""Runs a command of the product in a folder; returns what it said if it failed, else nothing."""


@dataclass(frozen=True)
class Rerun:
    """A result that is to be recomputed.

    Attributes
    ----------
    name
        Of its file, below the folder of results.
    product
        What it is.
    checkpoint
        What its last stretch begins with, None where it is made as a whole.
    seconds
        How long that will take, from the time that it took before [s].
    """

    name: str
    product: Product
    checkpoint: Path | None
    seconds: float


@dataclass(frozen=True)
class RerunOutcome:
    """The result of a rerun.

    Attributes
    ----------
    rerun
        What it was.
    verdict
        That of the comparison, or `FAILED`.
    problem
        What is wrong, in one sentence that names the file; empty if nothing is.
    comparison
        None if there was nothing to compare.
    """

    rerun: Rerun
    verdict: str
    problem: str
    comparison: Agreement | None

    @property
    def how(self) -> str:
        """`WHOLE` or `STRETCH`."""
        return WHOLE if self.rerun.checkpoint is None else STRETCH

    def as_mapping(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        found = self.comparison
        return {
            "file": self.rerun.name,
            "executed": self.how,
            "verdict": self.verdict,
            "problem": self.problem,
            "made_differently": list(found.other) if found else [],
            "quantities": [each.as_mapping() for each in found.quantities] if found else [],
        }


def possible_reruns(verification: Verification, stretch: bool = False) -> tuple[Rerun, ...]:
    """Return what can be rerun, in the order of the chain.

    These are the scenario's products whose files are sound, and so are all their parents'.

    Parameters
    ----------
    verification
        Of the results.
    stretch
        Whether of runs that have left a checkpoint only the last stretch is made.
    """
    unsound = {each.examined.path for each in verification.verdicts if not each.sound}
    archive = Archive(verification.folder)
    return tuple(
        _task(verification.folder, verdict.name, verdict.product, stretch)
        for verdict in verification.verdicts
        if verdict.product is not None and _is_feasible(verdict, verdict.product, archive, unsound)
    )


def _is_feasible(verdict: Verdict, product: Product, archive: Archive, unsound: set[Path]) -> bool:
    if not verdict.sound or verdict.foreign or product.stage in WITHOUT_RULE:
        return False
    places = [archive.place(parent) for parent in product.parents]
    return all(place.exists() and place not in unsound for place in places)


def _task(folder: Path, name: str, product: Product, stretch: bool) -> Rerun:
    record = product.provenance
    seconds = float(record["core_seconds"]) / max(int(record["threads"]), 1)
    found = _checkpoint(folder, product) if stretch else None
    if found is None:
        return Rerun(name, product, None, seconds)
    path, share = found
    return Rerun(name, product, path, seconds * share)


def _checkpoint(folder: Path, product: Product) -> tuple[Path, float] | None:
    """Return a checkpoint that a run has left for this code, and the share of it that is left."""
    if product.stage not in FLOWING:
        return None
    path = (
        folder / product.stage / CHECKPOINTS / f"{product.run}.{fingerprint(product.stage)}{SUFFIX}"
    )
    try:
        header = read_header(path)
    except CheckpointError:
        return None
    if header.identity.parent != product.parents[0].content:
        return None
    return path, 1 - min(header.time / header.end, 1.0) if header.end > 0 else 0.0


def sampled(possible: Sequence[Rerun], count: int, seed: int) -> tuple[Rerun, ...]:
    """Choose some reruns at random, a function of the seed, and keep their order."""
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=tuple(b"verify")))
    places = generator.permutation(len(possible))[:count]
    return tuple(possible[place] for place in sorted(places.tolist()))


def run_command(words: Sequence[str], folder: Path) -> str:
    """Run a command of the product in a process of its own.

    Returns
    -------
    str
        Nothing if it ended well, else the last line that it said.
    """
    command = [sys.executable, "-m", "softslip", *words]
    ended = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if ended.returncode == 0:
        return ""
    said = ended.stderr.strip().splitlines()
    return said[-1] if said else f"exit status {ended.returncode}"


def reexecute(
    reruns: Iterable[Rerun], source: str, folder: Path, runner: Runner = run_command
) -> Iterator[RerunOutcome]:
    """Rerun what made some results, one after the other, and yield the outcome of each.

    Parameters
    ----------
    reruns
        What to make, of one scenario.
    source
        Name or path of the scenario, as `config.scenario.load_scenario` takes it.
    folder
        Where the scenario's results are.
    runner
        Runs the commands.
    """
    path = Path(source) if source.endswith(".yaml") else SCENARIOS / f"{source}.yaml"
    for rerun in reruns:
        with tempfile.TemporaryDirectory(prefix="softslip-verify-") as work:
            yield _outcome(rerun, path.absolute(), folder.absolute(), Path(work).resolve(), runner)


def _outcome(
    rerun: Rerun, scenario: Path, results: Path, work: Path, runner: Runner
) -> RerunOutcome:
    product, name = rerun.product, file_text(rerun.product.path)
    output = work / "results" / rerun.name
    output.parent.mkdir(parents=True)
    words = _command(rerun, scenario, results, work, output)
    if rerun.checkpoint is not None:
        kept = output.parent / CHECKPOINTS
        kept.mkdir()
        shutil.copyfile(rerun.checkpoint, kept / rerun.checkpoint.name)
    said = runner(words, work)
    if said:
        return RerunOutcome(rerun, FAILED, f"{name}: could not be rerun: {said}", None)
    try:
        found = compare(product.path, output)
    except DatasetError as error:
        return RerunOutcome(rerun, FAILED, f"{name}: could not be compared: {error}", None)
    problem = f"{name}: {_difference(found, product)}" if found.verdict == DIFFERS else ""
    return RerunOutcome(rerun, found.verdict, problem, found)


def _command(rerun: Rerun, scenario: Path, results: Path, work: Path, output: Path) -> list[str]:
    """Return the command that makes a product, and link what it reads."""
    product, archive = rerun.product, Archive(results)
    parents = [str(archive.place(parent)) for parent in product.parents]
    end = ["--output", str(output)]
    if product.stage in TABLES or product.is_page:
        linked = work / "parents"
        for parent in parents:
            link = linked / Path(parent).relative_to(results)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(parent)
        words = [PAGES[product.title].rule] if product.is_page else ["gather", product.stage]
        return [*words, str(scenario), "--results", str(linked), *end]
    if product.stage in DATASETS:
        return [DATASETS[product.stage].rule, *parents, *end]
    if product.stage == FIGURE:
        return ["draw", product.title, *parents, *end]
    words = [product.stage, str(scenario), product.run, *end]
    if parents:
        words += ["--parent", *parents]
    if product.stage in FLOWING:
        words += ["--threads", str(product.provenance["threads"])]
    return [*words, "--resume"] if rerun.checkpoint is not None else words


def _difference(found: Agreement, product: Product) -> str:
    """Return in words what differs."""
    worst = [each for each in found.quantities if not each.fits] or list(found.quantities)
    named = enumerated([_in_words(each) for each in worst], 3)
    how = (
        f"it was made with another {', '.join(found.other)}"
        if found.other
        else ("it was made by the same code and software on the same kind of processor")
    )
    return f"is not reproduced: {named or 'its bytes'}; {how}"


def _in_words(quantity: Difference) -> str:
    if not np.isfinite(quantity.difference):
        return quantity.name
    return f"{quantity.name} by {quantity.difference:.2g}, allowed {quantity.tolerance:.2g}"
