"""What elements of scenes cost, in miniature: what is compared and counted is right, not times."""

import json
import math

import numpy as np
import pytest

from softslip.files.storage import read_dataset, write_dataset
from softslip.simulation.sample import wall_contour
from softslip.studies import bench, boxes, scenes, timing
from softslip.studies.bench import elements, elements_scenes
from softslip.studies.bench.datasets import ELEMENT_COSTS, WORDS
from softslip.studies.bench.elements_markdown import COLUMNS, elements_table

SMALL, LEVEL = 24, "preview"
AGEING, SHEARING, DURATION = 0.5, 0.2, 0.4
EMPTY = "wall drive, no particles"
NUMBERS = (*ELEMENT_COSTS, "saved_share", "saved_per_evaluation")


@pytest.fixture(scope="module")
def result():
    return bench.bench_elements(
        SMALL, LEVEL, ageing=AGEING, shearing=SHEARING, duration=DURATION, budget=0.0
    )


@pytest.fixture(scope="module")
def kept(result, tmp_path_factory):
    """The result as it comes back from a file."""
    path = tmp_path_factory.mktemp("bench") / "elements.nc"
    dataset = bench.as_dataset(result)
    write_dataset(dataset, path, stage="bench", run="elements", title="elements")
    return read_dataset(path, stage="bench", run="elements")


def figures(result, key):
    return {
        name: (result[f"{key}_with"][name], result[f"{key}_without"][name])
        for name in elements.ELEMENTS
    }


def test_every_element_has_all_figures(result):
    for key in (*NUMBERS, *WORDS):
        assert list(result[key]) == list(elements.ELEMENTS), key
    for key in NUMBERS:
        assert all(math.isfinite(value) for value in result[key].values()), key
    assert json.loads(json.dumps(result)) == result


def test_the_saved_share_is_that_of_the_scene_with_the_element(result):
    for name, (present, absent) in figures(result, "seconds").items():
        assert result["saved_share"][name] == pytest.approx(1 - absent / present), name
        assert present > 0
        assert absent > 0
        before, after = figures(result, "evaluations")[name]
        wanted = 1 - (absent / after) / (present / before)
        assert result["saved_per_evaluation"][name] == pytest.approx(wanted), name


def test_scenes_have_the_nodes_and_pairs_of_their_elements(result):
    nodes, pairs, contacts = (figures(result, key) for key in ("nodes", "pairs", "contacts"))
    dense = nodes["particles"][0]
    scene, _ = scenes.flowing(SMALL, LEVEL, AGEING, SHEARING)
    walls = 2 * scene.layout.wall_nodes
    assert dense == scene.layout.nodes
    assert nodes["particles"] == (dense, walls)
    assert contacts["particles"][1] == 0 < contacts["particles"][0]
    # Only the walls' own pairs are left, of which each wall has as many.
    assert 0 < pairs["particles"][1] < pairs["particles"][0]
    # Nodes go with the areas' roots, numbers with the areas: within a particle or so.
    ratio = (nodes["close packing"][1] - walls) / (dense - walls)
    assert ratio == pytest.approx(elements_scenes.DILUTE / boxes.AREA_FRACTION, rel=0.15)
    assert contacts["close packing"][1] < 0.05 * contacts["close packing"][0]
    # The same particles, and arcs instead of their chords.
    given = boxes.parameters_of(SMALL, LEVEL, wall={"roughness": elements_scenes.ROUGHNESS})
    contour = wall_contour(given)
    for name in ("bumps", "bumps, no particles"):
        more = nodes[name][0] - nodes[name][1]
        assert more == pytest.approx(walls * (contour.arc_length / contour.length - 1), abs=2)
    assert nodes[EMPTY] == (walls, walls)
    for name in ("wall drive", "outer gap", "velocity fields", "bulk observables", "observables"):
        assert nodes[name] == (dense, dense), name


def test_records_cost_time_and_no_evaluation(result):
    for name in ("velocity fields", "bulk observables", "observables"):
        for key in ("evaluations", "pairs", "contacts"):
            present, absent = figures(result, key)[name]
            assert present == absent, (name, key)
    for name in ("velocity fields", "observables"):
        assert result["saved_share"][name] > 0, name


def test_scenes_are_run_in_turns_and_the_least_time_counts(monkeypatch):
    seen, core = [], iter([5.0, 7.0, 3.0, 9.0, 4.0, 8.0])

    def advance(scene, duration):
        seen.append(scene)
        return scenes.Stretch(None, duration, 0.0, next(core), 0.0, 1, 10)

    monkeypatch.setattr(elements.scenes, "advance", advance)
    monkeypatch.setattr(elements, "_cost", lambda scene, stretch: (scene, stretch.core_seconds))
    assert elements._of_motion("with", "without", 2.0, 0.0) == (("with", 3.0), ("without", 7.0))
    assert seen == ["with", "without"] * timing.FEWEST_ROUNDS


def test_results_are_kept_with_their_words(result, kept):
    assert list(kept["element"].values) == list(elements.ELEMENTS)
    for key in NUMBERS:
        assert kept[key].dims == ("element",)
        assert kept[key].attrs["units"]
        assert kept[key].values.tolist() == list(result[key].values())
    for key in WORDS:
        assert key in kept.coords
        assert kept[key].values.tolist() == list(result[key].values())
    assert float(kept["duration"]) == DURATION


def test_the_table_says_what_is_switched_off_and_saved(result, kept):
    title, _, head, rule, *rows = elements_table(kept).splitlines()
    assert f"{SMALL} particles at fidelity {LEVEL}" in title
    cells = [[cell.strip() for cell in row.strip("|").split(" | ")] for row in (head, *rows)]
    assert cells[0] == list(COLUMNS)
    assert rule.count("---") == len(COLUMNS)
    assert [row[0] for row in cells[1:]] == list(elements.ELEMENTS)
    for row in cells[1:]:
        name = row[0]
        assert len(row) == len(COLUMNS)
        assert row[1:3] == [result["scene_with"][name], result["scene_without"][name]]
        nodes = [result[f"nodes_{word}"][name] for word in ("with", "without")]
        assert row[5] == f"{nodes[0]} → {nodes[1]}"
        seconds = [float(value) for value in row[3].split(" → ")]
        wanted = [result[f"seconds_{word}"][name] for word in ("with", "without")]
        np.testing.assert_allclose(seconds, wanted, rtol=5e-3)
        saved = [result[key][name] for key in ("saved_share", "saved_per_evaluation")]
        assert row[8:10] == [f"{share:.1%}" for share in saved]
        assert row[10] == result["switched_off"][name]
