"""Control of the rheometer: an imposed stress, an imposed shear rate, or the paper's own equation.

Each control decides the mean traction on the walls, and how their tethers hold them rigid.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from softslip.solver.geometry import UPPER, FloatArray
from softslip.solver.rheometer import Balance, printed_acceleration
from softslip.solver.state import State

RelativeSpeed = Callable[[FloatArray], float]
"""Relative speed of the walls under forces on all nodes, shape (nodes, 2)."""


class Control(Protocol):
    """What drives the walls."""

    def load(self, state: State, hold: Callable[[State], State]) -> State:
        """Return a state with the tethers that the first step starts with.

        Parameters
        ----------
        state
            Before the first step, left as it is.
        hold
            Returns a state with the tethers that hold the walls rigid.
        """
        ...

    def drive(
        self, state: State, positions: FloatArray, forces: FloatArray, speed: RelativeSpeed
    ) -> tuple[float, float]:
        """Add the traction to all other forces; return it and the stress that the packing carries.

        Parameters
        ----------
        state
            The state.
        positions
            Of all nodes, shape (nodes, 2).
        forces
            On all nodes, tethers included, shape (nodes, 2); added to.
        speed
            Costs one flow solution a call.
        """
        ...

    def held_speed(self, state: State, mean_velocity: FloatArray) -> FloatArray:
        """Return the velocity along x that each wall's tethers hold its nodes to, shape (2,).

        ``mean_velocity`` is that of the fluid, averaged over each wall's nodes.
        """
        ...

    def acceleration(self, state: State, mean_velocity: FloatArray) -> FloatArray:
        """Return d/dt of `State.wall_speed`, shape (2,)."""
        ...


@dataclass(frozen=True)
class _ExactControl(ABC):
    """Imposes its quantity at every evaluation; each wall is rigid at its own mean velocity.

    Attributes
    ----------
    balance
        Between traction and stress.
    unit
        `unit_drive` of the walls.
    """

    balance: Balance
    unit: FloatArray

    @abstractmethod
    def traction(
        self, state: State, forces: FloatArray, rest: float, speed: RelativeSpeed
    ) -> float:
        """Return f; ``rest`` is the moment M of the forces."""

    def load(self, state: State, hold: Callable[[State], State]) -> State:
        """Return the state with its walls held rigid; see `Control`."""
        return hold(state)

    def drive(
        self, state: State, positions: FloatArray, forces: FloatArray, speed: RelativeSpeed
    ) -> tuple[float, float]:
        """Add the traction; see `Control`."""
        rest = self.balance.moment(positions, forces)
        traction = self.traction(state, forces, rest, speed)
        if traction:
            _add_traction(traction, self.unit, forces[state.particle_nodes :])
        return traction, self.balance.stress(traction, rest)

    def held_speed(self, state: State, mean_velocity: FloatArray) -> FloatArray:
        """Return each wall's own mean; see `Control`."""
        return mean_velocity

    def acceleration(self, state: State, mean_velocity: FloatArray) -> FloatArray:
        """Return zeros: `State.wall_speed` is not used; see `Control`."""
        return np.zeros(2)


def _add_traction(traction: float, unit: FloatArray, forces: FloatArray) -> None:
    """Add a mean traction to the forces on the walls' nodes, shape (2 wall_nodes, 2)."""
    forces.reshape(2, -1, 2)[:, :, 0] += traction * unit


@dataclass(frozen=True)
class StressControl(_ExactControl):
    """Imposes the stress of the packing, in closed form.

    Attributes
    ----------
    stress
        σ [stress unit].
    """

    stress: float

    def traction(
        self, state: State, forces: FloatArray, rest: float, speed: RelativeSpeed
    ) -> float:
        """Return f at which the packing carries σ."""
        return self.balance.traction(self.stress, rest)


@dataclass(frozen=True)
class RateControl(_ExactControl):
    """Imposes the relative speed of the walls.

    It costs two more flow solutions: what the walls do under all other forces and under unit
    traction, which for rough walls depends on how the bumps face each other.

    Attributes
    ----------
    shear_rate
        Relative wall speed over H [1 / time unit].
    """

    shear_rate: float

    def traction(
        self, state: State, forces: FloatArray, rest: float, speed: RelativeSpeed
    ) -> float:
        """Return f at which the walls part at the imposed speed d = d_p + m f.

        d_p is the speed that all other forces cause, m the one that unit traction causes.
        """
        unit = np.zeros_like(forces)
        _add_traction(1.0, self.unit, unit[state.particle_nodes :])
        return (self.shear_rate * self.balance.box.height - speed(forces)) / speed(unit)


@dataclass(frozen=True)
class PrintedControl:
    """Drives the walls by the paper's own equation of their speeds (Sec. II B, Eq. 26).

    Attributes
    ----------
    balance
        Between traction and stress.
    stress
        σ [stress unit], wholly on the tethers of the first step.
    unit
        `unit_drive` of the walls.
    wall_spacing
        Distance of wall nodes along the wall [length unit].
    viscosity
        η.
    stiffness
        K_w.
    """

    balance: Balance
    stress: float
    unit: FloatArray
    wall_spacing: float
    viscosity: float
    stiffness: float

    def load(self, state: State, hold: Callable[[State], State]) -> State:
        """Return the state with the whole stress added to its tethers; see `Control`."""
        loaded = state.replace(state.vector.copy(), state.time, state.step)
        loaded.tether[:, :, 0] += self.stress * self.unit / self.wall_spacing
        return loaded

    def drive(
        self, state: State, positions: FloatArray, forces: FloatArray, speed: RelativeSpeed
    ) -> tuple[float, float]:
        """Add nothing: the traction is what the upper wall's tethers exert; see `Control`."""
        total = float(state.tether[UPPER, :, 0].sum())
        traction = total * self.wall_spacing / self.balance.box.length
        rest = self.balance.moment(positions, forces) - traction * self.balance.arm
        return traction, self.balance.stress(traction, rest)

    def held_speed(self, state: State, mean_velocity: FloatArray) -> FloatArray:
        """Return the speeds that Eq. 26 integrates; see `Control`."""
        return state.wall_speed

    def acceleration(self, state: State, mean_velocity: FloatArray) -> FloatArray:
        """Return what Eq. 26 gives; see `Control`."""
        return printed_acceleration(
            state.wall_speed, mean_velocity, self.balance.box, self.viscosity, self.stiffness
        )
