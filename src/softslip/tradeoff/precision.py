"""A Stokes solver as it would be in single precision, to see what that does to a run."""

import numpy as np

from softslip import shear
from softslip.bench import scenes
from softslip.geometry import FloatArray
from softslip.mobility import Mobility
from softslip.mobility.ewald import EwaldMobility
from softslip.parameters import Parameters
from softslip.suspension import Suspension


class SinglePrecision:
    """A mobility that gets positions and forces, and gives velocities, of 24 bits.

    What it does in between stays in double precision: this is the least error that a solver in
    single precision can have, and says nothing about its cost.

    Parameters
    ----------
    mobility
        In double precision.
    """

    def __init__(self, mobility: Mobility) -> None:
        self._mobility = mobility

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the rounded velocities of the nodes, shape (nodes, 2); see `Mobility`."""
        return rounded(self._mobility.velocities(rounded(positions), rounded(forces)))

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        """Return the rounded velocity at any points, shape (points, 2); see `Mobility`."""
        given = rounded(positions), rounded(forces)
        return rounded(self._mobility.velocities_at(rounded(points), *given))


def rounded(values: FloatArray) -> FloatArray:
    """Return the nearest numbers of single precision, as numbers of double precision."""
    return values.astype(np.float32).astype(np.float64)


def in_single_precision(scene: scenes.Scene) -> scenes.Scene:
    """Return the same state with a Stokes solver of single precision."""
    given: Parameters = scene.parameters
    solver = shear.solver_of(given, scene.layout)
    shared = (solver.near_pairs, solver.reach) if isinstance(solver, EwaldMobility) else None
    suspension = Suspension(
        given,
        scene.layout,
        SinglePrecision(shear.mobility_of(given, scene.layout, solver)),
        stress=given.rheometer.stress,
        near_pairs=shared,
    )
    return scenes.Scene(given, scene.layout, suspension, scene.state)
