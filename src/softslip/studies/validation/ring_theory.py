"""Linear theory of a membrane near the circle, in fluid at rest.

Nodes X = (a + w) e_r + v e_θ of a circle of radius a whose rest perimeter is 2πa/λ₀, so that it is
under the tension T₀ = K_e(λ₀ - 1); w = W cos nα and v = V sin nα are small. The part of the
membrane force along the membrane's own normal that is constant only changes the pressure inside;
what is left of it, per unit length of the circle, has the components p cos nα and q sin nα with

    p = -[K_e λ₀ (W + nV) + T₀ (n² - 1) W]/a²,    q = -K_e λ₀ n (W + nV)/a².

Forces (p, q) move the circle, with matched viscosities, at

    (P, Q) = a/(4η(n² - 1)) [[n, -1], [-1, n]] (p, q),

as one finds by writing the single layer in z = a e^{iα}, where r̂² is -zz'/a². The product of both
matrices is triangular, and its eigenvalues are

    n T₀/(4ηa)   with V = -W/n, a deformation without stretch (the slow mode),
    n K_e λ₀/(4ηa)   with W = 0, a stretch without deformation (the fast mode).

Without a tension at rest, the slow mode does not decay at all. In the solver forces act on the
fluid over the regularisation length ε: its own linear theory has the integrals of `Ring.response`.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import jv, jvp

from softslip.solver.geometry import FloatArray

DECAYED = 7.0
"""Argument εk beyond which e^{-ε²k²} counts as zero."""

SAMPLES_PER_WAVE = 16
"""Points of the integrals of Bessel functions for each of their half-waves."""


@dataclass(frozen=True)
class Ring:
    """Linear theory of a membrane near the circle.

    Attributes
    ----------
    radius, stretch, mode
        a, λ₀ and n ≥ 2.
    regularisation
        ε of the fluid's response; 0 is the theory of a sharp membrane.
    """

    radius: float
    stretch: float
    mode: int
    regularisation: float = 0.0

    def response(self) -> FloatArray:
        """Return the matrix from (p, q) to (P, Q), η = 1, shape (2, 2).

        With ε it is that of the streamfunction ψ_k = e^{-ε²k²} (n p J_n - k a q J_n')/k⁴ of the
        ring of forces, by Hankel transforms, with J_n = J_n(ka).
        """
        n, a = self.mode, self.radius
        if self.regularisation == 0:
            return a / (4 * (n * n - 1)) * np.array([[n, -1.0], [-1.0, n]])
        end = DECAYED * a / self.regularisation
        count = math.ceil(end / math.pi) * SAMPLES_PER_WAVE
        nodes, weights = np.polynomial.legendre.leggauss(SAMPLES_PER_WAVE)
        edges = np.linspace(0.0, end, count // SAMPLES_PER_WAVE + 1)
        half = 0.5 * np.diff(edges)[:, None]
        x = (edges[:-1, None] + half * (1 + nodes)).ravel()
        weight = (half * weights).ravel() * np.exp(-((self.regularisation * x / a) ** 2))
        bessel, slope = jv(n, x), jvp(n, x)
        radial = np.sum(weight * (n * bessel) ** 2 / x**3)
        mixed = -np.sum(weight * n * bessel * slope / x**2)
        along = np.sum(weight * slope**2 / x)
        return a * np.array([[radial, mixed], [mixed, along]])

    def forces(self) -> FloatArray:
        """Return the matrix from (W, V) to (p, q), K_e = 1, shape (2, 2)."""
        n, tension = self.mode, self.stretch - 1
        stretching = self.stretch * np.array([[1.0, n], [n, n * n]])
        straightening = tension * np.array([[n * n - 1.0, 0.0], [0.0, 0.0]])
        return -(stretching + straightening) / self.radius**2

    def modes(self) -> tuple[FloatArray, FloatArray]:
        """Return both decay rates, the slow one first, and (W, V) of both as columns."""
        rates, columns = np.linalg.eig(-self.response() @ self.forces())
        order = np.argsort(rates.real)
        return rates.real[order], columns.real[:, order]
