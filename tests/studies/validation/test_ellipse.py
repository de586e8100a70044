"""Relaxation of a taut circle: its linear theory, and the solver on it."""

import math

import numpy as np
import pytest

from softslip.errors import ConfigError
from softslip.studies.validation.ellipse import Ellipse
from softslip.studies.validation.ring_theory import Ring


@pytest.mark.parametrize("mode", [2, 3, 7])
@pytest.mark.parametrize("stretch", [1.05, 1.5])
def test_both_rates_are_known_in_closed_form(mode, stretch):
    rates, columns = Ring(0.7, stretch, mode).modes()
    slow, fast = mode * (stretch - 1) / (4 * 0.7), mode * stretch / (4 * 0.7)
    np.testing.assert_allclose(rates, [slow, fast], rtol=1e-12)
    assert columns[1, 0] / columns[0, 0] == pytest.approx(-1 / mode), "the slow one stretches"
    assert columns[0, 1] == pytest.approx(0.0, abs=1e-12), "the fast one deforms"


def test_unstretched_circle_deforms_without_resistance():
    assert Ring(1.0, 1.0, 2).modes()[0][0] == pytest.approx(0.0, abs=1e-14)


def test_regularised_theory_tends_to_the_sharp_one():
    sharp = Ring(1.0, 1.1, 3).response()
    away = [np.abs(Ring(1.0, 1.1, 3, eps).response() - sharp).max() for eps in (0.04, 0.02, 0.01)]
    # First order in ε.
    assert away[0] / away[1] == pytest.approx(2.0, rel=0.1)
    assert away[1] / away[2] == pytest.approx(2.0, rel=0.05)


def test_regularisation_slows_the_motion_along_the_membrane_first():
    """Of a wave of wavenumber q = n/a on a plane it takes away 4qε/√π along, and less across."""
    mode, epsilon = 60, 1e-4
    plain, soft = Ring(1.0, 1.1, mode), Ring(1.0, 1.1, mode, epsilon)
    lost = 1 - np.diag(soft.response()) / np.diag(plain.response())
    assert lost[1] == pytest.approx(4 * mode * epsilon / math.sqrt(math.pi), rel=0.02)
    assert lost[0] < 0.02 * lost[1]


def test_response_is_symmetric_and_dissipates():
    matrix = Ring(1.0, 1.1, 4, 0.02).response()
    assert matrix[0, 1] == matrix[1, 0]
    assert np.linalg.eigvalsh(matrix).min() > 0


@pytest.mark.parametrize("branch", ["slow", "fast"])
def test_solver_decays_at_the_rate_of_its_regularised_theory(branch):
    outcome = Ellipse.of({"fidelity": "preview", "branch": branch, "box": 24.0}).solve()
    assert outcome.passed, outcome.errors
    assert outcome.errors["rate_regularised"] < 4e-3, "1/L⁴ of the smaller box is some 2e-3"
    assert outcome.result["amplitude_left"] == pytest.approx(math.exp(-1), rel=0.03)
    assert set(outcome.result) == set(Ellipse.units)


def test_wrong_rest_length_is_noticed(monkeypatch):
    """The rate follows the tension: theory of another stretch must not pass."""
    case = Ellipse.of({"fidelity": "preview", "stretch": 1.1, "box": 16.0})
    other = Ellipse.of({"fidelity": "preview", "stretch": 1.12, "box": 16.0})
    monkeypatch.setattr(Ellipse, "decay", lambda _, side: decay(other, side))
    assert not case.solve().passed


decay = Ellipse.decay


@pytest.mark.parametrize("values", [{"mode": 1}, {"stretch": 1.0}, {"amplitude": 0.2}])
def test_refuses_what_linear_theory_does_not_cover(values):
    with pytest.raises(ConfigError, match=next(iter(values))):
        Ellipse.of(values)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [2, 4])
@pytest.mark.parametrize("branch", ["slow", "fast"])
@pytest.mark.parametrize("fidelity", ["standard", "paper"])
def test_every_level_decays_as_it_should(fidelity, branch, mode):
    outcome = Ellipse.of({"fidelity": fidelity, "branch": branch, "mode": mode}).solve()
    assert outcome.passed, outcome.errors
    assert outcome.errors["rate_regularised"] < 2e-3
