"""The workflow through profiles/slurm, on a real cluster of one machine (`make test-slurm`)."""

import random
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from loopback import NODES, Cluster, missing, said
from projects import copy_project

from softslip.config.stages import STAGES
from softslip.files.labels import text_attributes
from softslip.files.storage import CONTENT_DIGEST
from softslip.operations.checkpoint_files import checkpointed_progress

pytestmark = [pytest.mark.slurm, pytest.mark.slow]

INTERVAL = 10
"""Seconds between two checkpoints."""

STEP = 5.0
"""Seconds until a checkpoint is written, beside those between two: a step, and a file, on a machine
whose processors others use too."""

CANCELLED = 20

CI = (Path(__file__).parents[2] / "config" / "ci.yaml").read_text()

LONG = CI.replace("shear_time: 5", "shear_time: 3000").replace("snapshots: [4.0]", "snapshots: []")
"""Ten minutes for each shear, where a job has one."""

SOON = ("--slurm-init-seconds-before-status-checks", "5", "--seconds-between-status-checks", "5")
"""Jobs are looked at sooner than a shared cluster would like."""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    reason = missing()
    if reason:
        pytest.skip(reason)
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
        command = [sys.executable, "-m", "snakemake", *words]
        settings = ["--config", "scenario=small", f"checkpoint={INTERVAL}"]
        with (self.folder / "said").open("wb") as log:
            return subprocess.Popen(
                [*command, *settings],
                cwd=self.folder,
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


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """Return the results of the ci scenario by one process of this machine."""
    project = Project(tmp_path_factory.mktemp("small") / "local", CI)
    project.finish("--cores", "2", "all")
    return project


def through_slurm(*words: str) -> tuple[str, ...]:
    return ("--profile", "profiles/slurm", "--slurm-no-account", *SOON, *words)


def test_the_ci_scenario_gives_the_same(cluster: Cluster, small: Project, tmp_path: Path) -> None:
    project = Project(tmp_path / "cluster", CI)
    project.finish(*through_slurm("all"))
    assert project.digests() == small.digests()


@dataclass
class Attempt:
    """One process that worked on a run.

    Attributes
    ----------
    process
        Its number.
    stage, run
        What it worked on.
    began, seen
        When it was seen first and last [POSIX time].
    kept
        When its latest checkpoint was written, or when it began as long as there is none.
    """

    process: int
    stage: str
    run: str
    began: float
    seen: float
    kept: float

    @property
    def lost(self) -> float:
        """Seconds of work that are in no checkpoint."""
        return max(self.seen - self.kept, 0.0)


class Watch:
    """What the processes of a project's runs do, by looking several times a second."""

    def __init__(self, project: Project) -> None:
        self._project = project
        self.attempts: dict[int, Attempt] = {}

    def look(self) -> None:
        """Take note of the processes that are at work."""
        now = time.time()
        for process in psutil.process_iter(["cmdline", "cwd", "status"]):
            words = process.info["cmdline"] or []
            if process.info["cwd"] != str(self._project.folder) or "--output" not in words:
                continue
            stage = next((word for word in words if word in STAGES[2:]), None)
            if stage is None or process.info["status"] == psutil.STATUS_ZOMBIE:
                continue
            run = words[words.index(stage) + 2]
            attempt = self.attempts.setdefault(
                process.pid, Attempt(process.pid, stage, run, now, now, now)
            )
            attempt.seen = now
            progress = checkpointed_progress(self._project.results, stage, run)
            if progress is not None and progress.written > attempt.kept:
                attempt.kept = progress.written


class Trouble:
    """What befalls a cluster while it works, one thing after another.

    Parameters
    ----------
    cluster
        Which one.
    """

    def __init__(self, cluster: Cluster) -> None:
        self._cluster, self._random = cluster, random.Random(1)
        self.cancelled = 0
        began = time.monotonic()
        # Seconds from now, and what happens then. A lost daemon is started again, as systemd does.
        self._ahead = [
            (began + 150, lambda: cluster.kill_node(NODES[1])),
            (began + 240, lambda: cluster.start_node(NODES[1])),
            (began + 330, cluster.kill_controller),
            (began + 350, cluster.start_controller),
        ]
        self._next_cancel = began + 60

    @property
    def is_over(self) -> bool:
        """Whether everything has happened."""
        return not self._ahead and self.cancelled == CANCELLED

    def befall(self) -> None:
        """Let happen what is due."""
        now = time.monotonic()
        if self._ahead and now >= self._ahead[0][0]:
            self._ahead.pop(0)[1]()
        if self.cancelled < CANCELLED and now >= self._next_cancel:
            jobs = self._cluster.jobs()
            if jobs:
                said("scancel", self._random.choice(jobs))
                self.cancelled += 1
                self._next_cancel = now + 20


def test_an_unlucky_workflow_ends_unattended_with_the_same(
    cluster: Cluster, tmp_path: Path, record_property
) -> None:
    local = Project(tmp_path / "local", LONG)
    local.finish("--cores", "2", "all")
    project = Project(tmp_path / "cluster", LONG)
    limits = [f"{stage}:runtime=1" for stage in STAGES[2:]]
    process = project.start(*through_slurm("--set-resources", *limits, "--", "all"))
    watch, trouble = Watch(project), Trouble(cluster)
    while process.poll() is None:
        watch.look()
        trouble.befall()
        time.sleep(0.1)
    assert process.returncode == 0, project.said
    assert trouble.is_over, f"{trouble.cancelled} jobs were cancelled"
    assert project.digests() == local.digests()
    lost = [attempt.lost for attempt in watch.attempts.values()]
    record_property("attempts", len(lost))
    record_property("seconds lost", sum(lost))
    assert max(lost) <= INTERVAL + STEP, sorted(lost)
