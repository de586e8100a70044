"""Results as a graph, on a chain of made-up datasets and a figure of them."""

import dataclasses
import json
import shutil

import netCDF4
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from softslip.analysis.figures import save_figure
from softslip.errors import DatasetError
from softslip.files.layout import FIGURE
from softslip.files.storage import CONTENT_DIGEST, RECORD_DIGEST, write_dataset
from softslip.provenance.archive import Archive
from softslip.provenance.attribution import Job, parents_of
from softslip.provenance.product_labels import Parent, read_product

RUN = "ab" * 8


def written(folder, stage, parents=(), run=RUN, value=1.0):
    path = folder / stage / f"{run}.nc"
    dataset = xr.Dataset({"number": ("x", np.full(3, value), {"units": "1"})})
    labels = Job().labels(parents, fingerprint="f" * 16, seed=1)
    parameters = json.dumps({"seed": 1})
    write_dataset(
        dataset.assign_attrs(parameters=parameters, **labels), path, stage=stage, run=run, title="x"
    )
    return xr.load_dataset(path)


@pytest.fixture
def chain(tmp_path):
    packing = written(tmp_path, "packing")
    expansion = written(tmp_path, "expansion", [packing])
    labels = {"title": "snapshot", "stage": FIGURE, "run": RUN, "parents": parents_of([expansion])}
    figure = Figure(figsize=(1, 1))
    provenance = Job().provenance([expansion], fingerprint="e" * 16)
    save_figure(figure, tmp_path / "figures" / f"{RUN}.png", labels, provenance)
    return tmp_path


def test_a_dataset_says_what_it_is(chain):
    product = read_product(chain / "expansion" / f"{RUN}.nc")
    parent = read_product(chain / "packing" / f"{RUN}.nc")
    assert (product.stage, product.run, product.is_figure) == ("expansion", RUN, False)
    assert product.label == f"expansion {RUN}"
    assert product.parameters == {"seed": 1}
    assert product.provenance["fingerprint"] == "f" * 16
    assert product.parents == (Parent("packing", RUN, parent.content, parent.record),)
    assert parent.parents == ()


def test_a_figure_says_what_it_is(chain):
    product = read_product(chain / "figures" / f"{RUN}.png")
    (parent,) = product.parents
    assert (product.stage, product.run, product.is_figure) == (FIGURE, RUN, True)
    assert product.label == f"snapshot {RUN}"
    assert product.provenance["fingerprint"] == "e" * 16
    assert Archive(chain).locate(parent).product.label == f"expansion {RUN}"


def test_an_archive_lists_results_and_nothing_else(chain):
    (chain / "notes.txt").write_text("none")
    (chain / "packing" / ".hidden.nc").write_text("none")
    (chain / "packing" / "broken.nc").write_text("none")
    archive = Archive(chain)
    assert [path.name for path in archive.files] == [
        f"{RUN}.nc",
        f"{RUN}.png",
        f"{RUN}.nc",
        "broken.nc",
    ]
    found = list(archive.products())
    assert [isinstance(each, DatasetError) for each in found] == [False, False, False, True]
    assert "broken.nc" in str(found[-1])


def test_a_parent_is_found_wherever_it_lies(chain):
    (parent,) = read_product(chain / "expansion" / f"{RUN}.nc").parents
    usual = Archive(chain).place(parent)
    assert usual == chain / "packing" / f"{RUN}.nc"
    assert Archive(chain).locate(parent).product.path == usual
    elsewhere = chain / "elsewhere.nc"
    shutil.move(usual, elsewhere)
    assert Archive(chain).locate(parent).product.path == elsewhere
    elsewhere.unlink()
    assert Archive(chain).locate(parent).product is None


def test_a_parent_with_another_content_is_not_taken(chain):
    (parent,) = read_product(chain / "expansion" / f"{RUN}.nc").parents
    written(chain, "packing", value=2.0)
    assert Archive(chain).locate(parent).product is None
    written(chain, "packing", value=1.0)
    again = Archive(chain).locate(parent).product
    assert again.content == parent.content
    assert again.record != parent.record, "made at another time"


def test_tables_lie_at_the_top(tmp_path):
    parent = Parent("flow_curve", "demo", "c" * 64, "")
    assert Archive(tmp_path).place(parent) == tmp_path / "flow_curve.nc"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("missing.nc", "does not exist"),
        ("notes.txt", "is no result; give a file that ends in .nc"),
        ("broken.nc", "cannot be read"),
        ("folder.nc", "does not exist or is not a file"),
        ("broken.png", "is no figure of softslip, or is damaged"),
    ],
)
def test_what_is_no_result_is_refused(tmp_path, name, said):
    (tmp_path / "notes.txt").write_text("none")
    (tmp_path / "broken.nc").write_text("none")
    (tmp_path / "broken.png").write_text("none")
    (tmp_path / "folder.nc").mkdir()
    with pytest.raises(DatasetError, match=said):
        read_product(tmp_path / name)


@pytest.mark.parametrize("key", ["stage", "run", CONTENT_DIGEST, RECORD_DIGEST])
def test_a_dataset_without_a_label_is_refused(chain, key):
    path = chain / "packing" / f"{RUN}.nc"
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.delncattr(key)
    with pytest.raises(DatasetError, match=f"has no {key}"):
        read_product(path)


@pytest.mark.parametrize(
    ("key", "value"), [("parents", "[{}]"), ("parents", "["), ("provenance", "3"), ("parents", "3")]
)
def test_labels_that_are_nonsense_are_refused(chain, key, value):
    path = chain / "expansion" / f"{RUN}.nc"
    with netCDF4.Dataset(path, "a") as dataset:
        dataset.setncattr(key, value)
    with pytest.raises(DatasetError, match="labels that cannot be read"):
        read_product(path)


def test_records_that_do_not_pair_with_parents_are_unknown(chain):
    path = chain / "expansion" / f"{RUN}.nc"
    with netCDF4.Dataset(path, "a") as dataset:
        told = json.loads(dataset.provenance) | {"parent_records": []}
        dataset.provenance = json.dumps(told)
    (parent,) = read_product(path).parents
    assert parent == dataclasses.replace(parent, record="")
