"""Python and Snakemake use each other's results."""

from pathlib import Path

import pytest
from projects import TINY, copy_project
from tiny import snakemake

import softslip as ss
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES

pytestmark = pytest.mark.workflow


def test_each_reuses_what_the_other_has_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    project = tmp_path / "project"
    copy_project(project)
    (project / "config" / "tiny.yaml").write_text(TINY)
    monkeypatch.chdir(project)
    (run,) = load_scenario("tiny").runs()
    snakemake(project, f"results/tiny/ageing/{run.ids['ageing']}.nc")
    capfd.readouterr()
    sheared = ss.shear("tiny", folder="results/tiny")
    assert "1 stage to do (shear)" in capfd.readouterr().err
    assert sheared.attrs["run"] == run.ids["shear"]
    planned = snakemake(project, "all", "--dry-run")
    rules = {line.split()[0] for line in planned.splitlines() if line.split()}
    assert "gather" in rules, planned
    assert not rules & set(STAGES), planned
