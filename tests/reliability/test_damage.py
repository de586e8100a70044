"""Bits that flip and files that end too early: found, or proved to be harmless."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from chain import FIGURE, KEPT, STAGES, Chain
from sabotage import REFUSED, SOUND

from softslip.simulation.checkpoint import SUFFIX

pytestmark = pytest.mark.reliability

LIMIT = 20.0
"""Seconds after which a reader is taken to hang; a sound file takes it a hundredth of that."""

NEXT = {"packing": "expansion", "expansion": "ageing", "ageing": "shear", "shear": FIGURE}
"""Which command reads the dataset of a stage."""

DATASETS = [pytest.param(12, id="few"), pytest.param(130, id="many", marks=pytest.mark.slow)]
CHECKPOINTS = [pytest.param(25, id="few"), pytest.param(250, id="many", marks=pytest.mark.slow)]


def damaged(content: bytes, random: np.random.Generator) -> bytes:
    """Return a content with a bit flipped or, as often, without its end."""
    place = int(random.integers(len(content)))
    if random.random() < 0.5:
        return content[:place]
    changed = bytearray(content)
    changed[place] ^= 1 << int(random.integers(8))
    return bytes(changed)


def generator(*key: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(key))


@pytest.mark.parametrize("number", DATASETS)
@pytest.mark.parametrize("stage", STAGES)
def test_no_damage_to_a_dataset_is_believed(
    chain: Chain, tmp_path: Path, tally, stage: str, number: int
) -> None:
    counts, random = tally(f"damaged {stage} datasets"), generator(5, STAGES.index(stage))
    pristine = chain.output(chain.folder, stage)
    content = pristine.read_bytes()
    parents = Chain(**vars(chain) | {"folder": tmp_path / "parents"})
    path = parents.output(parents.folder, stage)
    path.parent.mkdir(parents=True)
    options = {"path": str(path), "pristine": str(pristine), "stage": stage}
    for _ in range(number):
        path.write_bytes(damaged(content, random))
        outcome = chain.warm.run(tmp_path, call="read_damaged_dataset", limit=LIMIT, **options)
        counts["damaged"] += 1
        if outcome.status >= 0:
            assert outcome.status in (REFUSED, SOUND), outcome.said
            counts["refused" if outcome.status == REFUSED else "harmless"] += 1
            continue
        # The library that reads the file has died or hung: then the command that needs the file
        # must fail as well, and leave nothing.
        counts["crashed or hung"] += 1
        folder = tmp_path / "run"
        ended = parents.run(folder, NEXT[stage], limit=LIMIT)
        assert ended.status != 0, f"{outcome.said}\n{ended.said}"
        assert not parents.output(folder, NEXT[stage]).exists()
        shutil.rmtree(folder)
    assert counts["refused"] > counts["harmless"]


@pytest.mark.parametrize("number", CHECKPOINTS)
@pytest.mark.parametrize("stage", KEPT)
def test_no_damage_to_a_checkpoint_is_believed(
    chain: Chain, tmp_path: Path, tally, stage: str, number: int
) -> None:
    counts, random = tally(f"damaged {stage} checkpoints"), generator(6, STAGES.index(stage))
    slow = {"slow_down": {"seconds": 0.1}}
    after = chain.seconds[stage] + 0.3
    chain.run(tmp_path / "run", stage, after=after, number=15, sabotage=slow)
    (pristine,) = (tmp_path / "run").rglob(f"*{SUFFIX}")
    content, path = pristine.read_bytes(), tmp_path / f"damaged{SUFFIX}"
    options = {"path": str(path), "pristine": str(pristine)}
    for turn in range(number):
        path.write_bytes(damaged(content, random))
        outcome = chain.warm.run(tmp_path, call="read_damaged_checkpoint", limit=LIMIT, **options)
        counts["damaged"] += 1
        assert outcome.status == REFUSED, f"{outcome.status}: {outcome.said}"
        counts["refused"] += 1
        if turn % 10 == 0:
            folder = tmp_path / f"{turn}"
            shutil.copytree(tmp_path / "run", folder)
            damaged_path = folder / pristine.relative_to(tmp_path / "run")
            shutil.copyfile(path, damaged_path)
            assert "it is removed" in chain.finish(folder, stage).said
            counts["restarted"] += 1
