"""The mutants: made by cosmic-ray, less those that cannot matter."""

import ast
from argparse import Namespace
from pathlib import Path

import cosmic_ray.plugins
from cosmic_ray.commands import init
from cosmic_ray.config import load_config
from cosmic_ray.mutating import mutate_code
from cosmic_ray.tools.filters.filter_app import FilterApp
from cosmic_ray.tools.filters.operators_filter import OperatorsFilter
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, WorkerOutcome, WorkResult

CONFIG = Path(__file__).with_name("cosmic-ray.toml")

Place = tuple[int, int]
Region = tuple[Place, Place]

_COMPILERS = {"compiled", "compiled_exactly"}


def make(session: Path) -> None:
    """Write a new work database of all mutants, with those that are left out marked so."""
    config = load_config(str(CONFIG))
    with use_db(str(session)) as database:
        init([Path(name) for name in config["module-path"]], database, {})
    OperatorsFilter().main([str(session), str(CONFIG)])
    NoBehaviour().main([str(session)])


def source_of(mutation: MutationSpec) -> str | None:
    """Return the source of the mutated module, None where there is nothing to mutate."""
    operator = cosmic_ray.plugins.get_operator(mutation.operator_name)
    source = mutation.module_path.read_text(encoding="utf-8")
    try:
        return mutate_code(source, operator(**mutation.operator_args), mutation.occurrence)
    except AttributeError:
        # cosmic-ray cannot replace an exception that is named with its module, as in zipfile's.
        return None


class NoBehaviour(FilterApp):
    """Leaves out annotations, arguments of decorators, texts of errors, and `compiled` itself."""

    def description(self) -> str:
        return str(self.__doc__)

    def filter(self, work_db: WorkDB, args: Namespace) -> None:
        skipped = WorkResult(worker_outcome=WorkerOutcome.SKIPPED, output="no behaviour")
        regions: dict[Path, list[Region]] = {}
        idle: list[str] = []
        for item in work_db.pending_work_items:
            (mutation,) = item.mutations
            path = mutation.module_path
            if path not in regions:
                regions[path] = _regions(path.read_text(encoding="utf-8"))
            if any(_within(mutation.start_pos, region) for region in regions[path]):
                idle.append(item.job_id)
        work_db.set_multiple_results(idle, skipped)


def _regions(source: str) -> list[Region]:
    """Return where nothing matters to what a module does."""
    found: list[ast.expr] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef):
            found += [node.returns] if node.returns else []
            for decorator in node.decorator_list:
                if isinstance(decorator, ast.Name) and decorator.id in _COMPILERS:
                    found.append(decorator)
        elif isinstance(node, ast.arg | ast.AnnAssign) and node.annotation:
            found.append(node.annotation)
        elif isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            found += [text for text in node.exc.args if isinstance(text, ast.JoinedStr)]
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            for decorator in node.decorator_list:
                if isinstance(decorator, ast.Call):
                    found += [*decorator.args, *(word.value for word in decorator.keywords)]
    return [_region(node) for node in found]


def _region(node: ast.expr) -> Region:
    start = node.lineno, node.col_offset
    return start, (node.end_lineno or node.lineno, node.end_col_offset or node.col_offset + 1)


def _within(place: Place, region: Region) -> bool:
    # Decorators of cosmic-ray begin at their sign, one before the name.
    (first, column), end = region
    return (first, column - 1) <= place < end
