"""The state of a run: all that is needed to resume it, and nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Self

import numpy as np

from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.stepper_memory import Memory


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
    memory
        What the stepper remembers.
    """

    vector: FloatArray
    particle_nodes: int
    wall_nodes: int
    time: float = 0.0
    step: int = 0
    memory: Memory = field(default_factory=lambda: Memory.start(0.0))

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
    def parts(self) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
        """All of the state and of the stepper's memory, as `PARTS` declares it."""
        values = vars(self) | vars(self.memory)
        return {name: np.asarray(values[name], dtype) for name, dtype in PARTS.items()}

    @classmethod
    def of_parts(cls, parts: Mapping[str, np.ndarray[Any, np.dtype[Any]]]) -> Self:
        """Return the state that has these `parts`."""
        values: dict[str, Any] = {
            name: part if part.ndim else part.item() for name, part in parts.items()
        }
        memory = Memory(**{each.name: values.pop(each.name) for each in fields(Memory)})
        return cls(**values, memory=memory)

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

    def located(self, component: int) -> tuple[str, int]:
        """Return the name of the array that a component of the vector is in, and its row there.

        Raises
        ------
        IndexError
            When there is no such component.
        """
        first = 0
        for name in ("node_position", "tether", "wall_displacement", "wall_speed"):
            array = getattr(self, name)
            if component < first + array.size:
                return name, (component - first) // (1 if array.ndim == 1 else 2)
            first += array.size
        raise IndexError(f"A state of {first} numbers has none with index {component}.")


PARTS = {
    each.name: np.dtype(np.int64 if each.type is int else np.float64)
    for each in (*fields(State), *fields(Memory))
    if each.type is not Memory
}
"""Numbers and arrays of a `State` and of its stepper's memory, with their types."""
