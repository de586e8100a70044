"""The blob of force that the far part of the Ewald sum works with, and what it leaves to the near.

A point force is replaced by a blob of radius R, the reach, whose density is a polynomial in
x = r²/R², and zero beyond. Written in Legendre polynomials,

    w(x) = (1/πR²) Σ_n a_n P_n(1 - 2x),    far(k) = Σ_n a_n 2 J_{2n+1}(kR)/(kR),

because Zernike's polynomials have these transforms. a_0 = 1 makes it as strong as the force,
a_1 = 3 - 24 ε²/R² gives it the second moment of the regularised force, so that
near = e^{-ε²k²} - far = O(k⁴), and the others leave as little as can be beyond the highest
wavenumber of the far mesh. As the flow of a force obeys the biharmonic equation where there is
none, both then cause the same flow beyond R, exactly: the near sum ends at R by itself.

A force f at distance r causes the near velocity T_t f + (T_r - T_t)(f·r̂) r̂, with

    2πη T_r = A₁,    2πη T_t = A₀ - A₁,
    A₀ = ∫ near(k) J₀(kr) dk/k = ∫_r^∞ (Q_ε - Q) dr'/r',    A₁ = r⁻² ∫_0^r A₀ r' dr',

Q_ε = 1 - e^{-c}, c = r²/4ε², and Q being the shares of the regularised force and of the blob within
r. So, with two polynomials p and q and without any approximation,

    2πη T_t = p(x) - ¼ [ln x + E₁(c)] + ¼ G(c),    2πη (T_r - T_t) = q(x) - ½ G(c),
    G(c) = (1 - e^{-c})/c.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from scipy.special import exp1, jv

from softslip.solver.geometry import FloatArray
from softslip.solver.mobility.least_squares import least_squares

MESH_REACH = 10.3
"""Highest wavenumber of the far mesh times the reach: beyond it the blob has few modes.

Fewer lines or a shorter reach leave more out: the error of the sums falls by e for each unit.
"""

DEGREE = 5
"""Degree of the blob's density in x: higher ones leave hardly less beyond the mesh."""

_BEYOND = np.linspace(0.95 * MESH_REACH, 15 * MESH_REACH, 4000)
"""Wavenumbers times the reach at which the blob is made small: those that the far mesh leaves out,
and the last ones that it has, which its window confuses with their aliases."""


def _transforms(wavenumbers: FloatArray) -> FloatArray:
    """Return 2 J_{2n+1}(z)/z at z = kR, shape (..., DEGREE + 1)."""
    z = np.where(wavenumbers == 0, 1e-12, wavenumbers)[..., None]
    transforms: FloatArray = 2 * jv(2 * np.arange(DEGREE + 1) + 1, z) / z
    return transforms


@dataclass(frozen=True)
class Blob:
    """The blob for a regularisation length and a reach.

    Attributes
    ----------
    ratio
        ε/R.
    weights
        a_n, shape (DEGREE + 1,).
    """

    ratio: float
    weights: FloatArray

    @classmethod
    def fitted(cls, ratio: float) -> "Blob":
        """Return the blob with the least rms velocity beyond the far mesh for random forces."""
        fixed = np.array([1.0, 3.0 - 24.0 * ratio**2])
        # Velocities have 1/k² more, and a ring of wavenumbers grows as k.
        modes = _transforms(_BEYOND) * _BEYOND[:, None] ** -1.5
        free = least_squares(modes[:, 2:], -np.sum(modes[:, :2] * fixed, axis=1))
        return cls(ratio, np.concatenate((fixed, free)))

    def far_factor(self, wavenumbers: FloatArray) -> FloatArray:
        """Return far(k), the blob's transform, at wavenumbers times the reach."""
        factor: FloatArray = np.sum(_transforms(wavenumbers) * self.weights, axis=-1)
        return factor

    def polynomials(self) -> tuple[FloatArray, FloatArray]:
        """Return the coefficients of p and q in rising powers of x, each (DEGREE + 2,)."""
        # P_n(1 - 2x) = Σ_k (n over k) (n + k over k) (-x)^k.
        density = np.zeros(DEGREE + 1)
        for n, weight in enumerate(self.weights):
            for k in range(n + 1):
                density[k] += weight * (-1) ** k * math.comb(n, k) * math.comb(n + k, k)
        share = Polynomial(density).integ()
        far = 0.5 * _over_x(share).integ()
        far -= far(1.0)
        mean = 0.5 * _over_x(far.integ())
        p, q = far - mean - 0.25, 0.5 + 2 * mean - far
        return np.asarray(p.coef, np.float64), np.asarray(q.coef, np.float64)

    def profiles(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return 2πη T_t and 2πη (T_r - T_t) at 0 < x <= 1, x = r²/R²."""
        p, q = (Polynomial(coefficients) for coefficients in self.polynomials())
        c = x / (4 * self.ratio**2)
        own, g = exp1(c), -np.expm1(-c) / c
        return p(x) - 0.25 * (np.log(x) + own) + 0.25 * g, q(x) - 0.5 * g

    def on_itself(self) -> float:
        """Return 2πη T_t = 2πη T_r at zero distance."""
        p, _ = self.polynomials()
        return float(p[0]) + 0.25 - 0.5 * math.log(2 * self.ratio) + 0.25 * float(np.euler_gamma)


def _over_x(polynomial: Polynomial) -> Polynomial:
    """Return a polynomial without a constant over its variable."""
    return Polynomial(polynomial.coef[1:])
