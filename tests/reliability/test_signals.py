"""Signals that ask a run to stop: it stops with a checkpoint, and the same command resumes it."""

import signal
from pathlib import Path

import numpy as np
import pytest
from chain import FIGURE, KEPT, STAGES, STOPPED, Chain, contents

from softslip.simulation.checkpoint import SUFFIX, read_header

pytestmark = pytest.mark.reliability

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@pytest.mark.parametrize(
    ("stage", "number"),
    [
        ("ageing", signal.SIGTERM),
        ("shear", signal.SIGINT),
        ("shear", signal.SIGHUP),
        pytest.param("shear", signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param("ageing", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("ageing", signal.SIGHUP, marks=pytest.mark.slow),
    ],
)
def test_a_signal_at_work_leaves_a_checkpoint(
    chain: Chain, tmp_path: Path, tally, stage: str, number: signal.Signals
) -> None:
    counts = tally("signals at work")
    slow = {"slow_down": {"seconds": 0.2}}
    # Two steps at the least have been waited for by then, and not all.
    after = chain.seconds[stage] + 0.4
    outcome = chain.run(tmp_path, stage, after=after, number=number, sabotage=slow)
    assert outcome.status == STOPPED, f"{outcome.status}: {outcome.said}"
    assert f"Interrupted: by {number.name} at t = " in outcome.said
    assert not chain.output(tmp_path, stage).exists()
    (checkpoint,) = tmp_path.rglob(f"*{SUFFIX}")
    assert read_header(checkpoint).step > 0
    again = chain.finish(tmp_path, stage, "--resume")
    assert f"resuming from {checkpoint.name}" in again.said
    assert [path.suffix for path in tmp_path.rglob("*") if path.is_file()].count(".nc") == 1
    counts["stopped and resumed"] += 1


@pytest.mark.parametrize(
    ("stage", "times"),
    [("expansion", 2), ("shear", 2)]
    + [pytest.param(stage, 40, marks=pytest.mark.slow) for stage in (*STAGES, FIGURE)],
)
def test_a_signal_at_any_moment_spoils_nothing(
    chain: Chain, tmp_path: Path, tally, stage: str, times: int
) -> None:
    """Before the run begins to listen, at work, and while it writes its result."""
    counts = tally(f"signals in {stage}")
    random = np.random.default_rng(np.random.SeedSequence([4, (*STAGES, FIGURE).index(stage)]))
    words = ("--checkpoint-interval", 0.05) if stage in KEPT else ()
    for turn in range(times):
        folder, number = tmp_path / f"{turn}", SIGNALS[turn % len(SIGNALS)]
        moment = random.uniform(0, chain.seconds[stage])
        outcome = chain.run(folder, stage, *words, after=moment, number=number)
        assert not outcome.late, outcome.said
        # What a signal handler raises within compiled code comes out as that.
        assert "SystemError" not in outcome.said, outcome.said
        assert outcome.status != 0 or chain.output(folder, stage).exists()
        counts["stopped in order"] += outcome.status == STOPPED
        counts["stopped otherwise"] += outcome.status not in (0, STOPPED)
        chain.check_folder(folder, stage, deaths=1)
        chain.finish(folder, stage, *words)
        counts["finished"] += 1


def test_what_a_second_signal_cuts_short_is_not_believed(chain: Chain, tmp_path: Path) -> None:
    """The first asks for a checkpoint; the second does not wait for it, and harms none."""
    waiting = {"slow_down": {"seconds": 30.0}}
    before = chain.run(tmp_path, "shear", after=0.5 * chain.seconds["shear"], number=15)
    kept = contents(tmp_path)
    outcome = chain.run(
        tmp_path,
        "shear",
        after=1.0 + chain.seconds["shear"],
        number=signal.SIGTERM,
        sabotage=waiting | {"signal_again": {"seconds": 2.0 + chain.seconds["shear"]}},
    )
    assert outcome.status == STOPPED, outcome.said
    assert outcome.seconds < 25
    assert contents(tmp_path) == kept, before.said
    chain.finish(tmp_path, "shear")
