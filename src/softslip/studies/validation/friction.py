"""Bodies in contact that slide: the grip that rows of contact points have on one another."""

import math
from typing import ClassVar, Literal

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.solver.films import REFERENCE_MESH_SIZE, contact_strength
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.neighbours import find_pairs
from softslip.solver.steric import ContactForces
from softslip.studies.boxes import MEAN_RADIUS as RADIUS
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.single_particle import unit_circle
from softslip.studies.validation.solvent_channel import empty_channel

LENGTH = 0.125
"""Period of the sheets [length unit]."""

LIMIT = 1e-2
"""Acceptable friction coefficient: the solvent in the films drags more than that."""


class Friction(Case):
    """Two sheets, or two circles, a film apart, of which one slides past the other.

    Contact forces are central between points, so that smooth bodies would slide without any
    tangential force; rows of points interlock like gears.
    """

    name: ClassVar[str] = "friction"
    summary: ClassVar[str] = "False friction of two bodies in contact, from points too far apart."
    units: ClassVar[dict[str, tuple[str, str]]] = {
        "friction": ("1", "largest tangential force over the mean normal force"),
        "ripple": ("1", "range of the normal force over its mean"),
        "point_spacing": ("1", "distance of contact points over the paper's mesh size"),
    }

    shape: Literal["sheets", "circles"] = quantity(
        "sheets", symbol="shape", unit="1", description="Flat sheets, or circles that turn."
    )
    separation: float = quantity(
        0.77,
        symbol="h/σ_LJ",
        unit="1",
        ge=0.3,
        lt=1,
        description="Thickness of the film between the bodies over the contact range.",
    )
    node_spacing: float | None = quantity(
        None,
        symbol="Δs/dx",
        unit="1",
        ge=0.5,
        le=16,
        description="Distance of nodes over the paper's mesh size; null takes the level's.",
    )
    refinement: int | None = quantity(
        None,
        symbol="m",
        unit="1",
        ge=1,
        le=8,
        description="Contact points per node; null takes the level's.",
    )
    offsets: int = quantity(
        16, symbol="n", unit="1", ge=4, le=1000, description="Positions in one node spacing."
    )

    def solve(self) -> Outcome:
        """Slide one body past the other by a node spacing, and look at its force."""
        parameters = self._parameters()
        spacing = self.node_spacing or parameters.hydrodynamics.node_spacing
        film = self.separation * parameters.steric.length
        bodies = _Sheets if self.shape == "sheets" else _Circles
        pair = bodies(parameters, spacing * REFERENCE_MESH_SIZE, film)
        found = np.array([pair.force(step / self.offsets) for step in range(self.offsets)])
        tangential, normal = found.T / abs(found[:, 1].mean())
        friction = float(np.abs(tangential).max())
        return self.outcome(
            {
                "friction": friction,
                "ripple": float(np.ptp(normal)),
                "point_spacing": spacing / parameters.steric.refinement,
            },
            {"friction": 0.0, "ripple": 0.0},
            {"friction": friction},
            {"friction": LIMIT},
        )

    def _parameters(self) -> Parameters:
        """Return parameters with the level's contact points, in a box that none of them reads."""
        steric = {} if self.refinement is None else {"refinement": self.refinement}
        box = {"length": LENGTH, "height": 0.125, "outer_gap": 0.03125}
        return empty_channel(self.fidelity, channel=box, steric=steric)


class _Sheets:
    """Two flat sheets, each a row of contact points: on a line these are equally spaced."""

    def __init__(self, parameters: Parameters, spacing: float, film: float) -> None:
        self._steric, self._film = parameters.steric, film
        self._count = round(LENGTH / spacing) * self._steric.refinement
        self._strength = contact_strength(self._steric.energy, self._steric.reading)
        self._body = np.repeat([0, 1], self._count)

    def force(self, offset: float) -> FloatArray:
        """Return tangential and normal force, the upper sheet moved by a part of a node spacing."""
        apart, reach = LENGTH / self._count, self._steric.length
        moved = np.array([0.0, offset * self._steric.refinement * apart])
        along = (np.arange(self._count) * apart + moved[:, None]).ravel()
        positions = np.column_stack((along, self._film * self._body))
        listed = find_pairs(positions, self._body, 2, LENGTH, reach)
        forces, weights = np.zeros_like(positions), np.full(len(positions), apart)
        sheets = self._count * np.arange(3)
        contacts = ContactForces(sheets, weights, LENGTH, reach, self._strength)
        contacts.add(positions, listed, forces)
        total: FloatArray = forces[self._count :].sum(axis=0)
        return total


class _Circles:
    """Two circles one above the other, of which the upper turns; the walls are far away."""

    def __init__(self, parameters: Parameters, spacing: float, film: float) -> None:
        self._count = round(2 * math.pi * RADIUS / spacing)
        self._centres = np.array([[0.5 * LENGTH, -RADIUS], [0.5 * LENGTH, RADIUS + film]])
        along = np.arange(8) * (LENGTH / 8)
        self._walls = np.stack([np.column_stack((along, np.full(8, y))) for y in (-1.0, 1.0)])
        offsets = self._count * np.arange(3, dtype=np.int64)
        weights = np.full(2, 2 * math.pi * RADIUS / self._count)
        layout = Layout(offsets, weights, self._walls, LENGTH / 8)
        self._contacts = assembly.contacts_of(parameters, layout)

    def force(self, offset: float) -> FloatArray:
        """Return torque over radius, and force along the line of centres, of the upper circle."""
        rings = [
            centre + RADIUS * unit_circle(self._count, turned)
            for centre, turned in zip(self._centres, (0.0, offset), strict=True)
        ]
        positions = np.concatenate((*rings, *self._walls))
        forces = np.zeros_like(positions)
        self._contacts.add_forces(positions, forces)
        own = slice(self._count, 2 * self._count)
        arm, force = rings[1] - self._centres[1], forces[own]
        torque = np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])
        return np.array([torque / RADIUS, force[:, 1].sum()])
