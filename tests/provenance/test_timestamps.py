"""What was recomputed with the same content is no newer than what was made from it."""

import json
import os

import numpy as np
import pytest
import xarray as xr

from softslip.files.storage import write_dataset
from softslip.provenance.attribution import Job
from softslip.provenance.timestamps import keep_in_order

OLD, NEW, LATER = 1_000_000_000.0, 1_700_000_000.0, 1_800_000_000.0


def written(folder, stage, parents=(), value=1.0, at=OLD):
    path = folder / stage / f"{'ab' * 8}.nc"
    dataset = xr.Dataset({"number": ("x", np.full(3, value), {"units": "1"})})
    labels = Job().labels(parents, fingerprint="f" * 16) | {"parameters": json.dumps({})}
    write_dataset(dataset.assign_attrs(labels), path, stage=stage, run="ab" * 8, title="x")
    os.utime(path, (at, at))
    return xr.load_dataset(path)


@pytest.fixture
def chain(tmp_path):
    """A packing, two stages after it and a table, each newer than what it was made from."""
    dataset, parents = None, []
    for place, stage in enumerate(("packing", "expansion", "ageing", "table")):
        dataset = written(tmp_path, stage, parents, at=OLD + place)
        parents = [dataset]
    return tmp_path


def times(folder):
    return {path.parent.name: path.stat().st_mtime for path in folder.rglob("*.nc")}


def test_what_comes_back_the_same_is_dated_back(chain):
    before = times(chain)
    parent = xr.load_dataset(chain / "packing" / f"{'ab' * 8}.nc")
    written(chain, "expansion", [parent], at=LATER)
    assert keep_in_order(chain, NEW) == [chain / "expansion" / f"{'ab' * 8}.nc"]
    after = times(chain)
    assert after["packing"] <= after["expansion"] <= after["ageing"]
    assert {**after, "expansion": 0} == {**before, "expansion": 0}
    assert keep_in_order(chain, NEW) == []


def test_what_comes_back_different_stays_new(chain):
    written(chain, "expansion", value=2.0, at=LATER)
    assert keep_in_order(chain, NEW) == []
    assert times(chain)["expansion"] == LATER


def test_what_nothing_was_made_from_stays_new(chain):
    written(chain, "table", at=LATER)
    assert keep_in_order(chain, NEW) == []
    assert times(chain)["table"] == LATER


def test_what_is_not_of_this_run_is_left_alone(chain):
    written(chain, "expansion", at=NEW - 1)
    assert keep_in_order(chain, NEW) == []
    assert keep_in_order(chain / "nowhere", NEW) == []


def test_a_whole_new_chain_is_left_alone(chain):
    """And so nothing but times is read."""
    (chain / "packing" / "broken.nc").write_text("none")
    assert keep_in_order(chain, OLD - 1) == []
