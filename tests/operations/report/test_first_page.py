import re
from pathlib import Path

import pytest
from projects import TINY

from softslip.config.scenario import Scenario, load_scenario
from softslip.operations.report.first_page import MOST_LISTED, first_page

STRESSES = "axes:\n  rheometer.stress: [{}]\n"


@pytest.fixture
def scenario(tmp_path: Path) -> Scenario:
    """Return a scenario with more runs than are named one by one."""
    stresses = ", ".join(str(0.01 * (1 + each)) for each in range(MOST_LISTED + 5))
    words = TINY.replace("its numbers mean nothing", "no <b>word</b> & no *sign* is markup")
    (tmp_path / "many.yaml").write_text(words + STRESSES.format(stresses))
    return load_scenario(str(tmp_path / "many.yaml"))


def test_what_is_missing_is_counted_and_the_first_is_named(
    scenario: Scenario, tmp_path: Path
) -> None:
    page = first_page(scenario, tmp_path / "results", studied=True)
    assert f"not done, stage by stage ({MOST_LISTED + 8}):" in page
    assert len(re.findall("<td>missing</td>", page)) == MOST_LISTED
    assert "and 8 more; to list them all: softslip status many --all" in page
    assert "<li>flow_curve.nc</li>" in page
    assert "With which code" not in page
    assert "results/published" not in page


def test_words_of_a_scenario_are_no_markup(scenario: Scenario, tmp_path: Path) -> None:
    page = first_page(scenario, tmp_path / "results", studied=True)
    assert "no &lt;b&gt;word&lt;/b&gt; &amp; no *sign* is markup" in page


def test_results_that_cannot_be_read_are_named(scenario: Scenario, tmp_path: Path) -> None:
    results = tmp_path / "results"
    run = next(iter(scenario.stage_table("shear")))
    (results / "shear").mkdir(parents=True)
    for path in (results / "shear" / f"{run}.nc", results / "flow_curve.nc"):
        path.write_bytes(b"damaged")
    page = first_page(scenario, results, studied=True)
    listed = page.partition("Results that cannot be read:")[2]
    assert f"{run}.nc: " in listed
    assert "flow_curve.nc: " in listed
    assert "Whether runs are steady is not known: " in page
    assert "Nothing: every run" not in page
