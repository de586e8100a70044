"""The Stokes solver in single precision, to see what that does to a run and what it saves."""

from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.errors import ConfigError
from softslip.simulation import assembly
from softslip.simulation.assembly import regularisation_of, split_length_of
from softslip.simulation.sample import channel_box
from softslip.solver.geometry import Layout
from softslip.solver.mobility.ewald import EwaldMobility, respond
from softslip.solver.mobility.transform import PaddedTransform
from softslip.solver.mobility.window import WIDTH
from softslip.studies import scenes


class SinglePrecision(EwaldMobility):
    """The Ewald sum with 24-bit numbers on its mesh.

    The mesh and its modes, which are transformed, are what takes memory. Positions stay in double
    precision, as 24 bits of them would cost films their thickness, and so do the weights of the
    window and the near sum.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._single = PaddedTransform(*self.shape, WIDTH, np.complex64)
        self._straight = self._straight.astype(np.float32)
        self._crossed = self._crossed.astype(np.complex64)

    def _solve(self) -> None:
        self._single.mesh[:] = self._transform.mesh
        self._single.forward()
        respond(self._single.modes, self._straight, self._crossed)
        self._single.backward()
        self._transform.mesh[:] = self._single.mesh


def single_solver(parameters: Parameters, layout: Layout) -> SinglePrecision:
    """Return the Stokes solver of a run in single precision; see `simulation.assembly.solver_of`.

    Raises
    ------
    ConfigError
        For the mesh scheme, which there is in double precision only.
    """
    hydrodynamics = parameters.hydrodynamics
    if hydrodynamics.mobility == "grid":
        raise ConfigError(
            "precision",
            "single",
            "is not for the mesh of hydrodynamics.mobility 'grid'",
            "use a level whose mobility is 'ewald'",
        )
    return SinglePrecision(
        channel_box(parameters),
        regularisation_of(parameters),
        parameters.solvent.viscosity,
        split_length_of(parameters),
        rigid=layout.wall_reference.reshape(-1, 2),
    )


def in_single_precision(scene: scenes.Scene) -> scenes.Scene:
    """Return the same state with a Stokes solver of single precision.

    Raises
    ------
    ConfigError
        For the mesh scheme.
    """
    given = scene.parameters
    solver = single_solver(given, scene.layout)
    suspension = assembly.assemble_around(
        solver, given, scene.layout, stress=given.rheometer.stress
    )
    return scenes.Scene(given, scene.layout, suspension, scene.state)
