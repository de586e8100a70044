"""What is measured is a table that estimates can be made from."""

import subprocess
from pathlib import Path

import pytest

from softslip.config.parameters import Parameters
from softslip.config.stages import STAGES
from softslip.errors import SoftslipError
from softslip.operations import calibration as module
from softslip.operations.calibration import calibrate
from softslip.operations.costs import read_table

TINY = {
    "fidelity": "preview",
    "channel": {"length": 0.046875, "height": 0.046875, "outer_gap": 0.0078125},
    "packing": {"equilibration_steps": 500},
    "expansion": {"ramp_steps": 500, "relaxation_steps": 200, "growth_nodes": 24},
    "time_stepping": {"ageing_time": 0.2, "shear_time": 0.5, "longest_step": 0.05},
    "recording": {"bulk_margin": None},
}
"""Eight particles: a fraction of a second a stage, besides its start."""


@pytest.mark.slow
def test_a_run_is_measured_through_all_stages(tmp_path: Path) -> None:
    said: list[str] = []
    calibrate(tmp_path / "table.json", said.append, [TINY])
    runs = read_table(tmp_path / "table.json")
    assert [run.stage for run in runs] == list(STAGES)
    assert all(run.parameters == Parameters.from_mapping(TINY) for run in runs)
    assert all(0.1 < run.core_seconds < 600 and run.size > 1000 for run in runs)
    assert [run.steps > 0 for run in runs] == [False, False, True, True]
    assert runs[-1].evaluations > runs[-1].steps
    assert said[0] == "compiling"
    assert said[1].startswith("running 1 of 1: ")


def test_a_run_that_fails_is_said_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(command, 1, "", "words\nPackingError: no room\n")

    monkeypatch.setattr(module.subprocess, "run", fail)
    with pytest.raises(SoftslipError, match=r"packing failed: PackingError: no room$"):
        calibrate(tmp_path / "table.json", lambda sentence: None)
    assert not list(tmp_path.iterdir())
