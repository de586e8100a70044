"""The regularised delta function of the immersed-boundary method (Eq. 16; Yang et al. 2009).

In units of the mesh size and for a point at distance ``r`` in [-1/2, 1/2] from its nearest mesh
line, the five branches of Eq. 16 share one square root and one arcsine,

    q = [r √(2 - 4 r²) + arcsin(√2 r)] / 8,

and the five weights become polynomials in r and q. They sum to 1 and have zero first moment
identically, whatever q is.
"""

import math

from softslip.solver.compilation import compiled
from softslip.solver.geometry import FloatArray

SUPPORT = 5
"""Mesh lines under the kernel in one direction."""

SECOND_MOMENT = 0.6073
"""Mean second moment m₂ of the kernel per axis [mesh size squared]; ε² = m₂ dx² (design §2.1)."""

_CENTRE = 3.0 / 8.0 + math.pi / 32.0
_OUTER = 1.0 / 16.0 - math.pi / 64.0


@compiled
def kernel_weights(coordinate: float, weights: FloatArray) -> int:
    """Fill the five weights of a point and return the first mesh line they belong to.

    Parameters
    ----------
    coordinate
        Position in units of the mesh size.
    weights
        Output, shape (5,): φ(coordinate - line) of five neighbouring lines.
    """
    nearest = math.floor(coordinate + 0.5)
    r = coordinate - nearest
    q = (r * math.sqrt(2.0 - 4.0 * r * r) + math.asin(math.sqrt(2.0) * r)) / 8.0
    even = _OUTER + r * r / 8.0
    weights[0] = even - r / 4.0 + q / 2.0
    weights[1] = 0.25 - q
    weights[2] = _CENTRE - r * r / 4.0
    weights[3] = 0.25 + q
    weights[4] = even + r / 4.0 - q / 2.0
    return int(nearest) - 2


@compiled
def difference_weights(weights: FloatArray, differences: FloatArray) -> None:
    """Fill the wide central difference (Eq. 9) of five weights, shape (7,), times the mesh size.

    Entry j belongs to the mesh line one below the first of ``weights`` plus j.
    """
    differences[0] = 0.5 * weights[0]
    differences[1] = 0.5 * weights[1]
    for j in range(3):
        differences[j + 2] = 0.5 * (weights[j + 2] - weights[j])
    differences[5] = -0.5 * weights[3]
    differences[6] = -0.5 * weights[4]
