import numpy as np
import pytest

from softslip.analysis.figures.validation import PUBLISHED_DRAG
from softslip.studies.validation.lattice import array_drag


def dilute_drag(concentration: float) -> float:
    """Return F/(ηU) of a dilute square array, to third order in c (Sangani & Acrivos 1982)."""
    c = concentration
    return 8 * np.pi / (-np.log(c) - 1.476 + 2 * c - 1.774 * c**2 + 4.076 * c**3)


@pytest.mark.parametrize("concentration", PUBLISHED_DRAG)
def test_drag_is_the_published_one(concentration):
    """To half a unit of its last digit; two, where the published one was solved less closely."""
    wanted = PUBLISHED_DRAG[concentration]
    assert array_drag(concentration) == pytest.approx(wanted, abs=0.02)


@pytest.mark.parametrize("concentration", [1e-4, 1e-3, 1e-2])
def test_drag_of_a_dilute_array_is_the_series(concentration):
    """Which goes on with a term in c⁴ of the order of its own coefficients, and has four digits."""
    left_out = 10 * concentration**4 + 5e-4
    found, series = (8 * np.pi / f(concentration) for f in (array_drag, dilute_drag))
    assert abs(found - series) <= left_out


@pytest.mark.parametrize(("concentration", "terms"), [(0.05, 40), (0.3, 50), (0.5, 75), (0.6, 150)])
def test_more_terms_change_nothing(concentration, terms):
    first = array_drag(concentration)
    assert array_drag(concentration, terms) == pytest.approx(first, rel=1e-8)


@pytest.mark.parametrize(("gap", "left"), [(0.05, 2e-3), (0.1, 5e-3)])
def test_drag_diverges_as_lubrication_between_cylinders_that_nearly_touch(gap, left):
    """F/(ηU) = (9π/2√2) δ^{-5/2} with δ = 1 - √(c/c_max), and corrections of the order of δ²."""
    found = array_drag(np.pi / 4 * (1 - gap) ** 2)
    assert found == pytest.approx(9 * np.pi / (2 * 2**0.5) * gap**-2.5, rel=left)
