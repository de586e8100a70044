"""A flow with a known, smooth force density on ever finer meshes: the order of the solver in dx."""

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from softslip.config.fields import quantity
from softslip.config.sections import Hydrodynamics
from softslip.solver.geometry import Box, FloatArray
from softslip.solver.mobility import Mobility
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility, regularisation_length
from softslip.solver.splitting import best_split
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.solutions import EnclosedVortices
from softslip.studies.validation.solvent_channel import empty_channel

BOX = Box(length=0.75, height=0.5, outer_gap=0.25)
"""Box that every even number of mesh points per unit length divides, with room for near sums."""

POINTS = 33
"""Points in each direction at which velocities are compared, on no mesh line."""

EWALD_ERROR = 2e-4
"""Relative error of velocities by the Ewald sum, which no mesh size lowers."""

ORDER_ERROR = 0.05
"""Error of an order taken from rms errors at places that lie differently on each mesh."""


class Manufactured(Case):
    """Vortices in a channel under the force density that keeps them going."""

    name: ClassVar[str] = "manufactured"
    summary: ClassVar[str] = "smooth flow with a known force density on ever finer meshes"
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "order": ("1", "order of the rms error of the velocity in the mesh size"),
        "velocity": ("1", "largest error of the velocity on the finest mesh over the largest one"),
        "coarse_velocity": ("1", "the same on the coarsest mesh"),
        "finest": ("1 / length unit", "mesh points per unit length of the finest mesh"),
    }

    coarsest: int = quantity(
        64,
        symbol="1/dx",
        unit="1 / length unit",
        ge=32,
        le=256,
        multiple_of=4,
        description="Mesh points per unit length of the coarsest mesh.",
    )
    refinements: int = quantity(
        2, symbol="n", unit="1", ge=1, le=5, description="Times that the mesh size is halved."
    )

    def solve(self) -> Outcome:
        """Solve the flow on every mesh and fit the order of its error.

        Raises
        ------
        ConfigError
            When the settings make no scene.
        """
        given = empty_channel(self.fidelity)
        settings, viscosity = given.hydrodynamics, given.solvent.viscosity
        exact = EnclosedVortices(BOX.length, BOX.height, viscosity)
        meshes = [self.coarsest << n for n in range(self.refinements + 1)]
        found = [_errors(exact, settings, resolution) for resolution in meshes]
        errors = [largest for largest, _ in found]
        order = -float(np.polyfit(np.log(meshes), np.log([rms for _, rms in found]), 1)[0])
        expected = _expected(exact, settings, meshes[-1])
        return self.outcome(
            result={
                "order": order,
                "velocity": errors[-1],
                "coarse_velocity": errors[0],
                "finest": float(meshes[-1]),
            },
            reference={"order": 2.0, "velocity": 0.0, "coarse_velocity": 0.0},
            errors={"order": abs(order - 2), "velocity": errors[-1]},
            # The next term of the error lowers the order by about the error itself.
            tolerances={"order": ORDER_ERROR + errors[0], "velocity": expected},
        )


def _errors(
    exact: EnclosedVortices, settings: Hydrodynamics, resolution: int
) -> tuple[float, float]:
    """Return the largest and the rms error of the velocity on a mesh over the same of itself."""
    points = _points()
    sources = _mesh_points(resolution)
    mobility = _mobility(settings, exact.viscosity, resolution)
    found = mobility.velocities_at(points, sources, exact.force(sources) / resolution**2)
    wanted = exact.velocity(points)
    apart = found - wanted
    largest = np.abs(apart).max() / np.abs(wanted).max()
    return float(largest), float(np.linalg.norm(apart) / np.linalg.norm(wanted))


def _points() -> FloatArray:
    """Return points all over the channel at irregular places between mesh lines, (points, 2)."""
    rows = np.arange(POINTS**2)
    # The additive recurrence of the plastic number fills a square evenly.
    places = np.mod(0.5 + np.outer(rows, (0.7548776662466927, 0.5698402909980532)), 1.0)
    return places * (BOX.length, BOX.height)


def _mesh_points(resolution: int) -> FloatArray:
    """Return the mesh points within the channel, where alone a force acts, shape (points, 2)."""
    x, y = (np.arange(round(side * resolution)) / resolution for side in (BOX.length, BOX.height))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


def _regularisation(settings: Hydrodynamics, resolution: int) -> float:
    if settings.regularisation is None:
        return regularisation_length(1.0 / resolution, settings.symbol)
    return settings.regularisation / resolution


def _mobility(settings: Hydrodynamics, viscosity: float, resolution: int) -> Mobility:
    """Return the level's mobility on a mesh, with its nodes on the mesh points."""
    if settings.mobility == "grid":
        return GridMobility(BOX, resolution, viscosity, settings.symbol)
    split = best_split(settings.regularisation or 1.0, 1.0) / resolution
    return EwaldMobility(BOX, _regularisation(settings, resolution), viscosity, split)


def _expected(exact: EnclosedVortices, settings: Hydrodynamics, resolution: int) -> float:
    """Return the error to expect on a mesh: twice the terms of second order, and the sum's own.

    Regularised forces cause the velocity u + ε²∇²u, to that order. What a small ε leaves of the
    waves of the mesh in the force f is some dx² f e^{-(2πε/dx)²}/4π²η in either direction.
    """
    points, mesh_size = _points(), 1.0 / resolution
    epsilon = _regularisation(settings, resolution)
    curved = epsilon**2 * np.abs(exact.laplacian(points)).max()
    wave = 2 * math.pi / mesh_size
    lumpy = 4 * np.abs(exact.force(points)).max() / exact.viscosity / wave**2
    lumpy *= math.exp(-((wave * epsilon) ** 2))
    return float(2 * (curved + lumpy) / np.abs(exact.velocity(points)).max() + EWALD_ERROR)
