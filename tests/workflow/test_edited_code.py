"""What Snakemake would do again after an edit of the code: what the edit can have changed."""

import re
import shutil
from pathlib import Path

import pytest
from tiny import snakemake

import softslip
from softslip.files.products import FIGURES, FITS, TABLES, figures_of

pytestmark = pytest.mark.workflow

PACKAGE = Path(softslip.__file__).parent

EDIT = "\n    _EDITED = 1\n"
"""What every function and class of a module holds besides."""

REMARK = "\n    # A remark.\n"

DRAWN = len(figures_of("figure"))
FROM_FITS = sum(FITS in FIGURES[name].parents for name in figures_of("figure"))

AFTER_TABLES = {
    **{"gather": len(TABLES), "fit": 1, "compare": 1},
    **{"figure": DRAWN, "snapshot": 1, "explorer": 1},
}
AFTER_SHEAR = {"shear": 1, **AFTER_TABLES}
AFTER_EXPANSION = {"expansion": 1, "ageing": 1, **AFTER_SHEAR}

EDITS = [
    ("solver/contacts.py", EDIT, {"ageing": 1, **AFTER_SHEAR}),
    ("analysis/figures/membranes.py", EDIT, {"figure": DRAWN, "snapshot": 1}),
    ("solver/contacts.py", REMARK, {}),
    pytest.param(
        "simulation/packing.py", EDIT, {"packing": 1, **AFTER_EXPANSION}, marks=pytest.mark.slow
    ),
    pytest.param("simulation/growth.py", EDIT, AFTER_EXPANSION, marks=pytest.mark.slow),
    pytest.param(
        "analysis/observables/steady.py",
        EDIT,
        AFTER_TABLES,
        marks=pytest.mark.slow,
    ),
    pytest.param(
        "analysis/fits/slip.py",
        EDIT,
        # Of the figures only those that are drawn from the fit.
        {"fit": 1, "compare": 1, "figure": FROM_FITS},
        marks=pytest.mark.slow,
    ),
    # The wording of what a scenario is refused with, and what its parameters mean.
    ("config/checks.py", EDIT, {}),
    pytest.param("config/sections/material.py", EDIT, {}, marks=pytest.mark.slow),
    pytest.param("files/storage.py", EDIT, {}, marks=pytest.mark.slow),
    pytest.param("cli/stage_commands.py", EDIT, {}, marks=pytest.mark.slow),
    pytest.param("studies/validation/couette.py", EDIT, {}, marks=pytest.mark.slow),
]


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return a copy of the package that may be edited."""
    folder = tmp_path_factory.mktemp("package") / "softslip"
    return shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))


@pytest.mark.parametrize(("module", "edit", "again"), EDITS)
def test_an_edit_makes_again_what_it_can_have_changed(
    whole: Path, package: Path, module: str, edit: str, again: dict[str, int]
) -> None:
    path = package / module
    before = path.read_text()
    # What a function or class holds begins after the line that ends with a colon.
    edited = re.sub(r"^((?:def|class) .*?:)\n", rf"\1{edit}", before, flags=re.M | re.S)
    path.write_text(edited)
    try:
        settings = {"PYTHONPATH": str(package.parent)}
        said = snakemake(whole, "all", "--dry-run", "--quiet", "rules", settings=settings)
    finally:
        path.write_text(before)
    found = {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", said, re.M)}
    assert {rule: count for rule, count in found.items() if rule not in ("all", "total")} == again
