"""Results of runs that were never run: datasets in name only, and true checkpoints."""

import time
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from softslip.config.scenario import Scenario, load_scenario
from softslip.provenance.fingerprints import fingerprint
from softslip.simulation.checkpoint import Identity
from softslip.simulation.checkpoint_generations import Checkpoints
from softslip.solver.state import State

SCENARIO = """
description: Four runs of two packings.
axes:
  seed: [1, 2]
  rheometer.stress: [0.1, 0.5]
"""

CHECKPOINT_BYTES = 8000
"""Of the array in each checkpoint."""

Points = Sequence[tuple[float, float, int]]
"""Wall-clock seconds, simulated time and step of checkpoints."""


def scenario(folder: Path) -> Scenario:
    """Write a scenario and load it."""
    path = folder / "four.yaml"
    path.write_text(SCENARIO)
    return load_scenario(str(path))


class Work:
    """Leaves in a folder what runs leave there."""

    def __init__(self, results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.results = results
        self._monkeypatch = monkeypatch

    def folder(self, stage: str) -> Path:
        """Return the folder of a stage's checkpoints and locks."""
        return self.results / stage / "checkpoints"

    def finish(self, stage: str, run: str) -> Path:
        """Leave a dataset, which is never looked into."""
        path = self.results / stage / f"{run}.nc"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        return path

    def stop(
        self,
        stage: str,
        run: str,
        points: Points = ((40.0, 2.0, 100),),
        *,
        code: str | None = None,
        written: float | None = None,
    ) -> tuple[Path, Path]:
        """Leave checkpoints of a run that ends at time 10; return the newest, previous."""
        by = code or fingerprint(stage)
        identity = Identity(stage, run, "0" * 64, by, "python", "{}")
        clock = SimpleNamespace(monotonic=lambda: 0.0, time=lambda: 0.0, process_time=lambda: 0.0)
        with self._monkeypatch.context() as patch:
            patch.setattr("softslip.simulation.checkpoint_generations.time", clock)
            checkpoints = Checkpoints(self.folder(stage), identity, lambda sentence: None)
            checkpoints.load()
            for place, (seconds, simulated, step) in enumerate(points):
                last = time.time() if written is None else written
                moment = last - (len(points) - 1 - place)
                clock.monotonic = lambda seconds=seconds: seconds
                clock.time = lambda moment=moment: moment
                state = State(np.zeros(4), 0, 0, time=simulated, step=step)
                checkpoints.save({"numbers": np.zeros(CHECKPOINT_BYTES // 8)}, state, 10.0)
        return checkpoints.newest, checkpoints.previous
