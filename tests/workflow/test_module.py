"""The workflow as a module of another one, and from another folder."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from projects import ROOT, TINY, copy_project

from softslip.config.scenario import load_scenario
from softslip.operations.lock import run_lock

pytestmark = pytest.mark.workflow

SNAKEFILE = """\
module softslip:
    snakefile: {snakefile!r}
    config: {{"scenario": "tiny.yaml"}}
    {prefix}


use rule * from softslip as softslip_*


onstart:
    softslip.onstart()


onsuccess:
    softslip.onsuccess()


rule packed:
    default_target: True
    input:
        "{results}/packing/{run}.nc",
"""


@pytest.fixture(params=["", 'prefix: "out"'], ids=["plain", "prefix"])
def module(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Return a folder with a workflow that has this one as a module, and its results' folder."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    (run,) = load_scenario(str(tmp_path / "tiny.yaml")).stage_table("packing")
    results = tmp_path / "out" / "results" if request.param else tmp_path / "results"
    text = SNAKEFILE.format(
        snakefile=str(ROOT / "workflow" / "Snakefile"),
        prefix=request.param,
        results=(results / "tiny").relative_to(tmp_path),
        run=run,
    )
    (tmp_path / "Snakefile").write_text(text)
    return results / "tiny"


def snakemake(folder: Path, *words: str) -> tuple[int, str]:
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def test_a_module_cleans_up_and_runs_alone(module: Path) -> None:
    folder = module.parents[2] if module.parents[1].name == "out" else module.parents[1]
    needless = module / "shear" / "checkpoints" / f"{'0' * 16}.{'1' * 16}.checkpoint"
    needless.parent.mkdir(parents=True)
    needless.touch()
    with run_lock(module, "workflow"):
        status, said = snakemake(folder)
        assert status != 0
        assert "is being worked on by process" in said
    assert needless.exists()
    status, said = snakemake(folder)
    assert status == 0, said
    assert not needless.exists()
    assert (module / "workflow.lock").exists()


def deployed(folder: Path) -> Path:
    """Return where `snakedeploy deploy-workflow` put this workflow, from a repository of it."""
    repository, place = folder / "repository", folder / "deployed"
    copy_project(repository)
    git = ["git", "-c", "user.name=test", "-c", "user.email=test@localhost"]
    for words in (["init"], ["add", "."], ["commit", "--message=all"], ["tag", "v1"]):
        subprocess.run([*git, *words], cwd=repository, capture_output=True, check=True)
    deploy = [str(Path(sys.executable).with_name("snakedeploy")), "deploy-workflow"]
    words = [str(repository), str(place), "--tag", "v1", "--name", "softslip"]
    done = subprocess.run([*deploy, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return place


@pytest.mark.skipif(
    sys.version_info >= (3, 13), reason="snakedeploy does not install in Python 3.13"
)
def test_a_deployed_workflow_runs_the_scenario_of_its_settings(tmp_path: Path) -> None:
    place = deployed(tmp_path)
    settings = place / "config" / "config.yaml"
    settings.write_text(settings.read_text().replace("scenario: demo", "scenario: tiny"))
    (place / "config" / "tiny.yaml").write_text(TINY)
    snakefile = place / "workflow" / "Snakefile"
    text, name = snakefile.read_text(), '"workflow/Snakefile"'
    assert text.count(name) == 1, "snakedeploy names it otherwise now: see config/README.md"
    snakefile.write_text(text.replace(name, f'"{tmp_path}/repository/workflow/Snakefile"'))
    (run,) = load_scenario(str(place / "config" / "tiny.yaml")).stage_table("packing")
    packing = f"results/tiny/packing/{run}.nc"
    status, said = snakemake(place, packing)
    assert status == 0, said
    assert (place / packing).is_file()
    status, said = snakemake(place, "--report", "report.html")
    assert status == 0, said
    assert "What is missing" in (place / "report.html").read_text("utf-8")


def test_tables_figures_and_pages_of_a_module_are_below_its_prefix(
    whole: Path, tmp_path: Path
) -> None:
    (tmp_path / "tiny.yaml").write_text(TINY)
    text = SNAKEFILE.format(
        snakefile=str(ROOT / "workflow" / "Snakefile"),
        prefix='prefix: "out"',
        results="out/results/tiny",
        run="none",
    )
    (tmp_path / "Snakefile").write_text(text)
    results = tmp_path / "out" / "results" / "tiny"
    shutil.copytree(whole / "results" / "tiny", results)
    again = ("fits.nc", "comparison.nc", "explorer.html", "figures/fig5.png")
    for name in again:
        (results / name).unlink()
    before = {path: path.stat().st_mtime_ns for path in results.glob("shear/*.nc")}
    status, said = snakemake(tmp_path, "softslip_all")
    assert status == 0, said
    assert all((results / name).is_file() for name in again)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    status, said = snakemake(tmp_path, "--report", "report.html", "softslip_all")
    assert status == 0, said
    assert "out/results/tiny/figures/fig5.png" in (tmp_path / "report.html").read_text("utf-8")
    assert not (tmp_path / "results").exists()


def test_a_module_takes_a_scenario_from_packing_to_figures_below_its_prefix(
    tmp_path: Path,
) -> None:
    scenario = ROOT / "config" / "ci.yaml"
    text = SNAKEFILE.format(
        snakefile=str(ROOT / "workflow" / "Snakefile"),
        prefix='prefix: "out"',
        results="out/results/ci",
        run="none",
    )
    (tmp_path / "Snakefile").write_text(text.replace("tiny.yaml", str(scenario)))
    results = tmp_path / "out" / "results" / "ci"
    wanted = [results / "fits.nc", results / "figures" / "fig5.png"]
    status, said = snakemake(tmp_path, *(str(each.relative_to(tmp_path)) for each in wanted))
    assert status == 0, said
    assert all(each.is_file() for each in wanted)
    table = load_scenario(str(scenario)).stage_table
    for stage in ("packing", "expansion", "ageing", "shear"):
        assert {each.stem for each in (results / stage).glob("*.nc")} == set(table(stage))
    assert {each.name for each in tmp_path.iterdir()} == {".snakemake", "Snakefile", "out"}


def test_a_python_without_softslip_is_named(tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['softslip'] = None; "
        "from snakemake.cli import main; main(sys.argv[1:])"
    )
    words = ("--snakefile", str(ROOT / "workflow" / "Snakefile"), "--dry-run")
    command = [sys.executable, "-c", code, *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert f"softslip: is not installed for {sys.executable}" in done.stdout + done.stderr


def test_a_scenario_runs_from_any_folder(tmp_path: Path) -> None:
    (tmp_path / "tiny.yaml").write_text(TINY)
    words = ("--snakefile", str(ROOT / "workflow" / "Snakefile"), "--dry-run", "--config")
    status, said = snakemake(tmp_path, *words, "scenario=tiny.yaml")
    assert status == 0, said


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "'demo' is not in the folder config of the current directory; change to"),
        (
            ("numerics", "--config", "scenario=tiny.yaml"),
            "'full' is no study in the folder config/numerics of the current directory; change to",
        ),
        (
            ("--config", "scenario=tiny.yaml", "numerics=mine"),
            "--config numerics=mine: is no file in config/numerics; change to",
        ),
    ],
)
def test_what_another_folder_does_not_have_is_said(
    tmp_path: Path, words: tuple[str, ...], sentence: str
) -> None:
    (tmp_path / "tiny.yaml").write_text(TINY)
    call = ("--snakefile", str(ROOT / "workflow" / "Snakefile"), "--dry-run", *words)
    status, said = snakemake(tmp_path, *call)
    assert status != 0
    assert sentence in said, said
    assert "Traceback" not in said
