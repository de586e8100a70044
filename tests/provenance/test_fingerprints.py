import ast
import json
import os
import shutil
import string
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from softslip.config.stages import STAGES
from softslip.provenance import fingerprints
from softslip.provenance.fingerprints import (
    DATA,
    DIGITS,
    ENTRIES,
    FOLDER,
    UNCOUNTED_DATA,
    Code,
    fingerprint,
    modules_of,
    normal_form,
)

MEASURED = {"bench", "validation", "tradeoff", "stability"}
"""What is no part of a run, nor made of runs."""

EDITS = """
import functools, json, sys
from pathlib import Path
from softslip.provenance import fingerprints as tested

assert tested.FOLDER == Path(sys.argv[1]), f"reads {tested.FOLDER}"
# The same text has the same normal form: only edited modules are parsed again.
tested.normal_form = functools.cache(tested.normal_form)
if len(sys.argv) > 2:
    tested.grimp.build_graph = functools.cache(tested.grimp.build_graph)
answers = []
for edit in json.load(sys.stdin):
    before = {name: (tested.FOLDER / name).read_bytes() for name in edit}
    for name, text in edit.items():
        (tested.FOLDER / name).write_bytes(text.encode())
    code = tested.read_code()
    answers.append({stage: [one.modules, one.fingerprint] for stage, one in code.items()})
    for name, text in before.items():
        (tested.FOLDER / name).write_bytes(text)
json.dump(answers, sys.stdout)
"""
"""Reads the code of a package once for each edit of its files, which it takes back.

With a further argument no edit touches an import, and the graph is built once.
"""

IMPORTS = """
import importlib, json, sys

answer = {}
for entries in json.load(sys.stdin):
    for name in [name for name in sys.modules if name.partition(".")[0] == "softslip"]:
        del sys.modules[name]
    for entry in entries:
        importlib.import_module(entry)
    loaded = [name for name in sys.modules if name.partition(".")[0] == "softslip"]
    answer["+".join(entries)] = loaded
json.dump(answer, sys.stdout)
"""
"""Imports some modules, each time anew, and says which modules that has loaded."""


def run(script: str, package: Path, given: object, *options: str, **settings: str) -> str:
    """Run a script in a Python of its own that finds the package in a copy."""
    # Many short scans of the imports are slower on several threads, which tests share anyway.
    fixed = {"PYTHONPATH": str(package.parent), "RAYON_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script, str(package), *options],
        input=json.dumps(given),
        env={**os.environ, **fixed, **settings},
        cwd=package.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def codes(
    package: Path, edits: Sequence[Mapping[str, str]], *options: str, **settings: str
) -> list[dict[str, Code]]:
    """Return the code of all stages after each edit, which maps files to their new text."""
    return [
        {stage: Code(tuple(modules), digits) for stage, (modules, digits) in answer.items()}
        for answer in json.loads(run(EDITS, package, edits, *options, **settings))
    ]


def changed(before: Mapping[str, Code], after: Mapping[str, Code]) -> set[str]:
    return {stage for stage in before if before[stage].fingerprint != after[stage].fingerprint}


def name_of(file: str) -> str:
    """Return the name of the module that a file of the package is."""
    parts = ["softslip", *Path(file).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def copied(source: Path, folder: Path) -> Path:
    return Path(
        shutil.copytree(
            source, folder / "softslip", ignore=shutil.ignore_patterns("__pycache__", ".*")
        )
    )


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A copy of the package, which every test leaves as it was."""
    return copied(FOLDER, tmp_path_factory.mktemp("clone"))


@pytest.fixture(scope="module")
def sources(package):
    """The text of every module by its file."""
    files = sorted(package.rglob("*.py"))
    return {file.relative_to(package).as_posix(): file.read_text("utf-8") for file in files}


@pytest.fixture(scope="module")
def original(package):
    """The code of all stages before any edit."""
    return codes(package, [{}])[0]


@pytest.fixture(scope="module")
def extended(package, sources, original):
    """Which stages change when a statement is added to a module, by the module's name."""
    counted = {module for code in original.values() for module in code.modules}
    edited = {file: f"{text}\n_EXTRA = 1\n" for file, text in sources.items()}
    apart = [{file: text} for file, text in edited.items() if name_of(file) in counted]
    # What counts nowhere changes nothing, be it one module or all: they are edited at once.
    together = {file: text for file, text in edited.items() if name_of(file) not in counted}
    answers = codes(package, [*apart, together], "no edit of imports")
    *one_by_one, last = [changed(original, code) for code in answers]
    return {
        **{name_of(file): last for file in together},
        **{name_of(next(iter(edit))): one for edit, one in zip(apart, one_by_one, strict=True)},
    }


def test_remarks_and_rewording_change_no_fingerprint(package, sources, original):
    edit = {}
    for file, text in sources.items():
        assert text.startswith('"""'), f"{file} does not begin with a docstring"
        edit[file] = text.replace('"""', '"""In other words: ', 1) + "\n\n# A remark.\n"
    (after,) = codes(package, [edit])
    assert changed(original, after) == set()


def test_formatting_and_attribute_docstrings_change_no_fingerprint(package, sources, original):
    counted = {module for code in original.values() for module in code.modules}
    edit = {}
    for file in (file for file in sources if name_of(file) in counted):
        tree = ast.parse(sources[file])
        for node in ast.walk(tree):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                node.value = ast.Constant("Said otherwise.")
        # Written out anew, without comments and with other quotes, brackets and line breaks.
        edit[file] = ast.unparse(tree)
    (after,) = codes(package, [edit])
    assert changed(original, after) == set()


def test_a_new_statement_changes_exactly_the_stages_that_import_its_module(extended, original):
    assert len(extended) > 100
    for module, stages in extended.items():
        importing = {stage for stage, code in original.items() if module in code.modules}
        assert stages == importing, f"{module} changes {stages}, but {importing} import it"


@pytest.mark.parametrize(
    ("module", "stages"),
    [
        ("softslip.simulation.packing", {"packing"}),
        ("softslip.simulation.contour", {"packing", "expansion"}),
        # Expansion grows chains by geometry alone, without the contact force of the later stages.
        ("softslip.simulation.growth", {"expansion"}),
        ("softslip.simulation.expansion", {"expansion"}),
        ("softslip.solver.compilation", {"expansion", "ageing", "shear"}),
        ("softslip.solver.kernels", {"ageing", "shear"}),
        ("softslip.solver.neighbours", {"expansion", "ageing", "shear"}),
        ("softslip.solver.steric", {"ageing", "shear"}),
        ("softslip.solver.contacts", {"ageing", "shear"}),
        ("softslip.solver.mobility", {"ageing", "shear"}),
        ("softslip.simulation.hydrodynamics", {"ageing", "shear"}),
        ("softslip.config.scenario", {"gather"}),
        ("softslip.analysis.observables.tables", {"gather", "fit", "draw"}),
        # The figure of the flow curves draws the fitted law.
        ("softslip.analysis.fits.flow", {"fit", "draw"}),
        ("softslip.analysis.figures.rheology", {"draw"}),
        ("softslip.config.parameters", set(ENTRIES) - MEASURED),
        ("softslip", set(ENTRIES) - MEASURED),
        ("softslip.studies.validation.couette", set()),
        ("softslip.provenance.fingerprints", set()),
    ],
)
def test_a_module_belongs_to_the_stages_that_are_made_by_it(extended, module, stages):
    assert extended[module] - MEASURED == stages


@pytest.mark.parametrize(
    ("module", "measurements"),
    [
        ("softslip.solver.contacts", MEASURED),
        ("softslip.studies.validation.couette", {"validation"}),
        ("softslip.studies.stability.limits", {"stability"}),
        ("softslip.studies.tradeoff.steady", {"tradeoff"}),
        # The trade-off's members run as the benchmark's trajectories, and load their package.
        ("softslip.studies.bench.roofline", {"bench", "tradeoff"}),
        ("softslip.studies.scenes", MEASURED),
        ("softslip.analysis.figures.rheology", set()),
        ("softslip.studies.study", set()),
    ],
)
def test_a_module_belongs_to_the_measurements_that_run_it(extended, module, measurements):
    assert extended[module] & MEASURED == measurements


def test_no_plotting_changes_a_stage_of_a_run(extended):
    plotting = {
        name: to for name, to in extended.items() if name.startswith("softslip.analysis.figures")
    }
    assert len(plotting) > 5
    assert set().union(*plotting.values()) == {"draw"}


def test_commands_and_progress_change_nothing(extended):
    people = {
        name: to
        for name, to in extended.items()
        if name.startswith(("softslip.cli", "softslip.operations.progress", "softslip.__main__"))
    }
    assert len(people) > 5
    assert set().union(*people.values()) == set()


def test_modules_are_those_that_really_load(package, original):
    distinct = sorted(set(ENTRIES.values()))
    answer = json.loads(run(IMPORTS, package, distinct, NUMBA_DISABLE_JIT="1"))
    # Equal, because no stage imports within a function; what one did would be counted besides.
    for stage, code in original.items():
        loaded = set(answer["+".join(ENTRIES[stage])])
        missed = loaded - set(code.modules)
        assert not missed, f"{stage} loads {missed}, which its fingerprint leaves out"
        idle = set(code.modules) - loaded
        assert not idle, f"the fingerprint of {stage} counts {idle}, which it does not load"


def test_imports_within_functions_count_and_those_for_types_do_not(package, sources):
    text = sources["simulation/contour.py"]
    within = f"{text}\ndef _late():\n    from softslip.analysis import paper\n    return paper\n"
    guarded = (
        f"{text}\nfrom typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from softslip.analysis import paper\n"
    )
    late, typed = codes(
        package, [{"simulation/contour.py": within}, {"simulation/contour.py": guarded}]
    )
    assert "softslip.analysis.paper" in late["packing"].modules
    assert "softslip.analysis.paper" not in typed["packing"].modules


def test_a_package_counts_with_the_modules_that_it_imports(package, sources):
    text = f"{sources['solver/mobility/__init__.py']}\nfrom softslip.analysis import paper\n"
    text_of_user = sources["simulation/contour.py"]
    user = f"{text_of_user}\nfrom softslip.solver.mobility.rest import RestWithoutForce\n"
    (after,) = codes(
        package, [{"solver/mobility/__init__.py": text, "simulation/contour.py": user}]
    )
    assert {"softslip.solver.mobility", "softslip.analysis.paper"} <= set(after["packing"].modules)


def test_release_number_changes_nothing(package, sources, original):
    text = sources["__init__.py"]
    later = text.replace('__version__ = "', '__version__ = "9.')
    assert later != text
    (after,) = codes(package, [{"__init__.py": later}])
    assert changed(original, after) == set()


def test_style_changes_figures_and_table_of_accuracies_nothing(package, original):
    style = (package / "analysis/figures/style.mplstyle").read_text("utf-8")
    table = json.loads((package / "config/accuracy.json").read_text("utf-8"))
    commented, styled, chosen = codes(
        package,
        [
            {"analysis/figures/style.mplstyle": f"# A remark.\n\n{style}"},
            {"analysis/figures/style.mplstyle": f"{style}\nlines.linewidth: 7\n"},
            {"config/accuracy.json": json.dumps({**table, "rows": table["rows"][1:]})},
        ],
    )
    assert changed(original, commented) == set()
    assert changed(original, styled) == {"draw"}
    assert changed(original, chosen) == set()


def test_every_data_file_is_counted_or_left_out_on_purpose(package):
    data = {
        file.relative_to(package).as_posix()
        for file in package.rglob("*")
        if file.is_file() and file.suffix != ".py"
    }
    assert data == {name for names in DATA.values() for name in names} | set(UNCOUNTED_DATA)


def with_carriage_returns(package: Path) -> Path:
    for file in package.rglob("*"):
        if file.suffix in (".py", ".mplstyle"):
            file.write_bytes(file.read_bytes().replace(b"\n", b"\r\n"))
    return package


@pytest.mark.parametrize(
    ("folder", "settings"),
    [
        ("später – hier", {"LC_ALL": "C", "TZ": "Pacific/Apia", "PYTHONHASHSEED": "7"}),
        # Files are read as UTF-8 even where the locale says otherwise.
        ("on a share", {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONHASHSEED": "8"}),
    ],
)
def test_clones_on_different_machines_agree(package, original, tmp_path, folder, settings):
    other = with_carriage_returns(copied(package, tmp_path / folder))
    assert (other / "simulation" / "hydrodynamics.py").read_bytes().count(b"\r\n") > 100
    (answer,) = codes(other, [{}], **settings)
    assert answer == original


def test_nothing_is_written(tmp_path):
    package = copied(FOLDER, tmp_path)
    before = sorted(tmp_path.rglob("*"))
    codes(package, [{}], PYTHONDONTWRITEBYTECODE="1", HOME=str(tmp_path))
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
        ("def f(a): return a", "def f(a: int): return a"),
        ("def f(a): return a", "@g\ndef f(a): return a"),
        ("if a:\n    x = 1\ny = 2", "if a:\n    x = 1\n    y = 2"),
        ("f'{a}'", "f'{a!r}'"),
        ("x = f'{a:.3f}'", "x = f'{a:.4f}'"),
        ("from a import b", "from .a import b"),
        ("a = b = 1", "b = a = 1"),
        ("x = 'é'", "x = 'e\u0301'"),
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
        ("__version__ = '1'", "__version__ = '2'"),
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
        assert set(ENTRIES[stage]) < set(modules_of(stage))
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
