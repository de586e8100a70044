"""What is asked for by name and cannot be made is told in one sentence."""

from pathlib import Path

import pytest
from projects import TINY

from softslip.config.scenario import Scenario, load_scenario
from softslip.files.expected_results import expected_results
from softslip.operations.asked_results import why_not

RESULTS = Path("results/small")


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scenario:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config").mkdir()
    for name in ("small", "other"):
        (tmp_path / "config" / f"{name}.yaml").write_text(TINY)
    return load_scenario("small")


def test_every_result_may_be_asked_for(scenario: Scenario) -> None:
    for each in expected_results(scenario):
        for spelling in (RESULTS / each.name, RESULTS.absolute() / each.name):
            assert why_not(str(spelling), scenario, RESULTS) == ""


OTHERS = (
    *("", "-n", "--config", "scenario=small", "all", "report.html", "results/small/report.html"),
    *("results/bench/scaling.nc", "\0.nc", "elsewhere/x.nc", "results/x.nc", "..", "~.nc"),
)


@pytest.mark.parametrize("word", OTHERS)
def test_other_words_are_none_of_its_business(scenario: Scenario, word: str) -> None:
    assert why_not(word, scenario, RESULTS) == ""


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("shear/0000000000000000.nc", "shear 0000000000000000: is no run of scenario small; list"),
        ("figures/snapshots/x.png", "shear x: is no run of scenario small; list them with: softs"),
        ("packing/0.nc", "is no run of scenario small; list them with: softslip runs small"),
        ("figures/fig55.png", "did you mean figures/fig5.png"),
        ("figures/fig5.pdf", "did you mean figures/fig5.png"),
        ("flow_curves.nc", "did you mean flow_curve.nc"),
        ("figures/movie.mp4", "movie: no run of small keeps 5 snapshots or more after time 0; set"),
        ("zzz.nc", "is no result of scenario small; it has flow_curve.nc"),
        ("../other/flow_curve.nc", "choose the other scenario with --config scenario=other"),
    ],
)
def test_what_cannot_be_made_is_told_with_what_can(
    scenario: Scenario, name: str, said: str
) -> None:
    assert said in why_not(str(RESULTS / name), scenario, RESULTS)


def test_a_figure_by_its_name_is_told_what_it_lacks(scenario: Scenario) -> None:
    assert why_not("movie", scenario, RESULTS).startswith("movie: no run of small keeps 5 snap")
    assert why_not("fig1", scenario, RESULTS) == ""
    Path("config/bare.yaml").write_text(TINY.replace("snapshots: [0.25], ", ""))
    bare = load_scenario("bare")
    said = "fig1: no run of bare keeps 1 snapshot or more after time 0; set recording.snapshots"
    assert why_not("fig1", bare, RESULTS).startswith(said)
    assert why_not("fig5", bare, RESULTS) == ""


def test_a_run_under_another_ending_is_no_missing_run(scenario: Scenario) -> None:
    run = next(iter(scenario.stage_table("shear")))
    found = why_not(f"results/small/shear/{run}.png", scenario, RESULTS)
    assert f"did you mean shear/{run}.nc" in found
