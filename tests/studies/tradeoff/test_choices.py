import json

import numpy as np
import pytest
import tradeoff_synthetic as synthetic

from softslip.config.accuracy import Choice, cheapest
from softslip.config.parameters import Parameters
from softslip.studies.tradeoff.choices import choices, doubts
from softslip.studies.tradeoff.table import gather


@pytest.fixture(scope="module")
def table():
    return gather(synthetic.members(), [])


def test_choices_get_dearer_as_they_get_better(table):
    rows = choices(table)
    assert len(rows) > 2
    costs, errors = ([row[key] for row in rows] for key in ("cost", "error"))
    assert costs == sorted(costs)
    assert errors == sorted(errors, reverse=True)
    assert len(set(errors)) == len(errors)


def test_the_promised_error_is_no_smaller_than_the_measured_one_and_its_doubt(table):
    doubt = doubts(table)
    assert (doubt > 0).all()
    for row in choices(table):
        spread = row["settings"]["hydrodynamics"]["regularisation"] or synthetic.MESH
        spacing = row["settings"]["hydrodynamics"]["node_spacing"]
        here = np.isclose(table["regularisation"], spread) & (table["node_spacing"] == spacing)
        here &= np.isin(table["kind"], ("factorial", "finest"))
        measured = (table["regularisation_error"] + table["same_error"]).values[here]
        assert (measured >= table["error"].values[here] * (1 - 1e-9)).all()
        worst = float((measured + doubt).max())
        # Rounded up to two digits: by a tenth at most.
        assert worst <= row["error"] <= 1.1 * worst


def test_settings_are_complete_and_make_a_run(table):
    for row in choices(table):
        given = Parameters.from_mapping(json.loads(json.dumps(row["settings"])))
        assert given.hydrodynamics.mobility == "ewald"
        assert given.time_stepping.integrator == "imex_rkc2"
        assert given.membrane.order == 6


def test_the_cheapest_choice_that_is_good_enough_is_taken(table):
    rows = [Choice(**row) for row in choices(table)]
    for row in rows:
        assert cheapest(row.error, rows).cost == row.cost


@pytest.mark.parametrize(
    "change",
    [
        {"spacing": 6.3},
        {"spread": 0.02},
        {"stopped": "a film collapsed; refine"},
    ],
)
def test_what_is_unsafe_elsewhere_is_no_choice(change):
    given = {"spread": 0.2, "spacing": 5.0, **change}
    tempting = synthetic.member("tempting", "factorial", cost=0.01, **given)
    usual = choices(gather(synthetic.members(), []))
    assert choices(gather([*synthetic.members(), tempting], [])) == usual


def test_levels_variants_and_meshes_are_no_choices(table):
    grid = {"factorial", "finest"}
    kinds = dict(zip(table["settings"].values, table["kind"].values, strict=True))
    for row in choices(table):
        assert kinds[json.dumps(row["settings"], sort_keys=True)] in grid
