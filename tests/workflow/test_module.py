"""The workflow as a module of another one, and from another folder."""

import subprocess
import sys
from pathlib import Path

import pytest
from projects import ROOT, TINY

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
