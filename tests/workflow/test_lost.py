"""A result that is lost comes back the same, and nothing that was made from it is made again."""

import shutil
from pathlib import Path

import pytest
from tiny import snakemake

from softslip.config.stages import STAGES
from softslip.files.layout import DATASET
from softslip.provenance.product_labels import read_product

pytestmark = pytest.mark.workflow

TABLES = ("flow_curve", "creep", "profiles", "structure", "fits")
FIGURES = ("fig3", "fig4", "fig5", "fig6", "fig7", "fig8", "fig9")


def place(folder: Path, kind: str) -> Path:
    """Return the only result of a kind."""
    results = folder / "results" / "tiny"
    if kind in STAGES:
        (found,) = (results / kind).glob(f"*{DATASET}")
    elif kind == "snapshot":
        (found,) = (results / "figures" / "snapshots").glob("*.png")
    else:
        table = results / f"{kind}{DATASET}"
        found = table if kind in TABLES else results / "figures" / f"{kind.split()[0]}.png"
    return found


KINDS = [
    pytest.param(kind, marks=[] if kind == "shear" else pytest.mark.slow)
    for kind in (*STAGES, *TABLES, *(f"{name} figure" for name in FIGURES), "snapshot")
]


@pytest.mark.parametrize("kind", KINDS)
def test_a_lost_result_comes_back_alone(whole: Path, tmp_path: Path, kind: str) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(whole, folder)
    lost = place(folder, kind)
    content = read_product(lost).content
    others = {
        path: path.read_bytes() for path in folder.glob("results/tiny/**/*.*") if path != lost
    }
    lost.unlink()
    said = snakemake(folder, str(lost.relative_to(folder)))
    assert "1 of 1 steps (100%) done" in said, said
    assert read_product(lost).content == content
    results = {path: content for path, content in others.items() if path.suffix in (".nc", ".png")}
    assert {path: path.read_bytes() for path in results} == results
    assert "Nothing to be done" in snakemake(folder, "all", "--dry-run")
