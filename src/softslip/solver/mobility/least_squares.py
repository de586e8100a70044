"""Least squares with the same bits whatever linear algebra library NumPy calls.

What is fitted here becomes constants of compiled loops. LAPACK and BLAS round differently from one
processor to the next, and their settings may even change that on one machine, while the loops with
their constants are kept from one process to the next.
"""

import numpy as np

from softslip.solver.geometry import FloatArray


def least_squares(columns: FloatArray, values: FloatArray) -> FloatArray:
    """Return the coefficients c with the least sum of squares of columns c - values.

    By modified Gram-Schmidt orthogonalisation, which loses no more digits than the columns'
    condition number has (Björck 1967).

    Parameters
    ----------
    columns
        Linearly independent, shape (points, coefficients).
    values
        Shape (points,).
    """
    basis, rest = columns.T.copy(), values.copy()
    count = len(basis)
    triangle, right = np.zeros((count, count)), np.zeros(count)
    for j, column in enumerate(basis):
        triangle[j, j] = np.sqrt(np.sum(column**2))
        column /= triangle[j, j]
        triangle[j, j + 1 :] = np.sum(basis[j + 1 :] * column, axis=1)
        basis[j + 1 :] -= triangle[j, j + 1 :, None] * column
        right[j] = np.sum(column * rest)
        rest -= right[j] * column
    found = np.zeros(count)
    for j in reversed(range(count)):
        known = np.sum(triangle[j, j + 1 :] * found[j + 1 :])
        found[j] = (right[j] - known) / triangle[j, j]
    return found


def powers_fitted(t: FloatArray, values: FloatArray, degree: int) -> FloatArray:
    """Return the coefficients in rising powers of the polynomial nearest to values, -1 < t < 1."""
    basis = np.asarray(np.polynomial.chebyshev.chebvander(t, degree), np.float64)
    powers = np.zeros(degree + 1)
    # Without highest powers that are zero.
    found = np.polynomial.chebyshev.cheb2poly(least_squares(basis, values))
    powers[: len(found)] = found
    return powers
