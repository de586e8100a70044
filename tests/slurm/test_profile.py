"""The workflow through profiles/slurm, on a real cluster of one machine (`make test-slurm`)."""

import json
import math
import os
import random
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from loopback import Cluster, missing
from matplotlib.image import imread
from projects import copy_project

from softslip.config.stages import STAGES
from softslip.files.labels import text_attributes
from softslip.files.storage import CONTENT_DIGEST
from softslip.operations.checkpoint_files import checkpointed_progress
from softslip.operations.job_requests import MARGIN, STARTING, STOPPING
from softslip.provenance.attribution import read_provenance

pytestmark = [pytest.mark.slurm, pytest.mark.slow]

INTERVAL = 5
"""Seconds between two checkpoints."""

BEGINNING = 15.0
"""Processor seconds until a run begins to work, plus a step and the writing of a checkpoint."""

CANCELLED = 20

NO_ACCOUNTING = "profiles/slurm/no-accounting"
"""Folder with a `sacct` for clusters without accounting, such as that of this test."""

RECORD = "SOFTSLIP_SLURM"
"""Environment variable with the file for what was counted."""

WANTED = ("results/small/fits.nc", "results/small/figures/fig5.png")
"""All stages, datasets over all runs, and a figure."""

CI = (Path(__file__).parents[2] / "config" / "ci.yaml").read_text()

LONG = """\
description: A run of many minutes; its numbers mean nothing.
base:
  fidelity: standard
  hydrodynamics: {node_spacing: 4} # at 5 a film becomes too thin for the nodes at t = 73000
  channel: {length: 0.0625, height: 0.09375, outer_gap: 0.0078125}
  time_stepping: {ageing_time: 2, shear_time: TIME}
  recording: {snapshots: []}
axes:
  rheometer.stress: [0.5]
"""

TRIAL = 1000
"""Duration of a run that tells how long one takes on this machine [time unit]."""

NEEDED = 950.0
"""Processor time that a run takes which requests twenty minutes [s]."""

LONGEST = 2
"""Minutes of a job; its run is told to stop after 30 to 60 s, of which it takes 10 to begin."""

OF_NEED = 10
"""Times as long as that is what the run would request that knew what it takes."""

ATTEMPTS = 100
"""Most jobs of a run, twice as many as the profile's: 20 are cancelled, and the others each work
for 20 to 50 s."""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    reason = missing()
    if reason:
        # Who wants the record asks for these tests by name.
        (pytest.fail if RECORD in os.environ else pytest.skip)(reason)
    with Cluster(tmp_path_factory.mktemp("slurm") / "cluster") as cluster:
        yield cluster


class Project:
    """A copy of the workflow with one scenario.

    Parameters
    ----------
    folder
        Where the copy is made.
    scenario
        Its text.
    """

    def __init__(self, folder: Path, scenario: str) -> None:
        self.folder = copy_project(folder)
        (folder / "config" / "small.yaml").write_text(scenario)
        self.results = folder / "results" / "small"

    def start(self, *words: str) -> subprocess.Popen[bytes]:
        """Start Snakemake; what it says goes to `said`."""
        command = [sys.executable, Path(__file__).with_name("impatient.py")]
        settings = ["--config", "scenario=small", f"checkpoint={INTERVAL}", f"longest={LONGEST}"]
        with (self.folder / "said").open("wb") as log:
            return subprocess.Popen(
                [*command, *settings, *words],
                cwd=self.folder,
                env=os.environ | {"PATH": f"{self.folder / NO_ACCOUNTING}:{os.environ['PATH']}"},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )

    @property
    def said(self) -> str:
        """What Snakemake has said."""
        return (self.folder / "said").read_text()

    def finish(self, *words: str) -> None:
        """Run Snakemake to a good end."""
        assert self.start(*words).wait() == 0, self.said

    def digests(self) -> Mapping[str, str]:
        """Return the content digest of each dataset: what a rerun repeats to the last bit."""
        return {
            str(path.relative_to(self.results)): text_attributes(path, (CONTENT_DIGEST,))[
                CONTENT_DIGEST
            ]
            for path in sorted(self.results.rglob("*.nc"))
        }

    def pictures(self) -> Mapping[str, bytes]:
        """Return the pixels of each figure; its file says besides when it was drawn."""
        return {
            str(path.relative_to(self.results)): imread(path).tobytes()
            for path in sorted(self.results.rglob("*.png"))
        }


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Return the results of the ci scenario by one process of this machine."""
    project = Project(tmp_path_factory.mktemp("small") / "local", CI)
    project.finish("--cores", "2")
    return project


def through_slurm(*words: str) -> tuple[str, ...]:
    return ("--profile", "profiles/slurm", *words)


def test_the_ci_scenario_gives_the_same(cluster: Cluster, small: Project, tmp_path: Path) -> None:
    project = Project(tmp_path / "cluster", CI)
    project.finish(*through_slurm())
    assert project.digests() == small.digests()
    assert project.pictures() == small.pictures()
    limits = Counter(cluster.limits())
    pictures = sum("snapshots" in name for name in project.pictures())
    assert limits["5:00"] == pictures > 0, f"pictures of runs ask for five minutes: {limits}"


@dataclass
class Attempt:
    """One process that worked on a run.

    Attributes
    ----------
    process
        Which process.
    job
        Number of its job.
    stage, run
        What it worked on.
    ends
        When it may be cancelled [s, monotonic].
    used, kept
        Processor time until it was seen last, and until its latest checkpoint [s].
    written
        When its latest checkpoint was written, or when it began as long as there is none [POSIX
        time].
    """

    process: psutil.Process
    job: str
    stage: str
    run: str
    ends: float
    written: float
    used: float = 0.0
    kept: float = 0.0

    def look(self, results: Path) -> bool:
        """Take note of what the process has done; False where it has ended."""
        try:
            times = self.process.cpu_times()
            alive = self.process.status() != psutil.STATUS_ZOMBIE
        except psutil.NoSuchProcess:
            alive = False
        if alive:
            self.used = times.user + times.system
        progress = checkpointed_progress(results, self.stage, self.run)
        if progress is not None and progress.written > self.written:
            self.kept, self.written = self.used, progress.written
        return alive

    @property
    def lost(self) -> float:
        """Processor time that is in no checkpoint [s]."""
        return self.used - self.kept


class Watch:
    """What the processes of a project's runs do, by looking twice a second.

    Parameters
    ----------
    project
        Whose processes.
    """

    def __init__(self, project: Project) -> None:
        self._project, self._random = project, random.Random(1)
        self.working: list[Attempt] = []
        self.ended: list[Attempt] = []

    def look(self) -> None:
        """Take note of the processes that are at work."""
        working = {attempt.process for attempt in self.working}
        for process in set(psutil.process_iter()) - working:
            with suppress(psutil.Error):
                self._meet(process)
        for attempt in list(self.working):
            if not attempt.look(self._project.results):
                self.working.remove(attempt)
                self.ended.append(attempt)

    def _meet(self, process: psutil.Process) -> None:
        words = process.cmdline()
        stage = next((stage for stage in STAGES[2:] if stage in words), None)
        if stage is None or "--output" not in words or process.cwd() != str(self._project.folder):
            return
        ends = time.monotonic() + self._random.uniform(0, 3 * INTERVAL)
        run, job = words[words.index(stage) + 2], process.environ()["SLURM_JOB_ID"]
        began = process.create_time()
        self.working.append(Attempt(process, job, stage, run, ends, began))


class Trouble:
    """What befalls a cluster while it works.

    Each attempt is cancelled at a random moment, until that has happened often enough. Meanwhile a
    node's daemon is killed and the controller ended; they are started again, as systemd does.

    Parameters
    ----------
    cluster
        Which one.
    """

    def __init__(self, cluster: Cluster) -> None:
        self._cluster = cluster
        self.cancelled = 0
        # After so many cancelled jobs this happens, and so many seconds later that.
        self._ahead = [
            (6, cluster.kill_node, 60.0, cluster.start_node),
            (13, cluster.end_controller, 20.0, cluster.start_controller),
        ]
        self._undo: tuple[float, Callable[[], None]] | None = None

    @property
    def is_over(self) -> bool:
        """Whether everything has happened."""
        return not self._ahead and self._undo is None and self.cancelled == CANCELLED

    def befall(self, working: Sequence[Attempt]) -> None:
        """Let happen what is due."""
        now = time.monotonic()
        if self._undo is not None and now >= self._undo[0]:
            self._undo[1]()
            self._undo = None
        if self._ahead and self._undo is None and self.cancelled >= self._ahead[0][0]:
            _, do, later, undo = self._ahead.pop(0)
            do()
            self._undo = (now + later, undo)
        for attempt in working:
            if now >= attempt.ends and self.cancelled < CANCELLED:
                attempt.ends = math.inf
                self.cancelled += self._cluster.cancel(attempt.job)


def seconds_taken(project: Project) -> float:
    """Return the processor time of the shear of a project."""
    (path,) = (project.results / "shear").glob("*.nc")
    origin = read_provenance(text_attributes(path, ("provenance",)))
    return float(origin["core_seconds"])


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the scenario of a run that takes `NEEDED` on this machine."""
    trial = Project(tmp_path_factory.mktemp("trial") / "local", LONG.replace("TIME", str(TRIAL)))
    trial.finish("--cores", "1", *WANTED)
    return LONG.replace("TIME", str(round(TRIAL * NEEDED / seconds_taken(trial))))


def test_an_unlucky_workflow_ends_unattended_with_the_same(
    cluster: Cluster, lasting: str, tmp_path: Path
) -> None:
    local = Project(tmp_path / "local", lasting)
    beside = local.start("--cores", "1", *WANTED)
    project = Project(tmp_path / "cluster", lasting)
    before = Counter(cluster.ends())
    process = project.start(*through_slurm("--preemptible-retries", str(ATTEMPTS), *WANTED))
    watch, trouble = Watch(project), Trouble(cluster)
    try:
        while process.poll() is None:
            watch.look()
            trouble.befall(watch.working)
            time.sleep(0.5)
    finally:
        process.kill()
        alone = beside.wait()
    assert process.returncode == 0, project.said
    assert alone == 0, local.said
    assert trouble.is_over, f"{trouble.cancelled} jobs were cancelled"
    ends = Counter(cluster.ends()) - before
    assert ends["CANCELLED"] == CANCELLED, ends
    assert ends["FAILED"] + ends["TIMEOUT"] >= OF_NEED, f"few jobs came to their limits: {ends}"
    assert project.digests() == local.digests()
    needed = (STARTING + MARGIN * seconds_taken(local) + STOPPING) / 60
    assert needed >= OF_NEED * LONGEST
    lost = [attempt.lost for attempt in watch.ended]
    if RECORD in os.environ:
        seconds = {"used": sum(attempt.used for attempt in watch.ended), "lost": sum(lost)}
        minutes = {"requested": math.ceil(needed), "longest": LONGEST}
        record = {"attempts": len(lost), "jobs": ends, "minutes": minutes, "seconds": seconds}
        target = Path(os.environ[RECORD])
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(json.dumps(record | {"each": sorted(lost)}) + "\n")
    assert max(lost) <= BEGINNING + INTERVAL, sorted(lost)
