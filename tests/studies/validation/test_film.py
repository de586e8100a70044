import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from softslip.errors import ConfigError
from softslip.studies.validation.film import Film
from softslip.studies.validation.solutions import MeshSheets, RegularisedSheets

FIDELITIES = ["literal", "preview", "standard", "paper", "converged"]


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("thickness", [0.5, 0.75, 1.0, 10.0])
def test_film_is_as_thin_as_the_kernel_makes_it(fidelity, thickness):
    outcome = Film(fidelity=fidelity, thickness=thickness).solve()
    assert outcome.passed, outcome.errors
    assert outcome.result["thickness"] == pytest.approx(9 / 8192 * thickness)
    assert set(outcome.result) | set(outcome.errors) == set(Film.units)


@settings(max_examples=15)
@given(st.floats(0.1, 8.0), st.floats(0.1, 3.0), st.sampled_from(["standard", "converged"]))
def test_film_is_right_for_any_regularisation(regularisation, thickness, fidelity):
    outcome = Film(fidelity=fidelity, regularisation=regularisation, thickness=thickness).solve()
    assert outcome.passed, outcome.errors


def test_a_contact_film_loses_an_eighth_at_the_papers_resolution():
    literal = Film(fidelity="literal").solve()
    assert 0.1 < literal.result["thinning"] < 0.15
    assert literal.error < 1e-6, "the mesh has an exact solution, to its nodes' own waves"


def test_a_regularisation_of_the_mesh_is_refused():
    with pytest.raises(ConfigError, match=r"hydrodynamics\.regularisation"):
        Film(fidelity="literal", regularisation=0.5).solve()


@pytest.mark.parametrize(("thickness", "epsilon"), [(1.0, 0.3), (0.2, 0.5), (3.0, 0.1)])
def test_exact_film_is_the_integral_over_the_kernel(thickness, epsilon):
    """(2/π) ∫ e^{-ε²k²} (1 - cos kh)/k² dk, the flow of both sheets in Fourier space."""

    def mode(k):
        return math.exp(-((epsilon * k) ** 2)) * (1 - math.cos(k * thickness)) / k**2

    exact = 2 / math.pi * quad(mode, 1e-12, 8 / epsilon, limit=500)[0]
    assert RegularisedSheets(thickness, epsilon).film == pytest.approx(exact, rel=1e-8)


def test_a_thick_film_loses_the_mean_distance_of_two_kernel_variables():
    assert RegularisedSheets(50.0, 1.0).lag == pytest.approx(2 / math.sqrt(math.pi))
    lags = [MeshSheets(20.0, 1.0, place).lag for place in np.linspace(0, 1, 9)]
    assert np.ptp(lags) < 3e-3, "the kernel hardly sees where the mesh lines are"
    assert MeshSheets(0.2, 0.01).lag == pytest.approx(0.01 * lags[0])


def test_a_film_of_no_thickness_is_none():
    assert MeshSheets(0.0, 1.0, 0.3).film == pytest.approx(0.0, abs=1e-15)
    assert RegularisedSheets(1e-9, 1.0).film == pytest.approx(0.0, abs=1e-15)
