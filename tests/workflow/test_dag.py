"""What Snakemake would do, from dry runs."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from projects import copy_project
from tiny import snakemake as snakemake_tiny

import softslip

pytestmark = pytest.mark.workflow


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a copy of what the workflow is made of, without any results."""
    return copy_project(tmp_path)


def snakemake(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def jobs(folder: Path, *words: str) -> dict[str, int]:
    """Return how many jobs of each rule a dry run wants."""
    result = snakemake(folder, *words, "--dry-run", "--quiet", "rules")
    assert result.returncode == 0, result.stderr
    return {rule: int(count) for rule, count in re.findall(r"^(\w+) +(\d+)$", result.stdout, re.M)}


def test_stresses_share_packing_expansion_and_ageing(copy: Path) -> None:
    found = jobs(copy)
    stages = {stage: found[stage] for stage in ("packing", "expansion", "ageing", "shear")}
    assert stages == {"packing": 4, "expansion": 4, "ageing": 4, "shear": 24}
    assert found["figure"] == 9
    assert found["snapshot"] == 24
    assert found["explorer"] == 1
    assert found["movie"] == 1


def test_a_movie_is_made_where_a_run_keeps_enough_snapshots(copy: Path) -> None:
    found = jobs(copy, "movie")
    assert {rule: found[rule] for rule in ("shear", "movie")} == {"shear": 1, "movie": 1}
    few = snakemake(copy, "movie", "--dry-run", "--config", "scenario=ci")
    assert few.returncode != 0
    said = few.stdout + few.stderr
    assert "movie: no run of ci keeps 5 snapshots or more after time 0; set rec" in said
    assert "Traceback" not in said


TOY = '''
"""A figure that is drawn from two datasets."""

from softslip.analysis.figures.velocity import profiles


def toy_figure(table, fits):
    """Draw a table."""
    return profiles(table)
'''
"""The module of a new figure."""

TOY_TABLE = """
        TableEntry(
            "toy_table",
            "gather",
            ("shear",),
            "softslip.analysis.observables.tables:profiles",
            "Toys.",
        ),
"""
TOY_FIGURE = """
        FigureEntry(
            "toy_figure",
            "figure",
            ("toy_table", FITS),
            "softslip.analysis.figures.toy:toy_figure",
        ),
"""


@pytest.fixture
def longer_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a package whose list of products holds one more dataset and figure before this one."""
    package = tmp_path / "package" / "softslip"
    shutil.copytree(
        Path(softslip.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__")
    )
    (package / "analysis" / "figures" / "toy.py").write_text(TOY)
    path = package / "files" / "products.py"
    text = path.read_text()
    for before, entry in (
        ("        TableEntry(\n            FITS,", TOY_TABLE),
        ("        FigureEntry(SNAPSHOT,", TOY_FIGURE),
    ):
        assert text.count(before) == 1, before
        text = text.replace(before, entry + before)
    path.write_text(text)
    paths = [str(package.parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(paths))


@pytest.mark.usefixtures("longer_list")
def test_rules_make_a_table_and_a_figure_that_the_list_of_products_adds(copy: Path) -> None:
    found = jobs(copy)
    assert (found["gather"], found["figure"]) == (5, 10)
    shown = snakemake(copy, "--dry-run", "results/demo/figures/toy_figure.png").stdout
    needed = re.search(r"toy_figure.png; Input files updated by another job: (.*)", shown)
    assert needed is not None, shown
    assert set(needed[1].split(", ")) == {"results/demo/toy_table.nc", "results/demo/fits.nc"}


@pytest.mark.usefixtures("longer_list")
def test_a_new_figure_is_one_file_and_one_entry(whole: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(whole, tmp_path / "copy")
    snakemake_tiny(folder, "all")

    def softslip_(*words: str) -> str:
        command = [sys.executable, "-m", "softslip", *words]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    picture, table = "figures/toy_figure.png", "toy_table.nc"
    numbers = softslip_("export", f"results/tiny/{picture}")
    assert numbers.startswith("# toy_figure of tiny\n")
    report = json.loads(softslip_("verify", "tiny", "--json"))
    verdicts = {Path(each["file"]).name: each for each in report["files"]}
    assert {Path(picture).name, table} <= set(verdicts)
    softslip_("crate", "tiny", "--zip", "crate.zip")
    with zipfile.ZipFile(folder / "crate.zip") as crate:
        names = crate.namelist()
    assert {f"results/tiny/{picture}", f"results/tiny/{table}"} <= set(names)
    # What is expected is missed where it is not there.
    (folder / "results" / "tiny" / picture).unlink()
    assert picture in softslip_("verify", "tiny", "--json")


def test_both_snakefiles_ask_for_the_same(copy: Path) -> None:
    root, inner = jobs(copy), jobs(copy, "--snakefile", "workflow/Snakefile")
    for found in (root, inner):
        for name in ("all", "default", "total"):  # They collect, each in its own Snakefile.
            found.pop(name, None)
    assert root == inner


def test_an_axis_added_in_the_config_alone_adds_its_runs(copy: Path) -> None:
    scenario = copy / "config" / "ci.yaml"
    scenario.write_text(scenario.read_text() + "  solvent.viscosity: [1.0, 2.0]\n")
    found = jobs(copy, "--config", "scenario=ci")
    stages = {stage: found[stage] for stage in ("packing", "expansion", "ageing", "shear")}
    assert stages == {"packing": 2, "expansion": 2, "ageing": 4, "shear": 8}


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("--config", "scenario=nowhere"), ("nowhere", "config")),
        (("--config", "stress=3"), ("--config stress", "scenario file")),
    ],
)
def test_a_bad_setting_is_refused_before_any_work(
    copy: Path, words: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    result = snakemake(copy, *words)
    said = result.stdout + result.stderr
    assert result.returncode != 0
    assert "Traceback" not in said, said
    for part in parts:
        assert part in said, f"{part!r} is not in {said!r}"
    assert not (copy / "results").exists(), "work was started"


def test_a_bad_scenario_is_refused_before_any_work(copy: Path) -> None:
    scenario = copy / "config" / "ci.yaml"
    scenario.write_text(scenario.read_text().replace("[0.0, 0.59]", "[0.0, -0.59]"))
    result = snakemake(copy, "--config", "scenario=ci")
    said = result.stdout + result.stderr
    assert result.returncode != 0
    assert "axes.wall.roughness[1]: -0.59" in said, said
    assert "Traceback" not in said, said
    assert not (copy / "results").exists(), "work was started"


def test_a_study_of_the_numerics_has_a_job_for_each_of_its_parts(copy: Path) -> None:
    found = jobs(copy, "numerics", "--config", "numerics=ci")
    assert found["validation"] == 9
    assert found["tradeoff_member"] == 9
    assert found["numerics_figure"] == 5
    assert found["stability"] > 10
    assert not {"shear", "measure"} & set(found)


def test_a_study_that_is_not_there_is_refused_before_anything_runs(copy: Path) -> None:
    result = snakemake(copy, "--dry-run", "numerics", "--config", "numerics=../full")
    assert result.returncode != 0
    assert "is no file in config/numerics; use one of ci, full" in result.stderr + result.stdout
