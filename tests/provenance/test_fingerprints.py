import ast
import copy
import os
import shutil
import string
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from softslip.config.stages import STAGES
from softslip.provenance import fingerprints
from softslip.provenance.bindings import EFFECTS, WHOLE, ModuleName
from softslip.provenance.definitions import ROOMS, Package
from softslip.provenance.fingerprints import (
    DATA,
    DIGITS,
    ENTRIES,
    FOLDER,
    UNCOUNTED_DATA,
    Code,
    definitions_of,
    fingerprint,
    modules_of,
    read_code,
)
from softslip.provenance.normal_form import normal_form

RUNS = "packing expansion ageing shear"
MEASURED = "bench validation tradeoff stability"
FLOWING = f"ageing shear {MEASURED}"
STARTED = "bench tradeoff stability"

TABLE = [
    ("", "solver solver.mobility simulation simulation.checkpoint simulation.interruption"),
    ("", "simulation.checkpoint_generations simulation.checkpointer simulation.end_state"),
    ("", "analysis studies studies.publish studies.study"),
    ("", "studies.stability.map_markdown studies.tradeoff"),
    ("", "studies.validation.errors_markdown studies.markdown"),
    ("", "studies.bench.bench_markdown studies.bench.elements_markdown"),
    ("", "studies.tradeoff.choices studies.tradeoff.accuracy_markdown"),
    # These only collect names.
    ("", "analysis.observables studies.bench studies.stability"),
    (f"{RUNS} {MEASURED}", "simulation.sample solver.geometry"),
    (f"packing {STARTED}", "simulation.packing simulation.lammps_library"),
    (f"packing expansion {STARTED}", "simulation.contour"),
    (f"expansion {STARTED}", "simulation.growth simulation.segments"),
    (f"expansion validation {STARTED}", "simulation.expansion"),
    (f"expansion {FLOWING}", "solver.compilation solver.neighbours"),
    (FLOWING, "simulation.assembly simulation.trajectory"),
    (FLOWING, "solver.contact_list solver.verlet_list"),
    (FLOWING, "solver.chains solver.contacts solver.control solver.crossing"),
    # The paper's slip length in Fig. 7 is the range of the contact force.
    (f"compare {FLOWING} draw", "solver.films"),
    (FLOWING, "solver.integrators solver.integrators.chebyshev solver.integrators.explicit"),
    (FLOWING, "solver.integrators.spectral solver.integrators.stepping solver.kernels"),
    (FLOWING, "solver.integrators.partitioned solver.integrators.step_control"),
    (FLOWING, "solver.integrators.partitioned_stages solver.integrators.recurrence"),
    (FLOWING, "solver.long_modes solver.membrane_solve solver.membrane_strain"),
    (FLOWING, "solver.membrane_response solver.wall_response solver.mobility.line"),
    (FLOWING, "solver.membrane solver.mobility.ewald solver.mobility.grid solver.mobility.near"),
    (FLOWING, "solver.clusters solver.lanes solver.mobility.blob solver.mobility.rigid"),
    (FLOWING, "solver.mobility.outside solver.mobility.quadrature solver.mobility.rest"),
    (FLOWING, "solver.mobility.transform solver.mobility.window solver.rheometer"),
    (FLOWING, "solver.mobility.least_squares"),
    (FLOWING, "solver.splitting solver.state solver.stepper_memory solver.steric"),
    (FLOWING, "solver.health solver.step_limits solver.suspension solver.transfer"),
    (f"ageing shear {STARTED}", "simulation.hydrodynamics simulation.observer"),
    (f"ageing shear {STARTED}", "solver.mobility.profile"),
    ("shear tradeoff", "simulation.arrays simulation.known_mean simulation.record"),
    ("gather coverage", "analysis.observables.timescales"),
    ("gather draw coverage", "analysis.observables.smoothed_series"),
    ("compare draw", "analysis.comparable analysis.paper"),
    ("compare", "analysis.against_paper"),
    ("", "analysis.comparison_markdown"),
    ("gather draw", "analysis.observables.velocity_fields"),
    ("gather draw explorer", "analysis.observables.contours"),
    ("draw", "analysis.observables.non_affine_motion"),
    ("gather draw", "analysis.observables.time_weights"),
    ("gather", "analysis.observables.structure"),
    ("gather fit compare draw coverage", "analysis.observables.seeds"),
    ("gather fit compare draw coverage explorer", "analysis.observables.tables"),
    ("gather draw tradeoff coverage explorer", "analysis.observables.series"),
    ("gather draw tradeoff coverage", "analysis.observables.correlation"),
    ("gather draw tradeoff coverage", "analysis.observables.falling"),
    ("gather draw tradeoff coverage", "analysis.observables.truncation"),
    ("gather fit compare draw tradeoff coverage", "analysis.observables.steady"),
    ("gather fit compare draw tradeoff coverage", "analysis.observables.verdicts"),
    ("gather coverage", "analysis.observables.slip_lengths"),
    ("gather fit", "analysis.observables.master_curves"),
    ("fit", "analysis.fits.summary"),
    ("fit draw coverage", "analysis.fits.flow analysis.fits.joint"),
    ("fit compare draw coverage", "analysis.fits.finite_size analysis.fits.points"),
    ("fit coverage", "analysis.fits analysis.fits.branches analysis.fits.critical_roughness"),
    ("fit coverage", "analysis.fits.likelihood analysis.fits.measured_points"),
    ("fit coverage", "analysis.fits.outcomes analysis.fits.slip"),
    ("fit draw coverage", "analysis.fits.powers"),
    # It only collects names.
    ("", "studies.coverage studies.coverage.claims studies.coverage.coverage_markdown"),
    ("coverage", "studies.coverage.*"),
    # Shown by Python alone, not kept among results.
    ("", "analysis.figures.single_run"),
    # The page has the markers and colours of the figures.
    ("draw explorer", "analysis.figures.drawing analysis.figures.markers analysis.figures.panels"),
    ("draw", "analysis.figures analysis.figures.*"),
    ("", "analysis.explorer"),
    ("explorer", "analysis.explorer.*"),
    (MEASURED, "studies.scenes studies.timing studies.boxes studies.membrane_nodes"),
    ("bench tradeoff", "studies.bench.trajectories studies.interval_means"),
    ("bench", "studies.bench.*"),
    (MEASURED, "studies.meanings"),
    ("validation", "studies.validation studies.validation.*"),
    ("tradeoff", "studies.tradeoff.*"),
    ("stability", "studies.stability.*"),
]
"""Which fingerprints an edit of everything in a module changes; the first line that names it holds.

Other rooms than those that compute change none. The rooms of single figures and measurements are
declared as a whole; a new module elsewhere has to be put into the table.
"""


def declared(module: str) -> set[str]:
    """Return what the table says of a module."""
    name = module.removeprefix("softslip.")
    for stages, names in TABLE:
        if name in names.split() or f"{name.rpartition('.')[0]}.*" in names.split():
            return set(stages.split())
    pytest.fail(f"{module} is not in the table of modules and fingerprints: declare it there")


class Edited(Package):
    """The package with one module edited, none of whose names, errors and texts come or go."""

    def __init__(self, package: Package, module: str, edit: Callable[[ast.stmt], ast.stmt]) -> None:
        super().__init__(package.folder)
        self._unedited, self._edited, self._edit = package, module, edit

    def _module(self, name):
        read = self._unedited.module(name)
        if name != self._edited:
            return read
        changed = copy.deepcopy(read)
        changed.definitions = {
            name: [self._edit(statement) for statement in statements]
            for name, statements in changed.definitions.items()
        }
        changed.effects = [self._edit(statement) for statement in changed.effects]
        return changed

    def _definition(self, key):
        if key[0] == self._edited:
            return super()._definition(key)
        return self._unedited.definition(key)


def extended(statement: ast.stmt) -> ast.stmt:
    """Return a statement that computes one thing more."""
    (more,) = ast.parse("_EDITED = 1").body
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        statement.body.append(more)
        return statement
    return ast.If(test=ast.Constant(1), body=[statement, more], orelse=[])


def changed(before: dict[str, Code], after: dict[str, Code]) -> set[str]:
    return {stage for stage in before if before[stage].fingerprint != after[stage].fingerprint}


def name_of(file: Path) -> str:
    """Return the name of the module that a file of the package is."""
    parts = ["softslip", *file.with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def copied(folder: Path) -> Path:
    ignored = shutil.ignore_patterns("__pycache__", ".*")
    return Path(shutil.copytree(FOLDER, folder / "softslip", ignore=ignored))


def rewritten(folder: Path, rewrite: Callable[[ast.Module, Path], ast.AST]) -> Package:
    """Return a copy of the package in which each module's syntax tree is rewritten."""
    package = copied(folder)
    for file in sorted(package.rglob("*.py")):
        tree = rewrite(ast.parse(file.read_bytes()), file.relative_to(package))
        file.write_text(ast.unparse(ast.fix_missing_locations(tree)), "utf-8")
    return Package(package)


@pytest.fixture(scope="module")
def package():
    return Package(FOLDER)


@pytest.fixture(scope="module")
def original(package):
    """The code of all stages before any edit."""
    return read_code(package)


def test_an_edit_of_a_module_changes_the_fingerprints_that_the_table_declares(package, original):
    wrong = {}
    for module in package.modules:
        after = changed(original, read_code(Edited(package, module, extended)))
        if after != declared(module):
            wrong[module[9:]] = " ".join(s for s in ENTRIES if s in after)
    assert wrong == {}, "edits change other fingerprints than the table declares"


def test_every_name_in_the_table_is_that_of_a_module(package):
    names = {name.removesuffix(".*") for _, names in TABLE for name in names.split()}
    assert {f"softslip.{name}" for name in names} <= set(package.modules)


def test_no_edit_outside_the_rooms_that_compute_changes_a_fingerprint(original, tmp_path):
    edited = set()

    def rewrite(tree: ast.Module, file: Path) -> ast.Module:
        # Measurements count with the levels of fidelity, see below.
        if file.parts[0] not in ROOMS and file.name != "fidelity.py":
            edited.add(file.parts[0])
            definitions = (ast.FunctionDef, ast.ClassDef)
            tree.body = [
                extended(node) if isinstance(node, definitions) else node for node in tree.body
            ] + ast.parse("_EDITED = 1").body
        return tree

    after = read_code(rewritten(tmp_path, rewrite))
    rooms = {"config", "files", "provenance", "operations", "cli", "workbench", "errors.py"}
    assert rooms <= edited
    assert changed(original, after) == set()


class Reworded(ast.NodeTransformer):
    """Other docstrings, sentences of errors and annotations."""

    def __init__(self, counted: set[str]) -> None:
        self.counted = counted
        self.errors = 0

    def visit_Raise(self, node):
        self._reword(node)
        return node

    def visit_Call(self, node):
        if ast.unparse(node.func).endswith(("Error", "refuse", "_too_thin")):
            self._reword(node)
        return self.generic_visit(node)

    def _reword(self, node: ast.AST) -> None:
        for part in ast.walk(node):
            if isinstance(part, ast.Constant) and isinstance(part.value, str):
                part.value = f"in other words {part.value}"
                self.errors += 1

    def visit_Expr(self, node):
        if isinstance(node.value, ast.Constant):
            node.value = ast.Constant("Said otherwise.")
        return node

    def visit_FunctionDef(self, node):
        self.generic_visit(node)
        # These make errors.
        if node.returns is None or not ast.unparse(node.returns).endswith(("NoReturn", "Error")):
            node.returns = ast.Name("Whatever")
        for argument in (*node.args.args, *node.args.kwonlyargs):
            names = ast.walk(argument.annotation or ast.Constant(None))
            if not self.counted & {part.id for part in names if isinstance(part, ast.Name)}:
                argument.annotation = ast.Name("Whatever")
        return node


def test_remarks_formatting_annotations_and_sentences_of_errors_change_no_fingerprint(
    package, original, tmp_path
):
    entries = [fingerprints.entry(package, name) for names in ENTRIES.values() for name in names]
    classes = {name for entry in entries for _, name in package.arguments_of(entry)}
    reworded = Reworded(classes)
    # Written out again, without comments and with other quotes, brackets and line breaks.
    after = read_code(rewritten(tmp_path, lambda tree, _: reworded.visit(tree)))
    assert reworded.errors > 100
    assert changed(original, after) == set()


@pytest.mark.parametrize(
    ("old", "new", "stages"),
    [
        ('1.0, symbol="K_e"', '2.0, symbol="K_e"', MEASURED),
        ("Elastic boundary", "Boundary", ""),
        ('description="Membrane modulus."', 'description="Modulus."', ""),
        ('unit="stress unit"', 'unit="stress"', ""),
        ("paper=1.0, gt=0", "paper=1.0, ge=0", ""),
    ],
)
def test_of_the_configuration_only_defaults_count_and_only_for_measurements(
    original, tmp_path, old, new, stages
):
    file = copied(tmp_path) / "config/sections/material.py"
    text = file.read_text("utf-8")
    assert text.count(old) > 0
    file.write_text(text.replace(old, new), "utf-8")
    assert changed(original, read_code(Package(tmp_path / "softslip"))) == set(stages.split())


def test_levels_of_fidelity_count_for_measurements(original, tmp_path):
    file = copied(tmp_path) / "config/fidelity.py"
    text = file.read_text("utf-8")
    file.write_text(text.replace("_level(0.1, 6.0,", "_level(0.1, 6.5,"), "utf-8")
    after = read_code(Package(tmp_path / "softslip"))
    assert changed(original, after) == set(MEASURED.split())


UNCOUNTED = {
    "simulation.checkpoint",
    "simulation.interruption",
    "simulation.checkpoint_generations",
    "simulation.checkpointer",
    "simulation.end_state",
    "analysis.comparison_markdown",
    "studies.bench.bench_markdown",
    "studies.bench.elements_markdown",
    "studies.publish",
    "studies.stability.map_markdown",
    "studies.study",
}
"""What only resumes runs, reads studies, or shows and publishes what was measured."""


def test_what_commands_call_of_the_rooms_that_compute_is_in_a_fingerprint(package):
    counted = {key for stage in ENTRIES for key in definitions_of(stage, package)}
    missing = set()
    for file in (FOLDER / "cli").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_bytes())):
            if isinstance(node, ast.ImportFrom) and package.computes(str(node.module)):
                for alias in node.names:
                    target = package.attribute(str(node.module), alias.name)
                    key = (target.name, WHOLE) if isinstance(target, ModuleName) else target
                    if key not in counted:
                        missing.add(key[0].removeprefix("softslip."))
    assert missing == UNCOUNTED


HANDED = {
    # Files, their labels and seals.
    *("COMMENT", "CONTENT_DIGEST", "FLAG_ATTRIBUTES", "MOVING", "STILLS", "content_digest"),
    *("labelled_page", "page_digest", "read_dataset", "replacing", "sealed", "unsealed"),
    *("with_fields", "with_text"),
    # Reading and checking studies; defaults and levels count by themselves.
    *("LEVELS", "NOTHING", "brief", "extra", "in_file", "key_text", "owner", "quantity"),
    *("read_mapping", "relocated"),
    # Which functions draw: the entries of `draw` are these; and what has too few pictures.
    *("FIGURES", "MOVIE_SNAPSHOTS"),
    # Names of parameters and what the paper gives of them.
    *("MATERIAL", "all_fields", "departures", "label_of"),
    # Reports.
    *("counted", "table_row"),
    # What notes that a run is to stop.
    "signals_handled",
}
"""Functions and constants of other rooms that those that compute use, but not for a result."""


def test_the_rooms_that_compute_take_nothing_from_others_that_decides_what_they_compute(package):
    handed = set()
    for module in package.modules:
        for source, name in package.module(module).imports.values():
            outside = source.startswith("softslip.") and not package.computes(source)
            # Units and meanings of quantities.
            if source == "softslip.files.quantities":
                continue
            if outside and package.path_of(source) and name:
                defined = package.module(source).definitions.get(name, [])
                handed |= {name for one in defined if not isinstance(one, ast.ClassDef)}
    assert handed == HANDED


OTHER = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}


def mutated(node: ast.AST) -> Iterator[None]:
    """Change one number or operator below a node after the other, and take it back."""
    if isinstance(node, ast.Raise | ast.Assert) or (
        getattr(node, "returns", None) is not None
        and ("Error" in ast.unparse(node.returns) or "NoReturn" in ast.unparse(node.returns))
    ):
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        value, node.value = node.value, node.value + 1
        yield
        node.value = value
    for name in ("op", "ops"):
        before = getattr(node, name, None)
        operator = before[0] if isinstance(before, list) else before
        if type(operator) in OTHER:
            other = OTHER[type(operator)]()
            setattr(node, name, [other, *before[1:]] if isinstance(before, list) else other)
            yield
            setattr(node, name, before)
    for name, part in ast.iter_fields(node):
        if name not in ("annotation", "returns"):
            for child in part if isinstance(part, list) else [part]:
                if isinstance(child, ast.AST):
                    yield from mutated(child)


def test_every_number_and_operator_that_shear_computes_with_is_in_its_fingerprint(package):
    count, functions = 0, 0
    for key in sorted(definitions_of("shear", package)):
        module, name = key
        if name in (WHOLE, EFFECTS):
            continue
        statements = package.module(module).definitions[name]
        before = package.define(key, statements)
        functions += isinstance(statements[0], ast.FunctionDef)
        for statement in statements:
            for _ in mutated(statement):
                assert package.define(key, statements) != before, (
                    f"a changed {module}.{name} has the same digest: {ast.unparse(statement)}"
                )
                count += 1
        assert package.define(key, statements) == before
    assert functions > 100
    assert count > 2000


def moved(tree: ast.Module, module: Callable[[str], str]) -> ast.Module:
    """Rename modules in all imports of the package in a tree."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("softslip"):
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                if module(whole) != whole:
                    alias.asname = alias.asname or alias.name
                    alias.name = module(whole).rpartition(".")[2]
            node.module = module(str(node.module))
    return tree


def test_renamed_modules_change_no_fingerprint(package, original, tmp_path, monkeypatch):
    paths = {name: package.path_of(name) for name in package.modules}
    names = {name for name, path in paths.items() if path.name != "__init__.py"}

    def module(name: str) -> str:
        parts = name.split(".")
        for end in range(3, len(parts) + 1):
            if ".".join(parts[:end]) in names:
                parts[end - 1] = f"{parts[end - 1]}_renamed"
                break
        return ".".join(parts)

    after = rewritten(tmp_path, lambda tree, _: moved(tree, module))
    for name in names:
        path = after.folder / paths[name].relative_to(FOLDER)
        path.rename(path.with_stem(f"{path.stem}_renamed"))
    entries = {stage: tuple(map(module, names)) for stage, names in ENTRIES.items()}
    assert entries != ENTRIES
    monkeypatch.setattr(fingerprints, "ENTRIES", entries)
    assert changed(original, read_code(Package(after.folder))) == set()


def test_definitions_moved_to_other_modules_in_another_order_change_no_fingerprint(
    package, original, tmp_path
):
    folder = copied(tmp_path)
    count = 0
    for module in package.modules:
        file = folder / package.path_of(module).relative_to(FOLDER)
        read = package.module(module)
        if module.split(".")[1] != "solver" or file.name == "__init__.py" or read.effects:
            continue
        tree = ast.parse(file.read_bytes())
        imports = [node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)]
        others = [node for node in tree.body if node not in imports]
        # No matter whether it would run: what refers to what is the same.
        text = ast.unparse(ast.Module([*imports, *reversed(others)], []))
        file.with_stem(f"{file.stem}_parts").write_text(text, "utf-8")
        names = ", ".join(read.definitions)
        file.write_text(f"from {module}_parts import {names}\n", "utf-8")
        count += 1
    assert count > 20
    assert changed(original, read_code(Package(folder))) == set()


SMALL = {
    "errors.py": "class OwnError(Exception): ...",
    "config.py": "from softslip.solver.d import SIZE\nLIMIT = 1",
    "solver/__init__.py": "",
    "solver/a.py": """
import numpy as np
from softslip.config import LIMIT, SIZE
from softslip.errors import OwnError
from softslip.solver import b
from softslip.solver.c import TABLE, deep
_REMEDY = "use less"
def entry(x):
    if x > LIMIT:
        raise OwnError(f"{x} is too much; {_REMEDY}")
    _check(x)
    return b.half(np.sqrt(x)) + SIZE * TABLE[deep(x)]
def _check(x) -> None:
    if x < 0:
        _refuse("x", x, f"is below zero; {_REMEDY}")
def _refuse(name, x, what) -> OwnError:
    raise OwnError(name, f"{x} {what}", "try again")
def idle(x):
    return x
""",
    "solver/b.py": "def half(x): return x / 2\ndef idle(x): return x\n",
    "solver/c.py": """
TABLE = {1: 2}
def deep(x): return deeper(x) if x else 0
def deeper(x): return deep(x - 1)
def idle(x): return x
""",
    "solver/d.py": "SIZE = 2\ndef late(x): return x\n",
}
"""A package whose entry is `solver.a.entry`."""

MOVED = {
    "solver/a.py": ("import b\n", "import e as b\n"),
    "solver/b.py": ("def half(x): return x / 2", "LEFT = 0"),
    "solver/e.py": ("", "def half(x): return x / 2"),
}


@pytest.fixture
def digits(tmp_path, monkeypatch):
    """Return a function that gives the fingerprint of the small package after replacements."""
    monkeypatch.setattr(fingerprints, "ENTRIES", {"small": ("softslip.solver.a.entry",)})
    monkeypatch.setattr(fingerprints, "DATA", {})

    def read(replaced: dict[str, tuple[str, str]] | None = None) -> str:
        for file in {**SMALL, **(replaced or {})}:
            text = SMALL.get(file, "")
            if replaced and file in replaced:
                assert replaced[file][0] in text
                text = text.replace(*replaced[file], 1) if text else replaced[file][1]
            path = tmp_path / file
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        return read_code(Package(tmp_path))["small"].fingerprint

    return read


@pytest.mark.parametrize(
    "replaced",
    [
        {"solver/a.py": ("is too much", "is far too much")},
        {"solver/a.py": ("use less", "use more")},
        {"solver/a.py": ("is below zero", "is negative")},
        {"solver/a.py": ("try again", "give up")},
        {"solver/a.py": ("def idle(x):\n    return x", "def idle(x):\n    return x + 1")},
        {"solver/a.py": ("import numpy as np\n", "import numpy as np\nimport math\n")},
        {"solver/a.py": ("def entry(x)", "def entry(x: int) -> float")},
        {"solver/b.py": ("def idle(x): return x", "def idle(x): return x + 1")},
        {"solver/d.py": ("return x", "return x + 1")},
        {"config.py": ("LIMIT = 1", "LIMIT = 2")},
        MOVED,
        {"solver/a.py": ("c import TABLE, deep", "f import TABLE, deep"),
         "solver/f.py": ("", "from softslip.solver.c import *\nfrom .c import TABLE, deep\n")},
    ],
)  # fmt: skip
def test_what_has_no_effect_on_the_entry_changes_nothing(digits, replaced):
    assert digits(replaced) == digits()


@pytest.mark.parametrize(
    "replaced",
    [
        {"solver/a.py": ("x > LIMIT", "x >= LIMIT")},
        {"solver/a.py": ("raise OwnError(f", "raise ValueError(f")},
        {"solver/a.py": ("np.sqrt", "np.cbrt")},
        {"solver/a.py": ("import numpy as np", "import scipy as np")},
        {"solver/a.py": ("b.half", "b.idle")},
        {"solver/a.py": ("x < 0", "x < 1")},
        {"solver/a.py": ("import b\n", "import d as b\n")},
        {"solver/b.py": ("x / 2", "x / 3")},
        {"solver/d.py": ("SIZE = 2", "SIZE = 3")},
        {"solver/b.py": ("def half", "@twice\ndef half")},
        {"solver/b.py": ("def half(x)", "def half(x, y=1)")},
        {"solver/b.py": ("def idle", "print(half)\ndef idle")},
        {"solver/b.py": ("def idle", "half.least = 2\ndef idle")},
        {"solver/b.py": ("def idle", "half = 1\ndef idle")},
        {"solver/b.py": ("def idle", "@register\ndef idle")},
        {"solver/b.py": ("def idle", "if LIMIT:\n    half = 1\ndef idle")},
        {"solver/c.py": ("{1: 2}", "{1: 3}")},
        {"solver/c.py": ("x - 1", "x - 2")},
        {"solver/c.py": ("TABLE = {1: 2}", "TABLE = {1: 2}\nTABLE[3] = 4")},
        {"solver/c.py": ("deeper(x) if", "deep(x) if")},
        {"solver/__init__.py": ("", "import os\nos.environ['A'] = 'b'")},
    ],
)
def test_what_has_an_effect_on_the_entry_changes_its_fingerprint(digits, replaced):
    assert digits(replaced) != digits()


@pytest.mark.parametrize(
    "body",
    [
        "from softslip.solver import d\n    return d.late(x)",
        "from softslip.solver.d import late\n    return late(x)",
        "import softslip.solver.d\n    return softslip.solver.d.late(x)",
        "import softslip.solver.d as d\n    return getattr(d, 'la' + 'te')(x)",
        "import importlib\n    return importlib.import_module('softslip.solver.' + 'd').late(x)",
        "return eval('softslip.solver.d.late(x)')",
    ],
)
def test_what_is_reached_in_other_ways_counts(digits, body):
    way = {
        "solver/a.py": (
            "if x > LIMIT",
            f"def other(x):\n        {body.replace('    ', '        ')}\n    if x > LIMIT",
        )
    }
    later = {**way, "solver/d.py": ("return x", "return x + 1")}
    assert digits(way) != digits(later)


@pytest.mark.parametrize(
    "way", ["b.idle(x)", "getattr(b, 'id' + 'le')(x)", "b.__dict__['idle'](x)"]
)
def test_attributes_that_cannot_be_resolved_count_with_the_whole_module(digits, way):
    use = {"solver/a.py": ("b.half(np.sqrt(x))", way)}
    edit = {**use, "solver/b.py": ("def idle(x): return x", "def idle(x): return x + 1")}
    assert digits(use) != digits(edit)


def test_star_imports_count_with_the_whole_module(digits):
    use = {"solver/a.py": ("import b\n", "import b\nfrom softslip.solver.d import *\n")}
    assert digits(use) != digits({**use, "solver/d.py": ("return x", "return x + 1")})


def test_a_local_name_does_not_hide_the_definition_of_the_same_name(digits):
    use = {"solver/a.py": ("_check(x)", "_check(x); [TABLE for TABLE in x]")}
    assert digits(use) != digits({**use, "solver/c.py": ("{1: 2}", "{1: 3}")})


def test_two_constants_bound_by_one_statement_are_told_apart(digits):
    def pair(name: str) -> dict[str, tuple[str, str]]:
        return {
            "solver/a.py": ("b.half(np.sqrt(x))", name),
            "solver/b.py": ("", "LOW, UP = 0, 1\n"),
        }

    assert digits(pair("b.LOW")) != digits(pair("b.UP"))


def test_an_entry_counts_with_the_classes_of_its_arguments(digits):
    use = {
        "solver/a.py": ("def entry(x)", 'def entry(x: "Plan")'),
        "solver/c.py": ("TABLE", "class Plan:\n    length = 1\nTABLE"),
    }
    use = {
        **use,
        "solver/a.py": ("def entry(x)", "from softslip.solver.d import Plan\ndef entry(x: Plan)"),
    }
    one, other = (
        digits({**use, "solver/d.py": ("def late", f"class Plan:\n    length = {n}\ndef late")})
        for n in (1, 2)
    )
    assert one != other


def test_an_entry_that_does_not_exist_is_refused(digits, monkeypatch):
    monkeypatch.setattr(fingerprints, "ENTRIES", {"small": ("softslip.solver.a.other",)})
    with pytest.raises(ValueError, match=r"a\.other is not defined"):
        digits()


def test_style_changes_figures_and_table_of_accuracies_nothing(original, tmp_path):
    folder = copied(tmp_path)
    style = folder / "analysis/figures/style.mplstyle"
    text = style.read_text("utf-8")
    style.write_text(f"# A remark.\n\n{text}", "utf-8")
    (folder / "config/accuracy.json").write_text("{}")
    assert changed(original, read_code(Package(folder))) == set()
    style.write_text(f"{text}\nlines.linewidth: 7\n", "utf-8")
    assert changed(original, read_code(Package(folder))) == {"draw"}


def test_every_data_file_is_counted_or_left_out_on_purpose(tmp_path):
    package = copied(tmp_path)
    data = {
        file.relative_to(package).as_posix()
        for file in package.rglob("*")
        if file.is_file() and file.suffix != ".py"
    }
    assert data == {name for names in DATA.values() for name in names} | set(UNCOUNTED_DATA)


ASK = "from softslip.provenance import fingerprints as f; print(f.FOLDER, f.fingerprints())"


def asked(package: Path, **settings: str) -> str:
    """Ask a package elsewhere, in a Python of its own, for its fingerprints."""
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "PYTHONUTF8": "1", **settings}
    done = subprocess.run(
        [sys.executable, "-c", ASK], env=environment, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr.decode()
    place, _, answer = done.stdout.decode(errors="replace").rpartition(" {")
    assert place == str(package)
    return answer


@pytest.mark.parametrize(
    ("folder", "settings"),
    [
        ("später – hier", {"LC_ALL": "C", "TZ": "Pacific/Apia", "PYTHONHASHSEED": "7"}),
        # Files are read as UTF-8 even where the locale says otherwise.
        ("on a share", {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONHASHSEED": "8"}),
    ],
)
def test_clones_on_different_machines_agree(tmp_path, folder, settings):
    other = copied(tmp_path / folder)
    for file in other.rglob("*"):
        if file.suffix in (".py", ".mplstyle"):
            file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    assert (other / "simulation" / "hydrodynamics.py").read_bytes().count(b"\r\n") > 100
    assert asked(other, **settings) == asked(FOLDER)


def test_nothing_is_written(tmp_path):
    package = copied(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    asked(package, PYTHONDONTWRITEBYTECODE="1", HOME=str(tmp_path))
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("x = 1", "x = 1.0"),
        ("x = 1", "x = True"),
        ("x = 1", "x = '1'"),
        ("x = 'a'", "x = b'a'"),
        ("x = None", "x = 'None'"),
        ("x = 0.1", "x = 0.10000000000000002"),
        ("x = [1, '']", "x = [1]"),
        ("x = (1,)", "x = 1"),
        ("x = a - (b - c)", "x = a - b - c"),
        ("x = {**a}", "x = {None: a}"),
        ("f(*a)", "f(**a)"),
        ("def f(a): return a", "def f(a, /): return a"),
        ("def f(a): return a", "def f(*, a): return a"),
        ("def f(a): return a", "@g\ndef f(a): return a"),
        ("if a:\n    x = 1\ny = 2", "if a:\n    x = 1\n    y = 2"),
        ("f'{a}'", "f'{a!r}'"),
        ("x = f'{a:.3f}'", "x = f'{a:.4f}'"),
        ("from a import b", "from .a import b"),
        ("a = b = 1", "b = a = 1"),
        ("x = 'é'", "x = 'e\u0301'"),
        ("raise ValueError('a')", "raise TypeError('a')"),
        ("raise ValueError('a')", "raise Stop('a')"),
        ("raise Stop('a')", "raise Stop('b')"),
        ("if a < b: raise ValueError('a')", "if a <= b: raise ValueError('a')"),
        ("raise ValueError(f'{(x := 1)}')", "raise ValueError(f'{(x := 2)}')"),
        ("f('a')", "f('b')"),
        ("assert x, 'no x'", "assert y, 'no x'"),
        ("class A(B):\n    x: int = 1", "class A(B):\n    x: float = 1"),
        ("class A:\n    x: ClassVar[int] = 1", "class A:\n    x: int = 1"),
        ("class A:\n    x: int = 1", "class A:\n    x = 1"),
        ("@validate\ndef f(a: int): return a", "@validate\ndef f(a: float): return a"),
    ],
)
def test_other_code_has_another_normal_form(one, other):
    assert normal_form(one.encode()) != normal_form(other.encode())


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("x = 1", "x   =  (1)  # one"),
        ("x = 'a'", 'x = "a"'),
        ("x = 'a'", "x = u'a'"),
        ("x = 'ab'", "x = ('a'\n     'b')"),
        ("x = 1e3", "x = 1_000.0"),
        ("def f(): pass", "def f():\n    'Do nothing.'"),
        ("class A(B): ...", "class A(B):\n    'B by another name.'\n    pass"),
        ("x = 1", "x = 1\n'What x is.'"),
        ("", "'What this module is.'"),
        ("def f(a): return a", "def f(a: int) -> int: return a"),
        ("x = 1", "x: int = 1"),
        ("class A:\n    x: int = 1", "class A:\n    x: float = 1"),
        ("raise ValueError('too long')", "raise ValueError(f'{x} is too long')"),
        ("assert x, 'no x'", "assert x"),
        ("def f() -> AError: return AError('a')", "def f() -> AError: return AError('b')"),
        ("if TYPE_CHECKING:\n    import a", ""),
    ],
)
def test_the_same_code_has_the_same_normal_form(one, other):
    assert normal_form(one.encode()) == normal_form(other.encode())


def test_line_ends_and_byte_order_mark_do_not_matter():
    text = b'x = """one\ntwo"""\ny = 1\n'
    assert normal_form(text.replace(b"\n", b"\r\n")) == normal_form(text)
    assert normal_form(b"\xef\xbb\xbf" + text) == normal_form(text)


def test_normal_form_is_that_of_every_version_of_python():
    # Spelt out: a later version that adds or renames fields for this code would show here.
    text = "def f(a, *, b=None):\n    'Doc.'\n    return f'{a:>{b}}é' if a else -1"
    assert normal_form(text.encode()) == (
        "Module(body=[FunctionDef(name='f',args=arguments(args=[arg(arg='a')],"
        "kwonlyargs=[arg(arg='b')],kw_defaults=[Constant()]),body=[Return(value=IfExp("
        "test=Name(id='a'),body=JoinedStr(values=[FormattedValue(value=Name(id='a'),"
        "conversion=-1,format_spec=JoinedStr(values=[Constant(value='>'),FormattedValue("
        "value=Name(id='b'),conversion=-1)])),Constant(value='\\xe9')]),"
        "orelse=UnaryOp(op=USub(),operand=Constant(value=1))))])])"
    )


def test_public_functions_tell_the_same():
    told = fingerprints.fingerprints()
    assert tuple(told) == tuple(ENTRIES)
    assert tuple(told)[: len(STAGES)] == STAGES
    for stage, digits in told.items():
        assert digits == fingerprint(stage)
        assert len(digits) == DIGITS
        assert set(digits) <= set(string.hexdigits)
        assert modules_of(stage)
        assert list(modules_of(stage)) == sorted(set(modules_of(stage)))


def test_what_a_caller_does_to_the_answer_stays_with_the_caller():
    told = fingerprints.fingerprints()
    told["packing"] = "another"
    assert fingerprint("packing") != "another"
    assert fingerprints.fingerprints()["packing"] != "another"


@pytest.mark.parametrize("ask", [fingerprint, modules_of])
def test_unknown_stage_is_refused_in_one_sentence(ask):
    with pytest.raises(ValueError, match="stage 'melting' has no fingerprint; use one of packing,"):
        ask("melting")
