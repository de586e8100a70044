import pytest

from softslip.config.accuracy import Choice, cheapest, measured_choices
from softslip.config.parameters import Parameters
from softslip.errors import ConfigError


def choice(error, cost, spacing=4.0):
    return Choice({"hydrodynamics": {"node_spacing": spacing}}, error, cost)


ROWS = (choice(0.1, 1.0, 6.0), choice(0.02, 1.5, 5.0), choice(0.03, 1.2), choice(0.001, 9.0, 2.0))


@pytest.mark.parametrize(("wanted", "cost"), [(0.5, 1.0), (0.1, 1.0), (0.05, 1.2), (0.002, 9.0)])
def test_the_cheapest_row_that_is_good_enough_is_taken(wanted, cost):
    assert cheapest(wanted, ROWS).cost == cost


def test_an_accuracy_that_nothing_meets_is_refused_with_the_best_there_is():
    with pytest.raises(ConfigError, match=r"accuracy: 1e-05 is below 0.001.*use at least 0.001"):
        cheapest(1e-5, ROWS)


def test_every_measured_choice_makes_valid_parameters():
    rows = measured_choices()
    assert rows
    for row in rows:
        given = Parameters.from_mapping({"accuracy": row.error})
        for group, values in row.settings.items():
            for key, value in values.items():
                assert getattr(getattr(given, group), key) == value
    assert [row.cost for row in rows] == sorted(row.cost for row in rows)


def test_an_accuracy_sets_what_the_scenario_leaves_open():
    wanted = max(row.error for row in measured_choices())
    settings = cheapest(wanted).settings
    given = Parameters.from_mapping({"accuracy": wanted})
    assert given.hydrodynamics.node_spacing == settings["hydrodynamics"]["node_spacing"]
    own = Parameters.from_mapping({"accuracy": wanted, "hydrodynamics": {"node_spacing": 1.42}})
    assert own.hydrodynamics.node_spacing == 1.42
    assert own.hydrodynamics.mobility == "ewald"


def test_accuracy_and_fidelity_together_are_refused():
    with pytest.raises(ConfigError, match=r"accuracy: 0.1 .*fidelity"):
        Parameters.from_mapping({"accuracy": 0.1, "fidelity": "standard"})


@pytest.mark.parametrize("value", [0.0, -1.0, 1.0, "0.1", True])
def test_an_accuracy_that_is_no_part_of_one_is_refused(value):
    with pytest.raises(ConfigError, match="accuracy"):
        Parameters.from_mapping({"accuracy": value})
