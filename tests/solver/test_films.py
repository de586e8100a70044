import numpy as np
import pytest
import twins

from softslip.solver import films
from softslip.solver.films import contact_strength

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
