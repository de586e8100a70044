"""The paper's numbers beside those of a scenario, as a dataset and as a table."""

import shutil
from pathlib import Path

import pytest
import small_results

from softslip.analysis.against_paper import COMPARED
from softslip.files.storage import read_dataset
from softslip.provenance.product_labels import read_product

RESULTS = small_results.made() / "results"


def test_a_folder_of_results_is_enough(tmp_path: Path) -> None:
    output = tmp_path / "comparison.nc"
    assert small_results.call(["compare", RESULTS, "--output", output]) == ""
    assert read_product(output).content == read_product(RESULTS / "comparison.nc").content
    assert [each.stage for each in read_product(output).parents] == ["flow_curve", "fits"]
    read = read_dataset(output, stage="comparison")
    assert all(str(read[f"{name}_remark"].item()) for name in COMPARED), (
        "two tiny runs tell nothing"
    )


def test_fits_to_another_flow_curve_are_refused(tmp_path: Path) -> None:
    """That is one of fewer runs."""
    (tmp_path / "shear").mkdir()
    shutil.copy(next((RESULTS / "shear").glob("*.nc")), tmp_path / "shear")
    other, source = tmp_path / "flow_curve.nc", small_results.made() / "small.yaml"
    words = ["gather", "flow_curve", source, "--results", tmp_path, "--output", other]
    assert small_results.call(words) == ""
    output = tmp_path / "comparison.nc"
    said = small_results.call(["compare", other, RESULTS / "fits.nc", "--output", output])
    assert said == "exit status 2"
    assert not output.exists()


@pytest.mark.parametrize("count", [1, 3])
def test_files_that_are_no_pair_are_refused(tmp_path: Path, count: int) -> None:
    output = tmp_path / "comparison.nc"
    files = [RESULTS / "flow_curve.nc"] * count
    assert small_results.call(["compare", *files, "--output", output]) != ""
    assert not output.exists()
