"""The state of a run: all that is needed to go on, and nothing else."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from softslip.solver.geometry import FloatArray, Layout


@dataclass(frozen=True)
class State:
    """Everything that evolves, in one vector that integrators can step.

    Attributes
    ----------
    vector
        The evolving numbers, seen through the properties below.
    particle_nodes, wall_nodes
        Number of nodes on all particles together and on one wall.
    time
        Time since the stage began [time unit].
    step
        Steps since the stage began.
    step_size
        Length that the next step would like [time unit]; 0 before the first step.
    spectral_radius, radius_age, direction
        What a stabilised stepper remembers: its estimate of the fastest decay rate
        [1 / time unit], the steps since it was made, and the direction of that decay.
    """

    vector: FloatArray
    particle_nodes: int
    wall_nodes: int
    time: float = 0.0
    step: int = 0
    step_size: float = 0.0
    spectral_radius: float = 0.0
    radius_age: int = 0
    direction: FloatArray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def at_rest(cls, node_position: FloatArray, layout: Layout) -> "State":
        """Return the state of membranes at given positions between unloaded walls at rest."""
        walls = np.zeros(4 * layout.wall_nodes + 4)
        vector = np.concatenate((node_position.ravel(), walls))
        return cls(vector, layout.particle_nodes, layout.wall_nodes)

    def replace(self, vector: FloatArray, time: float, step: int) -> Self:
        """Return the same kind of state with other numbers."""
        return replace(self, vector=vector, time=time, step=step)

    def like(self, vector: FloatArray) -> "State":
        """Return a view of any vector of the same shape, such as a rate."""
        return State(vector, self.particle_nodes, self.wall_nodes, self.time, self.step)

    @property
    def node_position(self) -> FloatArray:
        """Positions of the particle nodes in the channel frame, shape (particle_nodes, 2)."""
        return self.vector[: 2 * self.particle_nodes].reshape(-1, 2)

    @property
    def tether(self) -> FloatArray:
        """Tether tractions of the wall nodes [force per length], shape (2, wall_nodes, 2)."""
        start = 2 * self.particle_nodes
        return self.vector[start : start + 4 * self.wall_nodes].reshape(2, -1, 2)

    @property
    def wall_displacement(self) -> FloatArray:
        """Displacement of each wall along x since the stage began, never wrapped, shape (2,)."""
        return self.vector[-4:-2]

    @property
    def wall_speed(self) -> FloatArray:
        """Wall speeds that the printed control integrates (Eq. 26), shape (2,); else zero."""
        return self.vector[-2:]
