"""The three-term recurrence of Runge-Kutta-Chebyshev schemes, from the Chebyshev polynomials.

The stability polynomial of stage j is a_j + b_j T_j(w₀ + w₁ z), with w₀ > 1 for damping. Its first
three Taylor coefficients are those of e^{c_j z} with w₁ = T'_s(w₀)/T''_s(w₀),
b_j = T''_j(w₀)/T'_j(w₀)² and c_j = w₁ T''_j(w₀)/T'_j(w₀) for j ≥ 2 (Sommeijer, Shampine & Verwer
1998, J. Comput. Appl. Math. 88, 315); b₀ and b₁ are free.
"""

from collections.abc import Iterator
from dataclasses import dataclass

DAMPING = 2.0 / 13.0
"""ε: all modes but the slow ones lose at least about ε/3 a step, for 2 % of the stable step."""

MOST_STAGES = 200
"""Stages of a step at most; beyond, rounding errors grow, and the step is shortened instead."""


@dataclass(frozen=True)
class StageTerms:
    """Coefficients of last Y_{j-1} + older Y_{j-2} + Δt (rate F_{j-1} + first_rate F_0)."""

    node: float  # c_j, the time of the stage in units of Δt
    last: float
    older: float
    rate: float
    first_rate: float


class ChebyshevRecurrence:
    """The recurrence of a scheme of some number of stages s.

    Parameters
    ----------
    stages
        s, at least 2.

    Attributes
    ----------
    w0, w1
        Where the polynomials are taken, and the factor of the stiffness.
    b2
        b of the second stage, a usual choice for the first two as well.
    """

    def __init__(self, stages: int) -> None:
        self._stages = stages
        self.w0 = w0 = 1.0 + DAMPING / stages**2
        T, dT, ddT = [1.0, w0], [0.0, 1.0], [0.0, 0.0]
        for j in range(2, stages + 1):
            T.append(2.0 * w0 * T[j - 1] - T[j - 2])
            dT.append(2.0 * w0 * dT[j - 1] - dT[j - 2] + 2.0 * T[j - 1])
            ddT.append(2.0 * w0 * ddT[j - 1] - ddT[j - 2] + 4.0 * dT[j - 1])
        self.w1 = dT[stages] / ddT[stages]
        self._T = T
        self._b = [ddT[j] / dT[j] ** 2 for j in range(2, stages + 1)]
        self.b2 = self._b[0]
        # The last node is 1 by construction, but not to the last bit.
        self._nodes = [*(self.w1 * ddT[j] / dT[j] for j in range(2, stages)), 1.0]

    def stages(self, b0: float, b1: float) -> Iterator[StageTerms]:
        """Yield the coefficients of the stages from the second on."""
        b = [b0, b1, *self._b]
        for j in range(2, self._stages + 1):
            last, older = 2.0 * self.w0 * b[j] / b[j - 1], -b[j] / b[j - 2]
            share = 2.0 * self.w1 * b[j] / b[j - 1]
            first = -(1.0 - b[j - 1] * self._T[j - 1]) * share
            yield StageTerms(self._nodes[j - 2], last, older, share, first)
