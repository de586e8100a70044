"""One death at each place where a file is begun, written, made to last, named or removed."""

import json
from pathlib import Path

import numpy as np
import pytest
from chain import FIGURE, KEPT, STAGES, Chain
from sabotage import WRITERS

pytestmark = pytest.mark.reliability


def deaths(chain: Chain, folder: Path, stage: str, words: tuple[object, ...]) -> list[dict]:
    """Return every death that there is: before, within and after each call of a whole run."""
    log = folder / "calls"
    recorded = {"at_boundaries": {"log": str(log)}}
    outcome = chain.run(folder / "counted", stage, *words, sabotage=recorded)
    assert outcome.status == 0, outcome.said
    found = []
    for number, line in enumerate(log.read_text().splitlines()):
        name, size = json.loads(line)
        moments = ["before", "after"]
        if name in WRITERS:
            moments.insert(1, f"within {size // 2}")
        found += [{"number": number, "when": when} for when in moments]
    return found


@pytest.mark.parametrize(
    ("stage", "most"),
    [pytest.param(stage, None, marks=pytest.mark.slow) for stage in (*STAGES, FIGURE)]
    + [("shear", 8)],
)
def test_killed_at_each_boundary(
    short_chain: Chain, tmp_path: Path, tally, stage: str, most: int | None
) -> None:
    """With a checkpoint at each step; most boundaries at random where they are not all tried."""
    chain, counts = short_chain, tally(f"boundaries of {stage}")
    words = ("--checkpoint-interval", 0) if stage in KEPT else ()
    tried = deaths(chain, tmp_path, stage, words)
    if most is not None:
        random = np.random.default_rng(np.random.SeedSequence([3, STAGES.index(stage)]))
        tried = [tried[place] for place in sorted(random.permutation(len(tried))[:most])]
    for number, death in enumerate(tried):
        folder = tmp_path / f"{number}"
        outcome = chain.run(folder, stage, *words, sabotage={"at_boundaries": death})
        assert outcome.killed, f"{death}: {outcome.status}, {outcome.said}"
        counts["killed"] += 1
        chain.check_folder(folder, stage, deaths=1)
        again = chain.finish(folder, stage, *words)
        counts["resumed"] += "resuming from" in again.said
        assert len(list(folder.rglob("*.part"))) <= 1
    if stage in KEPT:
        assert counts["resumed"] > 0, "no death left a checkpoint"
