import numpy as np
import pytest
import scenes
import twins

from softslip import films
from softslip.derived import contact_strength
from softslip.errors import ConfigError
from softslip.parameters import Parameters

RANGE, ENERGY = 9 / 8192, 1e-9


def strength(energy=ENERGY):
    return contact_strength(energy, "energy")


@pytest.mark.parametrize("ratio", [0.5, 0.77, 0.95])
def test_the_pressure_of_a_film_is_that_of_two_rows_of_points(ratio):
    """Points a hundredth of the range apart, which miss less than 1e-3 of the sum near its end."""
    apart, film = 0.01 * RANGE, ratio * RANGE
    x = apart * np.arange(-150, 151)
    points = np.concatenate(([[0.0, film]], np.column_stack((x, np.zeros_like(x)))))
    body = np.append(0, np.ones(len(x), int))
    pairs = twins.close_pairs(points, body, 2, 1.0, RANGE)
    weights = np.append(1.0, np.full(len(x), apart))
    push = twins.contact_pushes(points, weights, pairs, 1.0, RANGE, ENERGY, "energy")
    total = abs(push[:, 1].sum())
    assert films.contact_pressure(film, RANGE, strength()) == pytest.approx(total, rel=2e-3)


@pytest.mark.parametrize("pressure", [1e-3, 0.3, 1.0, 100.0])
@pytest.mark.parametrize("energy", [1e-11, 1e-9, 1e-7])
def test_a_film_carries_its_pressure(pressure, energy):
    film = films.film_under(pressure, RANGE, strength(energy))
    assert 0 < film < RANGE
    found = films.contact_pressure(film, RANGE, strength(energy))
    assert found == pytest.approx(pressure, rel=1e-5)


def test_a_pressure_that_no_film_carries_leaves_the_thinnest():
    assert films.film_under(1e12, RANGE, strength(1e-15)) == pytest.approx(0.05 * RANGE)


def test_stiffer_contacts_leave_fewer_points_in_range():
    found = [films.points_in_range(given(energy), 2) for energy in (1e-11, 1e-10, 1e-9, 1e-8, 1e-7)]
    assert np.all(np.diff(found) < 0)
    assert films.points_in_range(given(ENERGY), 4) == pytest.approx(2 * found[2], rel=1e-12)


def given(energy, fidelity="standard", **groups):
    tree = {"fidelity": fidelity, "steric": {"energy": energy}, **groups}
    return Parameters.from_mapping(tree)


@pytest.mark.parametrize("fidelity", [None, "preview", "standard", "paper", "converged"])
@pytest.mark.parametrize("energy", [0.0, 1e-11, 1e-9, 1e-8])
def test_every_level_resolves_the_contacts_of_the_paper_and_stiffer_ones(fidelity, energy):
    given(energy, fidelity)


def stiff(refinement):
    steric = {"energy": 1e-7, "refinement": refinement}
    return Parameters.from_mapping(
        {"fidelity": "standard", "steric": steric, "hydrodynamics": {"node_spacing": 5.0}}
    )


def test_contacts_that_interlock_are_refused_with_what_would_do():
    with pytest.raises(ConfigError, match=r"steric\.refinement: 2 .* use at least 3,") as caught:
        stiff(2)
    assert caught.value.key == "steric.refinement"
    stiff(3)


def test_nothing_is_refused_where_nothing_touches():
    given(1e-7, suspension={"area_fraction": 0.0})


def test_a_scenario_with_contacts_that_interlock_is_refused_before_anything_runs():
    with pytest.raises(ConfigError, match=r"steric\.refinement"):
        scenes.parameters(steric={"energy": 1e-6})
