"""SIGKILL at random moments: nothing is lost, and what comes out has the same bytes."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from chain import FIGURE, KEPT, STAGES, Chain

pytestmark = pytest.mark.reliability

INTERVAL = 0.03
"""Seconds between two checkpoints: several to a stage."""

SIZES = [
    pytest.param({"packing": 1, "expansion": 2, "ageing": 3, "shear": 3, FIGURE: 1}, id="ten"),
    pytest.param(
        {"packing": 30, "expansion": 45, "ageing": 60, "shear": 65, FIGURE: 30},
        id="hundreds",
        marks=pytest.mark.slow,
    ),
]


class Steps:
    """What the children of one stage have told of their steps."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.repeated = 0
        self.latest: list[tuple[float, int]] = []

    def look(self, said: str) -> None:
        """Compare where a child began with where the one before died."""
        lines = self.path.read_text().splitlines() if self.path.exists() else []
        steps = [(float(moment), int(step)) for moment, step in map(str.split, lines)]
        self.path.unlink(missing_ok=True)
        if steps and self.latest:
            self.check(steps[0][1], "resuming from" in said)
        # A child that died before its first step has lost nothing that was there before.
        self.latest = steps or self.latest

    def check(self, first: int, resumed: bool) -> None:
        """Allow one interval, and the step in which it ended, to be repeated."""
        moments, steps = zip(*self.latest, strict=True)
        lost = steps[-1] - (first - 1 if resumed else -1)
        start = moments[steps.index(first - 1)] if first - 1 in steps else moments[0]
        longest = max(np.diff(moments, prepend=moments[0]))
        assert moments[-1] - start <= INTERVAL + 2 * longest + 0.02, (
            f"{lost} steps, {moments[-1] - start:.3f} s, of work were lost"
        )
        self.repeated += max(lost, 0)


@pytest.mark.parametrize("kills", SIZES)
@pytest.mark.parametrize("stage", [*STAGES, FIGURE])
def test_killed_at_random(chain: Chain, tmp_path: Path, tally, stage: str, kills) -> None:
    counts = tally(f"kills in {stage}")
    random = np.random.default_rng(np.random.SeedSequence([2, (*STAGES, FIGURE).index(stage)]))
    interval = ("--checkpoint-interval", INTERVAL) if stage in KEPT else ()
    steps = Steps(tmp_path / "steps")
    sabotage = {"tell_steps": {"path": str(steps.path)}}
    folder, since, reach = tmp_path / "run", 0, 1.5 * chain.seconds[stage]
    while counts["killed"] < kills[stage]:
        moment = random.uniform(0, reach)
        outcome = chain.run(folder, stage, *interval, after=moment, sabotage=sabotage)
        # On a busy machine all takes longer: four deaths to one end, in the long run.
        reach *= 1.1 if outcome.killed else 0.7
        steps.look(outcome.said)
        counts["resumed"] += "resuming from" in outcome.said
        if outcome.killed:
            counts["killed"] += 1
            since += 1
            chain.check_folder(folder, stage, since)
            continue
        assert outcome.status == 0, outcome.said
        chain.check_result(folder, stage)
        shutil.rmtree(folder)
        counts["finished"] += 1
        since, steps.latest = 0, []
    steps.path.unlink(missing_ok=True)
    chain.finish(folder, stage, *interval)
    counts["finished"] += 1
    counts["steps repeated"] += steps.repeated
    if kills[stage] > 20:
        assert counts["finished"] > 2, "all died before they had done anything"
        assert counts["resumed"] >= (kills[stage] // 6 if stage in KEPT else 0)
