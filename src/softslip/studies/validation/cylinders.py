"""Flow through a square array of rigid cylinders: the drag on rings of regularised forces."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.errors import NumericalError
from softslip.simulation.assembly import regularisation_of
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import Box, FloatArray, IntArray, Layout
from softslip.solver.mobility import Mobility
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility
from softslip.solver.mobility.quadrature import CorrectedQuadrature
from softslip.solver.splitting import EWALD_REACH, best_split
from softslip.studies.boxes import MEAN_RADIUS
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.lattice import array_drag
from softslip.studies.validation.ring_radius import hydrodynamic_radius, mesh_lag
from softslip.studies.validation.single_particle import unit_circle
from softslip.studies.validation.solvent_channel import empty_channel

RESIDUAL = 1e-6
"""Relative residual of the velocities at which the forces count as found: as small as the errors
of the kernel's table, and smaller in their sum."""


class Cylinders(Case):
    """Rigid cylinders in a square array, pushed through the fluid along a side."""

    name: ClassVar[str] = "cylinders"
    summary: ClassVar[str] = "drag on a square array of rigid cylinders"
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "drag": ("1", "drag per length F/(ηU), U the superficial velocity"),
        "bare_drag": ("1", "drag, compared with that of the rings themselves"),
        "period": ("length unit", "distance between the cylinders"),
        "radius": ("length unit", "radius of the rings of nodes"),
        "hydrodynamic_radius": ("length unit", "radius that the rings seem to have to the flow"),
        "iterations": ("1", "evaluations of the mobility"),
    }

    concentration: float = quantity(
        0.1, symbol="c", unit="1", ge=0.01, le=0.6, description="Area fraction of the cylinders."
    )
    radius: float = quantity(
        MEAN_RADIUS,
        symbol="a",
        unit="length unit",
        ge=16 * REFERENCE_MESH_SIZE,
        le=256 * REFERENCE_MESH_SIZE,
        description="Radius of a cylinder; the nearest that makes a period of whole mesh cells is "
        "taken.",
    )

    def solve(self) -> Outcome:
        """Find the forces that move every node at the same velocity and add them up.

        Raises
        ------
        ConfigError
            When the settings make no scene.
        NumericalError
            When no such forces are found.
        """
        array = _Array.of(self)
        drag, iterations = array.drag()
        effective = array.hydrodynamic_radius()
        wanted = array_drag(math.pi * (effective / array.period) ** 2)
        bare = array_drag(self.concentration)
        return self.outcome(
            result={
                "drag": drag,
                "bare_drag": drag,
                "period": array.period,
                "radius": array.radius,
                "hydrodynamic_radius": effective,
                "iterations": float(iterations),
            },
            reference={"drag": wanted, "bare_drag": bare},
            errors={"drag": abs(drag / wanted - 1), "bare_drag": abs(drag / bare - 1)},
            tolerances={"drag": 0.01, "bare_drag": 1.5 * (wanted / bare - 1) + 0.01},
        )


@dataclass(frozen=True)
class _Array:
    """One cylinder of the array in its periodic box, with the numerical settings."""

    given: Parameters
    period: float
    radius: float

    @classmethod
    def of(cls, case: Cylinders) -> "_Array":
        given = empty_channel(case.fidelity)
        resolution = given.hydrodynamics.resolution
        # An even number of cells: the cylinder stands on a mesh point, as symmetric as the mesh.
        cells = 2 * round(0.5 * case.radius * math.sqrt(math.pi / case.concentration) * resolution)
        period = cells / resolution
        radius = period * math.sqrt(case.concentration / math.pi)
        return cls(given, period, radius)

    @property
    def mesh_size(self) -> float:
        return 1.0 / self.given.hydrodynamics.resolution

    def hydrodynamic_radius(self) -> float:
        """Return the radius that the ring of nodes seems to have to the flow [length unit]."""
        if self.given.hydrodynamics.mobility == "grid":
            # The Gaussian whose E|ξ| is that of the mesh.
            equivalent = 0.5 * math.sqrt(math.pi) * mesh_lag() * self.mesh_size
            return hydrodynamic_radius(self.radius, equivalent)
        return hydrodynamic_radius(self.radius, regularisation_of(self.given))

    def drag(self) -> tuple[float, int]:
        """Return F/(ηU) and how many evaluations of the mobility it took."""
        positions, layout = self._ring()
        mobility = self._mobility(layout)
        wanted = np.zeros_like(positions)
        wanted[:, 0] = 1.0
        count = 0

        def respond(forces: FloatArray) -> FloatArray:
            nonlocal count
            count += 1
            return mobility.velocities(positions, forces.reshape(-1, 2)).ravel()

        size = wanted.size
        operator = LinearOperator((size, size), matvec=respond, dtype=np.float64)
        forces, missed = gmres(operator, wanted.ravel(), rtol=RESIDUAL, restart=size, maxiter=1)
        if missed:
            raise NumericalError(
                "forces", 0, 0, "do not move all nodes alike; use more nodes or a larger radius"
            )
        return float(forces[::2].sum()) / self.given.solvent.viscosity, count

    def _ring(self) -> tuple[FloatArray, "_Ring"]:
        """Return the nodes about the middle of the channel, shape (nodes, 2), and their layout."""
        spacing = self.given.hydrodynamics.node_spacing * self.mesh_size
        count = round(2 * math.pi * self.radius / spacing)
        middle = np.array([0.5 * self.period, 0.5 * self._box.height])
        positions = middle + self.radius * unit_circle(count)
        arc = 2 * math.pi * self.radius / count
        offsets = np.array([0, count], np.int64)
        return positions, _Ring(offsets, np.array([arc]), np.empty((2, 0, 2)), arc)

    @property
    def _box(self) -> Box:
        """The periodic box as a channel that ends where the cylinder does."""
        return Box(self.period, 2 * self.radius, self.period - 2 * self.radius)

    def _mobility(self, layout: Layout) -> Mobility:
        """Return the level's mobility, with a near sum that finds room between the cylinders."""
        settings, box = self.given.hydrodynamics, self._box
        viscosity = self.given.solvent.viscosity
        if settings.mobility == "grid":
            return GridMobility(box, settings.resolution, viscosity, settings.symbol)
        epsilon = regularisation_of(self.given)
        best = best_split(settings.regularisation or 1.0, settings.node_spacing) * self.mesh_size
        room = min(box.outer_gap, box.length / 3) / EWALD_REACH
        plain = EwaldMobility(box, epsilon, viscosity, min(best, room))
        if settings.quadrature == "plain":
            return plain
        return CorrectedQuadrature(plain, layout, box.length, epsilon, viscosity)


class _Ring(Layout):
    """One membrane and no walls at all."""

    @cached_property
    def neighbours(self) -> tuple[IntArray, IntArray]:
        """Rows before and after every node, each (nodes,)."""
        rows = np.arange(self.nodes)
        return np.roll(rows, 1), np.roll(rows, -1)
