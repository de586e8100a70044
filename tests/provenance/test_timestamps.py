"""What has the content that others were made from is no newer than these, and only that."""

import json
import os
import random
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from softslip.files.storage import write_dataset
from softslip.provenance.attribution import Job
from softslip.provenance.timestamps import put_in_order

RUN = "ab" * 8
OLD, LATER = 1_000_000_000.0, 1_800_000_000.0
CHAIN = ("packing", "expansion", "ageing", "shear", "flow_curve", "fits")


def place(folder: Path, stage: str) -> Path:
    return folder / stage / f"{RUN}.nc" if stage in CHAIN[:4] else folder / f"{stage}.nc"


def written(folder, stage, parents=(), value=1.0, at=OLD):
    path = place(folder, stage)
    dataset = xr.Dataset({"number": ("x", np.full(3, value), {"units": "1"})})
    labels = Job().labels(parents, fingerprint="f" * 16) | {"parameters": json.dumps({})}
    write_dataset(dataset.assign_attrs(labels), path, stage=stage, run=RUN, title="x")
    os.utime(path, (at, at))
    return xr.load_dataset(path)


@pytest.fixture
def chain(tmp_path):
    """Every kind of dataset in a row, each newer than what it was made from."""
    parents = []
    for number, stage in enumerate(CHAIN):
        parents = [written(tmp_path, stage, parents, at=OLD + number)]
    return tmp_path


def times(folder):
    return {stage: place(folder, stage).stat().st_mtime for stage in CHAIN}


def test_times_that_are_in_order_are_left_alone(chain):
    before = times(chain)
    assert put_in_order(chain) == []
    assert times(chain) == before


@pytest.mark.parametrize("seed", range(10))
def test_times_in_any_order_are_put_in_order(chain, seed):
    shuffled = random.Random(seed).sample(range(len(CHAIN)), len(CHAIN))
    for stage, number in zip(CHAIN, shuffled, strict=True):
        os.utime(place(chain, stage), (OLD + number,) * 2)
    before = times(chain)
    moved = put_in_order(chain)
    after = list(times(chain).values())
    assert after == sorted(after)
    assert {path for path in moved} == {
        place(chain, stage) for stage in CHAIN if times(chain)[stage] != before[stage]
    }
    assert put_in_order(chain) == []


def test_what_a_job_took_is_no_older_than_its_result(chain):
    """Snakemake takes the older of the two for the age of the result."""
    note = chain / "benchmarks" / "shear" / f"{RUN}.tsv"
    note.parent.mkdir(parents=True)
    note.touch()
    os.utime(note, (0, 0))
    assert put_in_order(chain) == [note]
    assert note.stat().st_mtime == place(chain, "shear").stat().st_mtime


def test_equal_times_are_in_order(chain):
    for stage in CHAIN:
        os.utime(place(chain, stage), (OLD, OLD))
    assert put_in_order(chain) == []


@pytest.mark.parametrize("at", [OLD - 10, OLD + 1, OLD + 2, LATER])
def test_what_was_made_from_other_content_is_older_than_what_replaced_that(chain, at):
    written(chain, "expansion", value=2.0, at=at)
    put_in_order(chain)
    after = times(chain)
    assert after["expansion"] > after["ageing"]
    assert after["ageing"] <= after["shear"] <= after["flow_curve"] <= after["fits"]
    assert put_in_order(chain) == []


def test_what_came_back_with_the_same_content_replaces_nothing(chain):
    parent = xr.load_dataset(place(chain, "packing"))
    written(chain, "expansion", [parent], at=LATER)
    put_in_order(chain)
    after = list(times(chain).values())
    assert after == sorted(after)


def test_what_does_not_say_what_it_was_made_from_keeps_its_time(chain):
    place(chain, "ageing").write_text("none")
    os.utime(place(chain, "ageing"), (0, 0))
    put_in_order(chain)
    assert times(chain)["ageing"] == 0
    assert put_in_order(chain / "nowhere") == []


def test_results_of_another_user_are_given_the_present_time(chain, monkeypatch):
    """Who may write to a file may do that, but only its owner may choose a time."""
    os.utime(place(chain, "shear"), (0, 0))
    real = os.utime

    def refused(path, *args, **times):
        if args or times:
            raise PermissionError(1, "Operation not permitted")
        real(path)

    monkeypatch.setattr("softslip.provenance.timestamps.os.utime", refused)
    assert place(chain, "shear") in put_in_order(chain)
    after = list(times(chain).values())
    assert after == sorted(after)


def test_what_may_not_be_changed_at_all_is_left_alone(chain, monkeypatch):
    def refused(path, *args, **times):
        raise PermissionError(1, "Operation not permitted")

    os.utime(place(chain, "shear"), (0, 0))
    monkeypatch.setattr("softslip.provenance.timestamps.os.utime", refused)
    assert put_in_order(chain) == []


def test_what_claims_to_be_made_from_itself_is_left_alone(tmp_path):
    one = written(tmp_path, "packing")
    two = written(tmp_path, "expansion", [one], at=OLD - 5)
    written(tmp_path, "packing", [two])
    assert put_in_order(tmp_path) == []
