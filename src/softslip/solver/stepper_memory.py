"""What a stepper remembers from one step to the next, apart from what is compiled for its steps."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Memory:
    """What a stepper remembers from one step to the next.

    Stored with the solution, it lets a run resume bit for bit.

    Parameters
    ----------
    step_size
        Δt that the next step would like; 0 before the first step.
    spectral_radius
        Estimated spectral radius of the Jacobian of the rate [1/time]; 0 before the first estimate.
    radius_age
        Accepted steps since that estimate.
    direction
        Vector along which the rate changes fastest: where the next power iteration starts. Of size
        0 before the first estimate.
    shift
        g at which a partly implicit stepper has estimated it [time unit]; 0 for others.
    drift
        Mean velocity of the last step, for a partly implicit stepper; of size 0 for others, and
        before the first step.
    """

    step_size: float
    spectral_radius: float
    radius_age: int
    direction: Vector
    shift: float = 0.0
    drift: Vector = field(default_factory=lambda: np.empty(0))

    @classmethod
    def start(cls, step: float) -> "Memory":
        """Return the memory of a run before its first step, which is to be ``step``."""
        return cls(step_size=step, spectral_radius=0.0, radius_age=0, direction=np.empty(0))

    def older(self) -> "Memory":
        """Return the same memory after one more accepted step."""
        return replace(self, radius_age=self.radius_age + 1)
