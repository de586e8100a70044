"""Whatever is done to any file of results, verifying names the file."""

import itertools
import json
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import small_results
from PIL import Image, PngImagePlugin
from small_results import attribute, edit, edited_json, redigest, results

from softslip.config.scenario import load_scenario
from softslip.files.storage import CONTENT_DIGEST
from softslip.provenance.verification import Verification, verify

__all__ = ["results"]

Files = list[Path]
Random = np.random.Generator


def generator(*key: int) -> Random:
    return np.random.default_rng(np.random.SeedSequence(key))


@pytest.fixture
def check(results: Path) -> Callable[[], Verification]:
    """Verify the results."""
    scenario = load_scenario(small_results.source(results))
    return lambda: verify(scenario, results)


def names(found: Verification) -> str:
    """Return all that verifying says, so that one can look for a file in it."""
    return "\n".join((*found.problems, *(f"{found.folder}/{name}" for name in found.missing)))


def test_a_sound_folder_has_no_problem(results: Path) -> None:
    found = verify(load_scenario(small_results.source(results)), results)
    assert found.problems == ()
    assert found.missing == ()
    assert len(found.verdicts) == small_results.count()
    assert not any(each.foreign or each.remarks for each in found.verdicts)
    assert {each.examined.state for each in found.verdicts} == {"right"}


# --- what can be done to the bytes of a file ---------------------------------------------------


def flip(path: Path, random: Random, others: Files) -> Files:
    content = bytearray(path.read_bytes())
    content[int(random.integers(len(content)))] ^= 1 << int(random.integers(8))
    path.write_bytes(content)
    return [path]


def truncate(path: Path, random: Random, others: Files) -> Files:
    content = path.read_bytes()
    # As often by a few bytes as by many.
    least = len(content) - 100 if random.random() < 0.5 else 0
    path.write_bytes(content[: int(random.integers(least, len(content)))])
    return [path]


def lengthen(path: Path, random: Random, others: Files) -> Files:
    path.write_bytes(path.read_bytes() + random.bytes(int(random.integers(1, 200))))
    return [path]


def delete(path: Path, random: Random, others: Files) -> Files:
    path.unlink()
    return [path]


def swap(path: Path, random: Random, others: Files) -> Files:
    other = others[int(random.integers(len(others)))]
    first, second = path.read_bytes(), other.read_bytes()
    path.write_bytes(second)
    other.write_bytes(first)
    return [path, other]


# --- what can be done to a dataset with its library --------------------------------------------


def edit_attribute(path: Path, random: Random, others: Files) -> Files:
    provenance = attribute(path, "provenance")
    parents = json.loads(attribute(path, "parents"))
    for each in parents[:1]:
        each[CONTENT_DIGEST] = "0" * 64
    changes: list[dict[str, Any]] = [
        {"parameters": edited_json(attribute(path, "parameters"), seed=2)},
        {"provenance": edited_json(provenance, commit="0" * 40)},
        {"provenance": edited_json(provenance, seed=2)},
        {"parents": json.dumps(parents) if parents else "[{}]"},
        {"title": "A better title"},
        {"run": "0" * 16},
        {"stage": "shear" if path.parent.name != "shear" else "ageing"},
    ]
    edit(path, changes[int(random.integers(len(changes)))])
    return [path]


def edit_units(path: Path, random: Random, others: Files) -> Files:
    with netCDF4.Dataset(path, "a") as dataset:
        measured = [each for each in dataset.variables.values() if "units" in each.ncattrs()]
        measured[int(random.integers(len(measured)))].units = "furlong"
    return [path]


def edit_value(path: Path, random: Random, others: Files) -> Files:
    """Change one number by a unit in its last place, or a word by a letter."""
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.set_auto_mask(False)
        filled = [each for each in dataset.variables.values() if each.size]
        variable = filled[int(random.integers(len(filled)))]
        values = np.atleast_1d(np.array(variable[...]))
        # Words in an array of their length would lose what is added.
        values = values if values.dtype.kind in "fiu" else values.astype(object)
        place = int(random.integers(values.size))
        old = values.flat[place]
        if values.dtype.kind == "f":
            values.flat[place] = 1.0 if np.isnan(old) else np.nextafter(old, np.inf)
        else:
            values.flat[place] = old + ("x" if values.dtype.kind == "O" else 1)
        variable[...] = values.reshape(variable.shape) if variable.shape else values[0]
    return [path]


def forged(change: Callable[[Path, Random, Files], Files]) -> Callable[..., Files]:
    """Make a change and whatever is in the file that would reveal it."""

    def forge(path: Path, random: Random, others: Files) -> Files:
        changed = change(path, random, others)
        for each in changed:
            redigest(each)
        return changed

    forge.__name__ = f"forged_{change.__name__}"
    return forge


# --- what can be done to a figure --------------------------------------------------------------


def relabel(path: Path, random: Random, others: Files) -> Files:
    """Rewrite a figure's labels, with right checksums of its parts."""
    with Image.open(path) as image:
        image.load()
        fields, pixels = dict(image.info), image.copy()
    labels = json.loads(fields["Description"])
    labels["provenance"]["commit"] = "0" * 40
    told = PngImagePlugin.PngInfo()
    told.add_text("Description", json.dumps(labels, sort_keys=True))
    pixels.save(path, pnginfo=told)
    return [path]


def forge_labels(path: Path, random: Random, others: Files) -> Files:
    """Replace labels of a figure and make both digests right."""
    labels = small_results.stamps.read_labels(path)
    parents = [each | {CONTENT_DIGEST: "0" * 64} for each in labels["parents"]]
    late = labels["provenance"] | {"ended": "2020-01-01T00:00:00.000000Z"}
    changes: list[dict[str, Any]] = [
        {"parents": parents},
        {"parameters": {"seed": 7}},
        {"run": "f" * 16},
        {"title": "trajectory"},
        {"provenance": late},
        {"provenance": {}},
    ]
    small_results.forge_labels(path, **changes[int(random.integers(len(changes)))])
    return [path]


DATASETS, FIGURES = ".nc", ".png"
KINDS: list[tuple[Callable[..., Files], tuple[str, ...], int]] = [
    (flip, (DATASETS, FIGURES), 50),
    (truncate, (DATASETS, FIGURES), 15),
    (lengthen, (DATASETS, FIGURES), 6),
    (delete, (DATASETS, FIGURES), 14),
    (swap, (DATASETS, FIGURES), 12),
    (edit_attribute, (DATASETS,), 18),
    (edit_units, (DATASETS,), 9),
    (edit_value, (DATASETS,), 18),
    (forged(edit_attribute), (DATASETS,), 18),
    (forged(edit_units), (DATASETS,), 9),
    (forged(edit_value), (DATASETS,), 18),
    (relabel, (FIGURES,), 5),
    (forge_labels, (FIGURES,), 12),
]
"""What is done, to which files, and how often."""

LAST = "comparison.nc"
"""Dataset that nothing is made from: what it says of its own making nobody else can tell."""


def tampered(
    folder: Path, kind: Callable[..., Files], suffixes: tuple[str, ...], count: int, random: Random
) -> Iterator[Files]:
    """Tamper with each file in turn, yield which were changed, and undo it."""
    files = sorted(path for path in folder.rglob("*") if path.suffix in suffixes)
    if kind.__name__.startswith("forged"):
        files = [path for path in files if path.name != LAST]
    for path in itertools.islice(itertools.cycle(files), count):
        before = {each: each.read_bytes() for each in files}
        yield kind(path, random, [each for each in files if each != path])
        for each, content in before.items():
            if not each.exists() or each.read_bytes() != content:
                each.write_bytes(content)


def test_no_tampering_is_missed(results: Path, check: Callable[[], Verification]) -> None:
    assert check().problems == ()
    done: Counter[str] = Counter()
    missed: list[str] = []
    for number, (kind, suffixes, count) in enumerate(KINDS):
        for changed in tampered(results, kind, suffixes, count, generator(9, number)):
            done[kind.__name__] += 1
            said = names(check())
            missed += [f"{kind.__name__} {each}" for each in changed if each.name not in said]
    assert not missed, "\n".join(missed)
    assert sum(done.values()) >= 200, done
    assert check().problems == (), "what was undone is named still"


@pytest.mark.parametrize("kind", [delete, flip])
def test_what_a_child_was_made_from_is_named_in_the_child(
    results: Path, check: Callable[[], Verification], kind: Callable[..., Files]
) -> None:
    (packing,) = results.glob("packing/*.nc")
    kind(packing, generator(1), [])
    (expansion,) = (each for each in check().verdicts if each.name.startswith("expansion"))
    said = "\n".join((*expansion.problems, *expansion.remarks))
    assert packing.name in said


def test_a_result_that_a_rerun_made_again_is_no_problem(
    results: Path, check: Callable[[], Verification]
) -> None:
    (packing,) = results.glob("packing/*.nc")
    later = {"started": "2100-01-01T00:00:00.000000Z", "ended": "2100-01-01T00:00:01.000000Z"}
    edit(packing, {"provenance": edited_json(attribute(packing, "provenance"), **later)})
    redigest(packing)
    found = check()
    assert found.problems == ()
    remarks = [remark for each in found.verdicts for remark in each.remarks]
    assert [
        str(packing) in remark and "has been recomputed since" in remark for remark in remarks
    ] == [True]


def test_a_copy_that_a_forger_renames_is_named(
    results: Path, check: Callable[[], Verification]
) -> None:
    first, second = sorted(results.glob("shear/*.nc"))
    shutil.copyfile(first, second)
    assert any(str(second) in problem and "name" in problem for problem in check().problems)
