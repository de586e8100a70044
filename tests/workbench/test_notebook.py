"""The notebook of the documents runs from its first cell to its last, and shows what it says.

Its cells are run as a kernel does, without one: an expression that a cell ends with must have a
picture, a table or a value to show. A kernel and its client would be twenty packages more for that.
"""

import json
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

NOTEBOOK = Path(__file__).parents[2] / "docs" / "first_run.ipynb"

EXECUTE = """
import ast, json, sys

names = {"__name__": "__main__"}
shown = {}
for cell in json.load(sys.stdin):
    tree = ast.parse(cell["source"], cell["id"])
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, cell["id"], "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), cell["id"], "eval"), names)
        page = getattr(value, "_repr_html_", lambda: "")()
        shown[cell["id"]] = [type(value).__name__, page or repr(value)]
json.dump(shown, sys.stdout)
"""


@pytest.fixture(scope="module")
def notebook() -> nbformat.NotebookNode:
    return nbformat.read(NOTEBOOK, as_version=4)


@pytest.fixture(scope="module")
def shown(notebook, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """What the code cells end with, by their IDs: the type and how it is shown."""
    cells = [dict(cell) for cell in notebook.cells if cell.cell_type == "code"]
    done = subprocess.run(
        [sys.executable, "-c", EXECUTE],
        input=json.dumps(cells),
        cwd=tmp_path_factory.mktemp("notebook"),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_it_is_a_notebook_without_outputs(notebook) -> None:
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.outputs for cell in code] == [[]] * len(code), "clear all outputs"
    assert {cell.execution_count for cell in code} == {None}, "clear all outputs"


def test_every_code_cell_shows_something(notebook, shown) -> None:
    code = {cell.id for cell in notebook.cells if cell.cell_type == "code"}
    assert set(shown) == code
    assert all(text for _, text in shown.values())


def test_the_run_is_a_dataset_that_draws_figures(shown) -> None:
    assert shown["run"][0] == "Dataset"
    assert "velocity_profile" in shown["run"][1]
    assert "stress 0.5" in shown["averages"][1]
    assert {shown[name][0] for name in ("creep", "profile", "snapshot")} == {"Figure"}


def test_more_stress_strains_more(shown) -> None:
    larger, smaller = json.loads(shown["second"][1].replace("(", "[").replace(")", "]"))
    assert larger > smaller > 0


def test_both_runs_are_gathered(shown) -> None:
    assert "stress: 2" in shown["gathered"][1]
