"""Which code each stage of a run and each later product is made by, as one hash each.

A fingerprint is a hash over the syntax trees of the modules that a stage imports, directly and
through others. It changes with the code of these modules and with nothing else: comments,
docstrings, formatting, line ends, the place of the package and the machine do not matter. The
workflow passes it to its rules, so that exactly the stages whose code has changed run again, and
files carry it, so that no state is continued by other code than it was begun with.

Which interpreter and libraries ran is no part of it. The text that is hashed leaves out what the
syntax trees of different Python versions write differently, because the environment as a whole is
what can change a result (NumPy, Numba and LAMMPS sooner than Python), and it is pinned and
recorded as a whole.

Not counted is what only hands over parameters and results: `cli`, `operations.progress`,
and `files.storage` unless a module of the stage imports it. Its encoding is lossless and its
labels say what a file is; what a file holds is decided by the stage, and a reader that wants
something else than a file holds refuses it. Nor is what turns a scenario into parameters, beyond
the modules that a stage imports anyway: the parameters' values name the run.
"""

import ast
import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import grimp

PACKAGE = "softslip"
"""The package whose modules count."""

FOLDER = Path(__file__).parents[1]
"""Where its files are."""

ENTRIES: Mapping[str, tuple[str, ...]] = {
    "packing": ("softslip.simulation.packing",),
    "expansion": ("softslip.simulation.expansion",),
    # One time loop runs both, so that they share a fingerprint.
    "ageing": ("softslip.simulation.hydrodynamics",),
    "shear": ("softslip.simulation.hydrodynamics",),
    # The datasets' dimensions and coordinates are the axes of the scenario.
    "gather": ("softslip.analysis.observables", "softslip.config.scenario"),
    "fit": ("softslip.analysis.fits",),
    "draw": ("softslip.analysis.figures",),
    "bench": ("softslip.studies.bench",),
    "validation": ("softslip.studies.validation",),
    "tradeoff": (
        "softslip.studies.tradeoff.scene",
        "softslip.studies.tradeoff.measure",
        "softslip.studies.tradeoff.steady",
        "softslip.studies.tradeoff.table",
    ),
    "stability": ("softslip.studies.stability",),
}
"""Stages of a run, later products, measurements, and the modules that their commands call."""

DATA: Mapping[str, tuple[str, ...]] = {
    "softslip.analysis.figures.drawing": ("analysis/figures/style.mplstyle",)
}
"""Files of the package whose contents change what a module makes, as lines with # comments."""

UNCOUNTED_DATA = ("config/accuracy.json", "operations/costs.json")
"""Files that only choose values of parameters, or only say what runs cost.

These values are a part of the run's identity: a choice that changes gives another run, and one
that stays must not make finished runs start again.
"""

DIGITS = 16
"""Hexadecimal digits of a fingerprint, as many as of a run's identity."""

_UNSAID = frozenset({"ctx", "kind", "type_comment"})
"""Fields of syntax trees that follow from the place of a node, or are mere spelling."""


@dataclass(frozen=True)
class Code:
    """The code of one stage.

    Attributes
    ----------
    modules
        Names of the modules that it imports, itself and their packages included, sorted.
    fingerprint
        The beginning of the SHA-256 over them, `DIGITS` hexadecimal digits.
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
    """Return the sorted names of the modules that a stage's fingerprint is made of.

    Raises
    ------
    ValueError
        When there is no such stage.
    """
    return _code_of(stage).modules


def read_code() -> dict[str, Code]:
    """Return the code of all stages as it is on disk now; the functions above read it once."""
    graph, lines_of = _graph(), cache(_lines_of)
    return {stage: _read(stage, graph, lines_of) for stage in ENTRIES}


def normal_form(source: bytes) -> str:
    """Return a module's syntax tree as text, without what has no effect when it runs.

    Left out are comments, formatting, docstrings and all other bare constants, ``pass``, and the
    number of the release, which only labels files. Fields that are empty are left out too: so
    are those that later versions of Python add for syntax that a module does not use.

    Raises
    ------
    SyntaxError
        When it is no Python.
    """
    return _text(ast.parse(source))


@cache
def _code_of(stage: str) -> Code:
    if stage not in ENTRIES:
        raise ValueError(f"stage {stage!r} has no fingerprint; use one of {', '.join(ENTRIES)}")
    return _read(stage, *_once())


@cache
def _once() -> tuple[grimp.ImportGraph, Callable[[str], str]]:
    """Return what the code is read with, so that no module is parsed twice."""
    return _graph(), cache(_lines_of)


def _graph() -> grimp.ImportGraph:
    # Without a folder for its cache grimp writes nothing.
    return grimp.build_graph(PACKAGE, exclude_type_checking_imports=True, cache_dir=None)


def _read(stage: str, graph: grimp.ImportGraph, lines_of: Callable[[str], str]) -> Code:
    names = _imported(graph, ENTRIES[stage])
    return Code(names, _digest("\n".join(map(lines_of, names)))[:DIGITS])


def _imported(graph: grimp.ImportGraph, entries: tuple[str, ...]) -> tuple[str, ...]:
    """Return what runs when some modules are imported or called, sorted."""
    found: set[str] = set()
    waiting = set(entries)
    while waiting:
        module = waiting.pop()
        found.add(module)
        waiting |= graph.find_modules_directly_imported_by(module)
        # Importing a module executes the packages that it is in.
        waiting |= {module.rpartition(".")[0]} - {""}
        waiting -= found
    return tuple(sorted(found))


def _lines_of(module: str) -> str:
    """Return the lines that stand for a module and the data that it reads."""
    path = FOLDER.joinpath(*module.split(".")[1:])
    package = path / "__init__.py"
    source = (package if package.exists() else path.with_suffix(".py")).read_bytes()
    lines = [f"{module} {_digest(normal_form(source))}"]
    for name in DATA.get(module, ()):
        stripped = (line.strip() for line in (FOLDER / name).read_text("utf-8").splitlines())
        told = "\n".join(line for line in stripped if line and not line.startswith("#"))
        lines.append(f"{module} {name} {_digest(told)}")
    return "\n".join(lines)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def _text(value: object) -> str:
    if isinstance(value, ast.AST):
        fields = ",".join([f"{name}={_text(part)}" for name, part in _fields(value)])
        return f"{type(value).__name__}({fields})"
    if isinstance(value, list):
        return f"[{','.join([_text(part) for part in value])}]"
    # Which characters repr shows as they are depends on the Unicode tables of this Python.
    return ascii(value)


def _fields(node: ast.AST) -> Iterator[tuple[str, object]]:
    for name in node._fields:
        part = getattr(node, name, None)
        if isinstance(part, list):
            part = [item for item in part if not _is_idle(item, node)] or None
        if part is not None and name not in _UNSAID:
            yield name, part


def _is_idle(item: object, parent: ast.AST) -> bool:
    """Return whether something in a list of the tree has no effect on what the code computes."""
    if isinstance(item, ast.Expr):
        return isinstance(item.value, ast.Constant)
    if isinstance(item, ast.Assign) and isinstance(item.value, ast.Constant):
        return [getattr(target, "id", None) for target in item.targets] == ["__version__"]
    if isinstance(item, ast.Constant):
        # Python 3.12 ends some format specifications with an empty string.
        return item.value == "" and isinstance(parent, ast.JoinedStr)
    return isinstance(item, ast.Pass)
