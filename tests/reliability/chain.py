"""A small run through every stage, and the processes that it is done in."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xarray as xr
from projects import TINY

from softslip.config.scenario import load_scenario
from softslip.files.stamps import check_figure
from softslip.files.storage import CONTENT_DIGEST
from softslip.simulation.checkpoint import SUFFIX

HERE = Path(__file__).parent
ROOT = HERE.parents[1]

SCENARIO = TINY

SHORT = SCENARIO.replace("shear_time: 0.5", "shear_time: 0.2").replace(
    "snapshots: [0.25]", "snapshots: [0.1], samples_per_decade: 2"
)
"""The same with fewer steps."""

LONG = SCENARIO.replace("shear_time: 0.5", "shear_time: 10")
"""The same with a shear of some seconds, so that it can be met at work."""

STAGES = ("packing", "expansion", "ageing", "shear")
KEPT = ("ageing", "shear")
"""Stages with checkpoints."""

FIGURE = "figure"

STOPPED = 75
"""Exit status of a run that a signal stopped and the same command resumes."""


@dataclass(frozen=True)
class Outcome:
    """How a child ended.

    Attributes
    ----------
    status
        Its exit status, or minus the signal that killed it.
    seconds
        How long it lived.
    said
        What it printed.
    late
        Whether it had to be killed because it would not end.
    process
        Its number.
    """

    status: int
    seconds: float
    said: str
    late: bool
    process: int

    @property
    def killed(self) -> bool:
        """Whether a SIGKILL, or the limit of a file's size, ended it."""
        return self.status in (-signal.SIGKILL, -signal.SIGXFSZ)

    def refusal(self, kind: str) -> str:
        """Return its one line about an error of some kinds; anything else fails the test."""
        lines = self.said.splitlines()
        found = [line for line in lines if re.match(rf"({kind}): ", line)]
        assert self.status in (1, 2), f"status {self.status}: {self.said}"
        assert "Traceback" not in self.said, self.said
        assert len(found) == 1, self.said
        return found[0]


class Warm:
    """A warm process that forks a child for each job; see `warm`."""

    def __init__(self, commands: list[list[str]], **environment: str) -> None:
        python_path = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
        settings = {"PYTHONPATH": python_path, "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "agg"}
        self._process = subprocess.Popen(
            [sys.executable, str(HERE / "warm.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | settings | environment,
            start_new_session=True,
        )
        assert self._ask(commands) == "ready"

    def _ask(self, words: Any) -> Any:
        print(json.dumps(words), file=self._process.stdin, flush=True)
        return json.loads(self._process.stdout.readline())

    def run(
        self,
        folder: Path,
        *words: object,
        after: float | None = None,
        number: int = signal.SIGKILL,
        limit: float = 120.0,
        sabotage: Mapping[str, Any] | None = None,
        call: str | None = None,
        **options: object,
    ) -> Outcome:
        """Run a command of the product, or a function of `sabotage`, in a child.

        Parameters
        ----------
        folder
            Where it works.
        words
            Of the command.
        after, number
            Seconds after which it is sent a signal, and which.
        limit
            Seconds after which it is taken to hang.
        sabotage
            What is done to it, with the options.
        call, options
            The function and its arguments, where it is no command.
        """
        job: dict[str, Any] = {
            "folder": str(folder),
            "words": [str(word) for word in words],
            "after": after,
            "signal": int(number),
            "limit": limit,
            "sabotage": dict(sabotage or {}),
        }
        if call is not None:
            job |= {"call": call, "options": options}
        return Outcome(**self._ask(job))

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait(timeout=60)
        self._process.stdout.close()


@dataclass
class Chain:
    """The run, and what an undisturbed process makes of it.

    Attributes
    ----------
    scenario
        Its file.
    folder
        Where the undisturbed results are.
    ids
        Identity of the run by stage.
    digests
        Content digest by stage.
    seconds
        How long a stage, or the figure, takes a warm child.
    warm
        Where children come from.
    """

    scenario: Path
    folder: Path
    ids: Mapping[str, str]
    warm: Warm
    digests: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    def output(self, folder: Path, stage: str) -> Path:
        """Return where a stage, or the figure, writes its result."""
        if stage == FIGURE:
            return folder / "figures" / "snapshots" / f"{self.ids['shear']}.png"
        return folder / stage / f"{self.ids[stage]}.nc"

    def words(self, folder: Path, stage: str, parents: Path | None = None) -> list[str]:
        """Return the command of a stage, or of the figure; parents are the undisturbed ones."""
        output, parents = self.output(folder, stage), parents or self.folder
        if stage == FIGURE:
            data = self.output(parents, "shear")
            return ["draw", "snapshot", str(data), "--output", str(output)]
        words = [stage, str(self.scenario), self.ids[stage], "--output", str(output)]
        if stage != "packing":
            before = STAGES[STAGES.index(stage) - 1]
            words += ["--parent", str(self.output(parents, before))]
        return words

    def run(self, folder: Path, stage: str, *words: object, **how: Any) -> Outcome:
        """Run a stage, or draw the figure, in a warm child."""
        folder.mkdir(parents=True, exist_ok=True)
        return self.warm.run(folder, *self.words(folder, stage), *words, **how)

    def finish(self, folder: Path, stage: str, *words: object) -> Outcome:
        """Run a stage undisturbed, whatever is there, and compare its result."""
        outcome = self.run(folder, stage, *words)
        assert outcome.status == 0, outcome.said
        self.check_result(folder, stage)
        assert len(list(folder.rglob(f"*{SUFFIX}"))) <= 1, "both checkpoints outlive the run"
        return outcome

    def check_result(self, folder: Path, stage: str) -> None:
        """Make sure that a result is the one that an undisturbed process makes."""
        path = self.output(folder, stage)
        if stage == FIGURE:
            assert content_of(path) == content_of(self.output(self.folder, FIGURE))
            return
        options = {"path": str(path), "stage": stage, "digest": self.digests[stage]}
        outcome = self.warm.run(folder, call="check_dataset", **options)
        assert outcome.status == 0, outcome.said

    def check_folder(self, folder: Path, stage: str, deaths: int) -> None:
        """Make sure that whatever has a final name is whole, and how much else there is."""
        if self.output(folder, stage).exists():
            self.check_result(folder, stage)
        for path in folder.rglob(f"*{SUFFIX}"):
            outcome = self.warm.run(folder, call="check_checkpoint", path=str(path))
            assert outcome.status == 0, f"{path}: {outcome.said}"
        for path in folder.rglob("*.json"):
            assert json.loads(path.read_text()), path
        parts = list(folder.rglob("*.part"))
        # One file is written at a time: a death leaves at most that one.
        assert len(parts) <= deaths, f"{deaths} deaths left {parts}"
        known = (SUFFIX, ".json", ".part", ".lock", ".nc", ".png")
        assert all(path.suffix in known for path in files(folder)), list(files(folder))

    def begin(self) -> None:
        """Make the undisturbed results, and see how long each stage takes."""
        for stage in (*STAGES, FIGURE):
            outcome = self.run(self.folder, stage)
            assert outcome.status == 0, outcome.said
            self.seconds[stage] = outcome.seconds
            if stage in STAGES:
                with xr.open_dataset(self.output(self.folder, stage)) as dataset:
                    self.digests[stage] = dataset.attrs[CONTENT_DIGEST]


def files(folder: Path) -> Iterator[Path]:
    """Yield every file below a folder."""
    return (path for path in folder.rglob("*") if path.is_file())


def content_of(figure: Path) -> str:
    """Return the content digest of a figure, whose file is as it was drawn."""
    return str(check_figure(figure)[CONTENT_DIGEST])


def contents(folder: Path) -> dict[Path, bytes]:
    """Return every file below a folder that has a final name, but for words about who works."""
    return {
        path.relative_to(folder): path.read_bytes()
        for path in files(folder)
        if path.suffix in (".nc", ".png", SUFFIX)
    }


def small_chain(folder: Path, scenario: str = SCENARIO, warm: Warm | None = None) -> Chain:
    """Return the chain with its undisturbed results, ready to be disturbed."""
    path = folder / "small.yaml"
    path.write_text(scenario)
    (run,) = load_scenario(str(path)).runs()
    chain = Chain(path, folder / "whole", run.ids, warm or warmed(path, run.ids, folder / "trial"))
    chain.begin()
    return chain


def warmed(scenario: Path, ids: Mapping[str, str], folder: Path) -> Warm:
    """Return a warm process that has gone through every stage but the packing.

    A packing leaves the library of MPI started, which children must not inherit.
    """
    trial = Chain(scenario, folder, ids, warm=None)
    packing = [sys.executable, "-m", "softslip", *trial.words(folder, "packing")]
    subprocess.run(packing, check=True, capture_output=True)
    stages = (*STAGES[1:], FIGURE)
    warm = Warm([trial.words(folder, stage, folder) for stage in stages])
    shutil.rmtree(folder)
    return warm
