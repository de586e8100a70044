import re

import numpy as np
import pytest
from explorer_synthetic import (
    SHORT,
    ParsedPage,
    columns_of,
    curves_of,
    data_of,
    made_up,
    many,
    tables_of,
)
from synthetic import shear_run

from softslip.analysis.explorer import page as page_module
from softslip.analysis.explorer.embedding import restored
from softslip.analysis.explorer.page import explorer_page
from softslip.analysis.figures.markers import MEANINGS, verdicts

MOST = 10_000_000
"""Size that a page may have [byte]."""


@pytest.fixture(scope="module")
def few():
    return made_up(snapshots=(5.0, 25.0), missing=[(0.5, 0.59, 2)])


@pytest.fixture(scope="module")
def page(few):
    tables, runs = few
    return explorer_page(*tables, runs)


def test_one_number_a_run_is_that_of_the_dataset_to_the_last_bit(few, page):
    table, data = few[0][0], data_of(page)
    done = (table["status"] == "done").values
    assert data["runs"] == table["run_id"].values[done].tolist()
    assert list(data["columns"]) == columns_of(table)
    assert {"shear_rate_bulk_error", "verdict_slip", "heterogeneity"} <= set(data["columns"])
    for name, embedded in data["columns"].items():
        values = table[name].values[done]
        if values.dtype.kind == "f":
            assert restored(embedded).tobytes() == values.tobytes(), name
        else:
            assert embedded == values.tolist(), name


@pytest.mark.parametrize("copies", [1, 150])
def test_curves_go_through_points_of_the_dataset(few, copies):
    tables = [many(table, copies) for table in few[0]]
    data = data_of(explorer_page(*tables, []))
    done = (tables[0]["status"] == "done").values
    along = {"shear_rate_wall": 1, "shear_rate_bulk": 1, "normalised_velocity": 2}
    for name, number in along.items():
        table = tables[number]
        rows = table[name].values[done]
        error = f"{name}_error"
        assert (
            restored(data["curves"][name]["x"]).tobytes()
            == table[table[name].dims[-1]].values.tobytes()
        )
        left = restored(data["curves"][name][error]) if error in table else None
        begin = 0
        for place, (points, values) in enumerate(curves_of(data, name)):
            assert values.tobytes() == rows[place][points].tobytes(), (name, place)
            if left is not None:
                errors = table[error].values[done][place][points]
                assert left[begin : begin + len(points)].tobytes() == errors.tobytes()
            begin += len(points)
        share = data["curves"][name]["share"]
        assert share == 1 if copies == 1 else 0 < share < 1, (name, share)


def test_verdicts_are_those_that_the_figures_draw(few, page):
    table, data = few[0][0], data_of(page)
    done = (table["status"] == "done").values.ravel()
    for name, flag in page_module.FLAGS.items():
        drawn = [list(MEANINGS)[state] for state in restored(data["states"][name])]
        assert drawn == verdicts(table, flag)[done].tolist()


def test_every_axis_of_a_scenario_is_there_with_its_values(few):
    runs = [
        (
            {"stress": stress, "solvent_viscosity": viscosity, "fidelity": word},
            shear_run(stress, duration=SHORT),
        )
        for stress in (0.2, 0.4)
        for viscosity in (1.0, 2.0)
        for word in ("standard", "preview")
    ]
    data = data_of(explorer_page(*tables_of(runs), []))
    values = {axis["name"]: axis["values"] for axis in data["axes"]}
    assert values == {
        "stress": [0.2, 0.4],
        "solvent_viscosity": [1.0, 2.0],
        "fidelity": ["preview", "standard"],
    }
    for axis in data["axes"]:
        own = [axis["values"][place] for place in restored(axis["of"])]
        assert len(own) == len(runs)
        assert len(axis["colours"]) == len(axis["markers"]) == len(axis["values"])
        looks = set(zip(axis["colours"], axis["markers"], strict=True))
        assert len(looks) == len(axis["values"]), "two values look the same"


def test_a_scenario_without_axes_has_one_run():
    data = data_of(explorer_page(*tables_of([({}, shear_run(0.3, duration=SHORT))]), []))
    assert data["runs"] == ["s0.3-b0-1"]
    assert data["axes"] == []
    assert {each["name"]: each["value"] for each in data["shared"]}["stress"] == 0.3


def test_missing_runs_are_named(page):
    assert data_of(page)["missing"] == [{"stress": 0.5, "roughness": 0.59, "seed": 2}]


def test_the_same_runs_give_the_same_bytes(few, page):
    tables, runs = few
    assert explorer_page(*tables, runs) == page


def test_the_page_is_whole_and_loads_nothing(page):
    parsed = ParsedPage(page)
    sources = [
        (tag, key, value)
        for tag, key, value in parsed.attributes
        if key in ("src", "srcset", "href", "data", "action", "poster")
    ]
    assert sources == [("link", "href", "data:,")]
    rule = next(value for tag, key, value in parsed.attributes if "default-src" in value)
    assert rule.startswith("default-src 'none';")
    assert "http" not in rule
    assert not re.findall(r"url\(|@import", parsed.texts["style"])
    ours = parsed.texts["script"][-40_000:]
    assert not re.findall(r"fetch\(|XMLHttpRequest|import\(|WebSocket", ours)
    assert parsed.texts["h1"].strip() == "made-up <&>"


def test_a_thousand_runs_with_snapshots_fit_into_ten_megabytes(few):
    tables, runs = few
    wide = [many(table, 91) for table in tables]
    names = wide[0]["run_id"].values.ravel().tolist()
    assert len(names) > 1000
    pictured = (runs[0].assign_attrs(run=name) for name in names)
    page = explorer_page(*wide, pictured)
    assert len(page) + page_module.LABELS_ROOM * len(names) <= MOST
    data = data_of(page)
    assert len(data["runs"]) > 1000
    # Those that have a snapshot are shown or named, each once.
    shown = [*data["snapshots"], *data["without_room"]]
    assert shown == names
    assert len(data["snapshots"]) > 50


def test_snapshots_are_taken_up_in_the_order_of_the_runs_while_there_is_room(few, monkeypatch):
    tables, runs = few
    whole = data_of(explorer_page(*tables, runs))
    assert (list(whole["snapshots"]), whole["without_room"]) == ([r.run for r in runs], [])
    size = len(explorer_page(*tables, []))
    one = len(explorer_page(*tables, runs[:1])) - size
    labels = page_module.LABELS_ROOM * len(runs)
    monkeypatch.setattr(page_module, "LIMIT", size + labels + int(2.5 * one))
    some = data_of(explorer_page(*tables, runs))
    assert list(some["snapshots"]) == [run.run for run in runs[:2]]
    assert some["without_room"] == [run.run for run in runs[2:]]
    assert np.isfinite([each["time"] for each in some["snapshots"].values()]).all()
