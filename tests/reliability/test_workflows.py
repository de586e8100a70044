"""Snakemake itself: killed with its jobs, killed alone, asked to stop, and started twice."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
import pytest
import xarray as xr
from chain import FIGURE, LONG, SCENARIO, STAGES, Chain, content_of
from projects import copy_project

from softslip.config.scenario import load_scenario
from softslip.files.storage import CONTENT_DIGEST
from softslip.simulation.checkpoint import SUFFIX, read_header

pytestmark = [pytest.mark.reliability, pytest.mark.slow, pytest.mark.workflow]

PATIENCE = 240.0


class Workflow:
    """A copy of the workflow with one small scenario.

    Parameters
    ----------
    folder
        Where the copy is made.
    scenario
        Its text.
    """

    def __init__(self, folder: Path, scenario: str) -> None:
        self.folder = folder
        copy_project(folder)
        source = folder / "config" / "small.yaml"
        source.write_text(scenario)
        (run,) = load_scenario(str(source)).runs()
        self.results = folder / "results" / "small"
        self.chain = Chain(source, self.results, run.ids, warm=None)

    def start(self) -> subprocess.Popen[bytes]:
        """Start Snakemake in a session of its own; what it says goes to `said`.

        Into a file, not a pipe, which jobs that outlive it would keep open.
        """
        target = self.chain.output(Path("results/small"), FIGURE)
        command = [sys.executable, "-m", "snakemake", "--cores", "1", "--config"]
        with (self.folder / "said").open("wb") as said:
            return subprocess.Popen(
                [*command, "scenario=small", "checkpoint=0.2", "--", str(target)],
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def said(self) -> str:
        """What the latest Snakemake has said."""
        return (self.folder / "said").read_text()

    def log(self, stage: str) -> str:
        """Return what the latest job of a stage has said."""
        return self.chain.output(self.results / "logs", stage).with_suffix(".log").read_text()

    def run(self) -> tuple[int, str]:
        """Run it to its end; return its exit status and what it said."""
        return self.start().wait(timeout=PATIENCE), self.said

    def digests(self) -> dict[str, str]:
        """Return the content digest of every stage and of the figure."""
        found: dict[str, str] = {}
        for stage in STAGES:
            with xr.open_dataset(self.chain.output(self.results, stage)) as dataset:
                found[stage] = dataset.attrs[CONTENT_DIGEST]
        return found | {FIGURE: content_of(self.chain.output(self.results, FIGURE))}

    def finish(self) -> dict[str, str]:
        """Run it to its end, which must be a good one; return what came out."""
        status, said = self.run()
        assert status == 0, said
        assert not list(self.results.rglob(f"*{SUFFIX}"))
        return self.digests()

    def jobs(self, stage: str) -> list[psutil.Process]:
        """Return the live processes that work on a stage of this copy."""
        found = []
        for process in psutil.process_iter(["cmdline", "cwd", "status"]):
            words, place = process.info["cmdline"] or [], process.info["cwd"]
            at_work = process.info["status"] != psutil.STATUS_ZOMBIE
            if at_work and place == str(self.folder) and stage in words and "--output" in words:
                found.append(process)
        return found

    def wait_for_checkpoint(self, stage: str) -> None:
        """Wait until a stage has kept itself."""
        deadline = time.monotonic() + PATIENCE
        while not list((self.results / stage).rglob(f"*{SUFFIX}")):
            assert time.monotonic() < deadline, f"{stage} was never kept"
            time.sleep(0.02)

    def wait_for_no_jobs(self) -> None:
        """Wait until nobody works on any stage."""
        deadline = time.monotonic() + PATIENCE
        while any(self.jobs(stage) for stage in STAGES):
            assert time.monotonic() < deadline, "a job does not end"
            time.sleep(0.1)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return what an undisturbed workflow makes."""
    return Workflow(tmp_path_factory.mktemp("whole") / "copy", SCENARIO).finish()


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """Return an undisturbed workflow with a long shear, and what it makes."""
    folder = tmp_path_factory.mktemp("long") / "copy"
    return folder, Workflow(folder, LONG).finish()


@pytest.fixture
def at_work(long, tmp_path: Path) -> tuple[Workflow, subprocess.Popen, dict[str, str]]:
    """Return a workflow whose shear has just been kept, its process, and what it should make."""
    folder, expected = long
    flow = Workflow(tmp_path / "copy", LONG)
    shutil.copytree(folder / "results", flow.folder / "results")
    shutil.copytree(folder / ".snakemake", flow.folder / ".snakemake")
    for stage in ("shear", FIGURE):
        flow.chain.output(flow.results, stage).unlink()
    process = flow.start()
    flow.wait_for_checkpoint("shear")
    return flow, process, expected


def test_the_workflow_makes_what_the_warm_children_make(chain: Chain, whole) -> None:
    figure = content_of(chain.output(chain.folder, FIGURE))
    assert whole == chain.digests | {FIGURE: figure}


@pytest.mark.parametrize("part", range(2))
def test_killed_with_its_jobs_at_random(whole, tmp_path: Path, tally, part: int) -> None:
    counts = tally("kills of Snakemake and its jobs")
    random = np.random.default_rng(np.random.SeedSequence([7, part]))
    flow, start = Workflow(tmp_path / "copy", SCENARIO), time.monotonic()
    while counts["killed"] < 10:
        process = flow.start()
        try:
            assert process.wait(timeout=random.uniform(2, 12)) == 0, flow.said
            assert flow.digests() == whole
            counts["finished"] += 1
            shutil.rmtree(flow.results)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            counts["killed"] += 1
    assert flow.finish() == whole
    counts["finished"] += 1
    counts["seconds"] += round(time.monotonic() - start)


@contextmanager
def held_up(flow: Workflow, stage: str) -> Iterator[None]:
    """Stop the clock of the job that works on a stage while the block runs."""
    (job,) = flow.jobs(stage)
    job.suspend()
    try:
        yield
    finally:
        job.resume()


@pytest.mark.parametrize("turn", range(3))
def test_killed_alone_its_orphan_keeps_others_away(at_work, tally, turn: int) -> None:
    flow, process, expected = at_work
    counts = tally("kills of Snakemake alone")
    time.sleep(0.3 * turn)
    process.kill()
    process.wait()
    counts["killed"] += 1
    assert flow.jobs("shear"), "the job did not outlive it"
    with held_up(flow, "shear"):
        status, said = flow.run()
    assert status != 0
    assert "LockedError: run " in said, said
    assert "is being worked on by process" in said
    counts["kept away"] += 1
    flow.wait_for_no_jobs()
    # What the orphan has made is whole, and taken as it is.
    assert flow.chain.output(flow.results, "shear").exists()
    assert flow.finish() == expected
    counts["finished"] += 1


@pytest.mark.parametrize("turn", range(2))
def test_killed_alone_the_work_of_its_orphan_is_not_lost(at_work, tally, turn: int) -> None:
    """Snakemake takes the orphan's result for incomplete, removes it and asks for it anew."""
    flow, process, expected = at_work
    counts = tally("orphans that finish")
    time.sleep(0.3 * turn)
    process.kill()
    process.wait()
    counts["killed"] += 1
    flow.wait_for_no_jobs()
    assert flow.chain.output(flow.results, "shear").exists()
    steps = read_header(next((flow.results / "shear").rglob(f"*{SUFFIX}"))).step
    assert flow.finish() == expected
    assert "resuming from" in flow.log("shear"), "the work of the orphan is lost"
    counts["steps kept"] += steps
    counts["finished"] += 1


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("whom", ["alone", "group"])
def test_asked_to_stop(at_work, tally, number: signal.Signals, whom: str) -> None:
    """Whatever it makes of the signal, the same command ends well once its job has ended."""
    flow, process, expected = at_work
    counts = tally(f"{number.name} to Snakemake, {whom}")
    if whom == "alone":
        process.send_signal(number)
    else:
        os.killpg(process.pid, number)
    process.wait(timeout=PATIENCE)
    counts["sent"] += 1
    counts["said so"] += process.returncode != 0
    counts["job lived on"] += bool(flow.jobs("shear"))
    counts["checkpoint left"] += bool(list(flow.results.rglob(f"*{SUFFIX}")))
    flow.wait_for_no_jobs()
    assert flow.finish() == expected
    counts["finished"] += 1


def test_the_second_of_two_is_turned_away(at_work, tally) -> None:
    flow, process, expected = at_work
    counts = tally("second workflows on one folder")
    with held_up(flow, "shear"):
        for _ in range(3):
            status, said = flow.run()
            assert status != 0
            assert "run workflow is being worked on by process" in said, said
            assert "Traceback" not in said, said
            counts["turned away"] += 1
    assert process.wait(timeout=PATIENCE) == 0, flow.said
    assert flow.digests() == expected
    counts["finished"] += 1
