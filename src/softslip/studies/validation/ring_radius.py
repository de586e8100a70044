"""What size a ring of regularised forces seems to have to the flow around it."""

import math
from functools import cache

import numpy as np
from scipy.special import jv

from softslip.solver.geometry import FloatArray
from softslip.solver.kernels import SUPPORT, kernel_weights

DIRECTIONS = 16
"""Directions between mesh line and diagonal that `mesh_lag` averages over."""

HIGHEST, WAVES = 30.0, 3000
"""Highest wavenumber times dx that `mesh_lag` sums to, where the kernel is gone, and the number of
wavenumbers."""

PLACES = 100
"""Places between mesh lines at which the kernel is summed."""

DECAYED = 8.0
"""Wavenumber times ε beyond which a regularised force has no waves."""

FARTHEST = 500.0
"""Wavenumber times radius up to which waves of the Bessel functions are summed at least."""

STEP = 0.05
"""Step in wavenumber times radius, a hundredth of the Bessel functions' waves."""


def hydrodynamic_radius(radius: float, regularisation: float) -> float:
    """Return the radius a_h of the cylinder whose drag a ring of regularised forces has.

    A ring that moves as a whole, u = e_x, bears the force densities f₀ (e_x) and f₂, of the
    second harmonic (cos 2θ, sin 2θ), which the kernel couples to no other. Its velocity is
    (a/2η) (I₀₀ - I₀₂²/I₂₂) f₀ with I_mn = ∫ e^{-ε²k²} J_m(ka) J_n(ka) dk/k, and that of a cylinder
    falls with -ln a, so that

        ln(a_h/a) = ∫ (1 - e^{-ε²k²}) J₀² dk/k + I₀₂²/I₂₂ = ε/(√π a) + O(ε²/a²).

    Far from other bodies, where a cylinder is known by this number alone, it is exact; near them,
    to first order, as any surface of regularised forces lies E|ξ|/2 = ε/√π further out.

    Parameters
    ----------
    radius, regularisation
        a and ε [length unit].
    """
    ratio = regularisation / radius
    end = max(DECAYED / ratio, FARTHEST)
    count = math.ceil(end / STEP)
    k = (np.arange(count) + 0.5) * (end / count)
    rest = np.exp(-((ratio * k) ** 2)) / k
    missing, inner, outer = 1 / k - rest, jv(0, k), jv(2, k)
    # Beyond the end, J₀² = -J₀J₂ = 1/πk on average.
    own = np.mean(missing * inner**2) * end + 1 / (math.pi * end)
    # Without regularisation I₀₂ is zero: what is missing of it is all there is.
    cross = -np.mean(missing * inner * outer) * end + 1 / (math.pi * end)
    second = np.mean(rest * outer**2) * end
    return radius * math.exp(own + cross**2 / second)


@cache
def mesh_lag() -> float:
    """Return `directed_lag` averaged over directions: 0.973."""
    angles = (np.arange(DIRECTIONS) + 0.5) * (math.pi / 4 / DIRECTIONS)
    return float(np.mean([directed_lag(angle) for angle in angles]))


def directed_lag(angle: float) -> float:
    """Return E|ξ| of a sheet on the paper's mesh, over the mesh size.

    A sheet with normal n moves along itself under a traction of wavenumber k n by the kernel's
    transform, twice, and the symbols of the central difference s and of the compact Laplacian D,
    S/(ηk²) with S = k² φ̂(k_x)² φ̂(k_y)² (s·n)²/D². What S lacks of one is the lag,

        E|ξ| = (2/π) ∫ (1 - S) dk/k²,

    1.003 dx along mesh lines and 0.942 dx along diagonals.

    Parameters
    ----------
    angle
        Between the sheet and a mesh line.
    """
    k: FloatArray = (np.arange(WAVES, dtype=np.float64) + 0.5) * (HIGHEST / WAVES)
    kx: FloatArray = k * math.cos(angle)
    ky: FloatArray = k * math.sin(angle)
    curl = math.cos(angle) * np.sin(kx) + math.sin(angle) * np.sin(ky)
    laplacian = 4 * np.sin(0.5 * kx) ** 2 + 4 * np.sin(0.5 * ky) ** 2
    response = (k * curl * _transform(kx) * _transform(ky) / laplacian) ** 2
    return float(2 / math.pi * (np.mean((1 - response) / k**2) * HIGHEST + 1 / HIGHEST))


def _transform(wavenumbers: FloatArray) -> FloatArray:
    """Return the transform of the kernel φ at wavenumbers times dx, same shape."""
    weights, total = np.empty(SUPPORT), np.zeros_like(wavenumbers)
    for place in (np.arange(PLACES) + 0.5) / PLACES - 0.5:
        first = kernel_weights(place, weights)
        for line, weight in enumerate(weights, start=first):
            total += weight / PLACES * np.cos(wavenumbers * (place - line))
    return total
