"""Runs from Python are those of the commands, and what is there is not computed again."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import xarray as xr
from projects import TINY
from small_results import call

import softslip as ss
from softslip.config.scenario import load_scenario
from softslip.config.stages import STAGES
from softslip.errors import ConfigError, LockedError
from softslip.files.layout import CHECKPOINTS
from softslip.files.storage import CONTENT_DIGEST, read_dataset
from softslip.operations.lock import run_lock
from softslip.provenance.attribution import read_provenance
from softslip.workbench import run_chain
from softslip.workbench.arguments import single_run

STRESS = 0.2

LONG = {"stress": STRESS, "shear_time": 100.0}
"""A shear of some seconds: time to interrupt it."""

PATIENCE = 120.0
"""Seconds that are waited at most for another process to get somewhere."""


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("scenario") / "tiny.yaml"
    path.write_text(TINY)
    return str(path)


@pytest.fixture(scope="module")
def folder(scenario: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a call, which nobody may change but by further calls."""
    place = tmp_path_factory.mktemp("results")
    ss.shear(scenario, stress=STRESS, folder=place, progress=False)
    return place


def datasets(folder: Path) -> dict[str, set[str]]:
    return {stage: {path.stem for path in (folder / stage).glob("*.nc")} for stage in STAGES}


def test_a_run_is_what_the_commands_make(scenario: str, folder: Path, tmp_path: Path) -> None:
    run = ss.shear(scenario, stress=STRESS, folder=folder)
    source = tmp_path / "one.yaml"
    source.write_text(f"{TINY}axes:\n  rheometer.stress: [{STRESS}]\n")
    ids = load_scenario(str(source)).runs()[0].ids
    before: list[object] = []
    for stage, identity in ids.items():
        output = tmp_path / f"{stage}.nc"
        assert call([stage, source, identity, *before, "--output", output]) == ""
        before = ["--parent", output]
        theirs = read_dataset(output, stage=stage, run=identity)
        ours = read_dataset(folder / stage / f"{identity}.nc", stage=stage, run=identity)
        assert ours.attrs[CONTENT_DIGEST] == theirs.attrs[CONTENT_DIGEST], stage
    assert isinstance(run, xr.Dataset)
    assert run.attrs["run"] == ids["shear"]


def test_a_second_call_reads_what_is_there(
    scenario: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        pytest.fail("a command was run although all of its results are there")

    monkeypatch.setattr(run_chain, "run_command", refuse)
    first, second = (ss.shear(scenario, stress=STRESS, folder=folder) for _ in range(2))
    xr.testing.assert_identical(first, second)


def test_another_stress_reuses_all_but_the_shear(
    scenario: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = datasets(folder)
    ss.shear(scenario, stress=0.4, folder=folder)
    after = datasets(folder)
    assert [len(after[stage] - before[stage]) for stage in STAGES] == [0, 0, 0, 1]
    said = capfd.readouterr().err
    assert "1 stage to do (shear)" in said
    assert str(folder) in said
    assert "shear: step" in said
    assert "wrote" not in said


def test_a_rate_can_be_imposed(scenario: str, folder: Path) -> None:
    drive = {"mode": "rate", "stress": None, "shear_rate": 0.05}
    run = ss.shear(Path(scenario), folder=folder, progress=False, **drive)
    assert abs(run["shear_rate_wall"].values - 0.05).max() < 1e-9
    assert "rate 0.05" in repr(run.softslip)


def test_progress_can_be_silent(
    scenario: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    ss.shear(scenario, stress=0.3, folder=folder, progress=False)
    assert capfd.readouterr() == ("", "")


def test_a_run_that_somebody_works_on_is_refused(scenario: str, tmp_path: Path) -> None:
    ids = single_run(scenario, {"stress": STRESS}).runs()[0].ids
    with (
        run_lock(tmp_path / "packing" / CHECKPOINTS, ids["packing"]),
        pytest.raises(LockedError, match=f"is being worked on by process {os.getpid()}"),
    ):
        ss.shear(scenario, stress=STRESS, folder=tmp_path, progress=False)


def test_a_parameter_that_cannot_be_run_starts_nothing(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"rheometer\.stress: -1"):
        ss.shear(stress=-1, folder=tmp_path / "results")
    assert list(tmp_path.iterdir()) == []


SCRIPT = """
import signal
# A process that is started in the background of a script ignores it otherwise.
signal.signal(signal.SIGINT, signal.default_int_handler)
import sys, softslip as ss
try:
    ss.shear({scenario!r}, folder={folder!r}, **{given!r})
except KeyboardInterrupt as stopped:
    print(f"stopped {{stopped}}", flush=True)
"""


@pytest.fixture
def session(scenario: str, tmp_path: Path) -> Iterator["subprocess.Popen[str]"]:
    """A process that shears for some seconds, as soon as it does."""
    script = SCRIPT.format(scenario=scenario, folder=str(tmp_path), given=LONG)
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        run = single_run(scenario, LONG).runs()[0].ids["shear"]
        holder = tmp_path / "shear" / CHECKPOINTS / f"{run}.holder.json"
        wait_for(holder.exists, "the shear begins")
        time.sleep(1.0)
        yield process
        process.kill()


def wait_for(there: object, what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not there():
        assert time.monotonic() < end, f"waited {PATIENCE} s until {what}"
        time.sleep(0.02)


def checkpoints(folder: Path) -> list[Path]:
    return list((folder / "shear" / CHECKPOINTS).glob("*.ckpt*"))


def lives(folder: Path) -> bool:
    return any((folder / "shear" / CHECKPOINTS).glob("*.holder.json"))


def test_ctrl_c_stops_with_a_checkpoint_and_the_same_call_resumes(
    session: "subprocess.Popen[str]", scenario: str, tmp_path: Path
) -> None:
    session.send_signal(signal.SIGINT)
    said, _ = session.communicate(timeout=PATIENCE)
    assert said.startswith("stopped Interrupted: by SIGINT at t ="), said
    assert not lives(tmp_path)
    run = ss.shear(scenario, folder=tmp_path, progress=False, **LONG)
    assert read_provenance(run.attrs)["restarts"] == 1
    assert float(run["time"][-1]) == LONG["shear_time"]


def test_a_command_ends_with_a_checkpoint_when_its_session_is_killed(
    session: "subprocess.Popen[str]", scenario: str, tmp_path: Path
) -> None:
    session.kill()
    session.wait(timeout=PATIENCE)
    wait_for(lambda: not lives(tmp_path), "the command has noticed that its session is dead")
    assert not list((tmp_path / "shear").glob("*.nc")), "it was finished before it could notice"
    run = ss.shear(scenario, folder=tmp_path, progress=False, **LONG)
    assert read_provenance(run.attrs)["restarts"] == 1


IMPORTED = """
import sys, softslip
heavy = {"numpy", "xarray", "pandas", "pydantic", "matplotlib", "numba", "rich"}
print(sorted(heavy & set(sys.modules)), sorted(n for n in sys.modules if n.startswith("softslip.")))
print([name for name in ("shear", "open_results") if name not in dir(softslip)])
"""


def test_importing_the_package_imports_nothing_else() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTED], capture_output=True, text=True)
    assert done.stdout.splitlines() == ["[] []", "[]"], done.stdout + done.stderr


REGISTERED = """
import sys, softslip
softslip.open_results
import xarray
print(hasattr(xarray.Dataset(), "softslip"), "matplotlib" in sys.modules)
"""


def test_runs_that_are_opened_have_the_accessor_and_wait_for_nothing_that_draws() -> None:
    done = subprocess.run([sys.executable, "-c", REGISTERED], capture_output=True, text=True)
    assert done.stdout.split() == ["True", "False"], done.stdout + done.stderr


def test_a_name_that_does_not_exist_is_missing() -> None:
    with pytest.raises(AttributeError, match="no attribute 'sheer'"):
        _ = ss.sheer


def test_a_call_uses_the_package_that_it_is_of(scenario: str, folder: Path) -> None:
    """Also from a folder whose files have the names of modules that a command needs."""
    (folder / "json.py").write_text("raise RuntimeError('the wrong module')")
    script = SCRIPT.format(scenario=scenario, folder=str(folder), given={"stress": 0.35})
    place = str(Path(ss.__file__).parents[1])
    words = [sys.executable, "-P", "-c", f"import sys; sys.path.insert(0, {place!r})\n{script}"]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
