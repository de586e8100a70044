"""Least squares against LAPACK, and whether anything that kernels keep depends on it."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from softslip.solver.mobility.least_squares import least_squares, powers_fitted

CONSTANTS = """
import numpy as np
from softslip.solver import films
from softslip.solver.mobility import near, window
from softslip.solver.mobility.blob import Blob
blobs = [Blob.fitted(ratio) for ratio in (1e-3, 0.05, 0.18)]
wavenumbers = np.linspace(0, 30, 50)
numbers = [window._POLYNOMIALS, near._LOGARITHM, near._CLOSE]
numbers += [near.near_series(blob) for blob in blobs]
numbers += [blob.far_factor(wavenumbers) for blob in blobs]
numbers.append(np.array(films.film_under(0.3, 9 / 8192, 1.0)))
print(b"".join(each.tobytes() for each in numbers).hex())
"""


@given(
    arrays(np.float64, (20, 4), elements=st.floats(-1, 1)),
    arrays(np.float64, 20, elements=st.floats(-1, 1)),
)
def test_least_squares_are_those_of_lapack(noise, values):
    columns = np.polynomial.legendre.legvander(np.linspace(-1, 1, 20), 3) + 0.1 * noise
    wanted = np.linalg.lstsq(columns, values, rcond=None)[0]
    assert least_squares(columns, values) == pytest.approx(wanted, rel=1e-10, abs=1e-12)


def test_neither_columns_nor_values_are_changed():
    columns, values = np.vander(np.arange(5.0), 3), np.arange(5.0) ** 3
    before = columns.copy(), values.copy()
    least_squares(columns, values)
    assert np.array_equal(columns, before[0])
    assert np.array_equal(values, before[1])


@given(arrays(np.float64, 6, elements=st.floats(-10, 10)))
def test_a_polynomial_is_its_own_fit(coefficients):
    t = np.cos(np.pi * (np.arange(30) + 0.5) / 30)
    values = np.polynomial.polynomial.polyval(t, coefficients)
    assert powers_fitted(t, values, 5) == pytest.approx(coefficients, abs=1e-12)


def test_constants_of_the_sums_do_not_depend_on_the_linear_algebra_library():
    """Kernels keep them from one process to the next, whatever BLAS that one calls."""

    def constants(kernels):
        settings = os.environ | {"OPENBLAS_CORETYPE": kernels}
        return subprocess.check_output([sys.executable, "-c", CONSTANTS], env=settings, text=True)

    assert constants("Haswell") == constants("Prescott")
