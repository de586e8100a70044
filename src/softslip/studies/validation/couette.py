"""Pure solvent between flat walls under an imposed stress: the whole way through the product."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.simulation.trajectory import Advanced
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import LOWER, UPPER, FloatArray
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation, Suspension
from softslip.studies.boxes import MEAN_RADIUS
from softslip.studies.scenes import advance_to, at_rest
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.single_particle import layout_of_circles
from softslip.studies.validation.solutions import CouetteFlow as Exact
from softslip.studies.validation.solvent_channel import LENGTH, empty_channel, exact_sheets

STEPS = 5
"""First steps' lengths that the flow is followed for."""

HEIGHTS = 19
"""Number of heights of the velocity profile."""

CLEARANCE = 6.0
"""Distance of the profile from the walls over the mesh size or half the node spacing, whichever is
longer: beyond it neither the forces' own width nor their number is felt."""

EWALD_ERROR = 2e-4
"""Relative error of velocities by the Ewald sum, see `solver.mobility.ewald.EwaldMobility`."""


class Couette(Case):
    """Two flat walls that slide past each other at an imposed stress, without particles."""

    name: ClassVar[str] = "couette"
    summary: ClassVar[str] = "pure solvent between flat walls under an imposed shear stress"
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "relative_speed": ("length unit / time unit", "relative wall speed"),
        "traction": ("stress unit", "traction on the upper wall"),
        "lag": ("1", "share of the relative wall speed that the regularised walls lag behind"),
        "outer_gap": ("length unit", "solvent outside the walls, in whole mesh cells"),
        "profile": ("1", "largest error of the velocity in the channel over the wall speed"),
        "regularised_speed": ("1", "relative wall speed, with the lag in the reference"),
        "drift": ("1", "largest relative change of the wall speed in time"),
    }

    stress: float = quantity(
        0.3, symbol="σ", unit="stress unit", gt=0, description="Imposed shear stress."
    )
    channel_height: float = quantity(
        0.44,
        symbol="H",
        unit="length unit",
        ge=64 * REFERENCE_MESH_SIZE,
        le=4,
        description="Distance between the walls.",
    )
    outer_gap: float = quantity(
        0.02875,
        symbol="L_y - H",
        unit="length unit",
        ge=64 * REFERENCE_MESH_SIZE,
        le=4,
        description="Solvent outside the walls; the nearest that makes a box of whole mesh cells "
        "is taken.",
    )
    outside: Literal["still", "periodic"] = quantity(
        "still",
        symbol="τ_out",
        unit="1",
        description="Solvent outside the walls: without stress, or sheared backwards.",
    )

    def solve(self) -> Outcome:
        """Follow the flow for some steps and compare speeds, traction and profile.

        Raises
        ------
        SoftslipError
            When the settings make no scene or the solver stops.
        """
        given = self.settings()
        channel = given.channel
        exact = Exact(
            self.stress,
            given.solvent.viscosity,
            channel.height,
            channel.outer_gap,
            channel.outside,
        )
        suspension, first, advanced = _followed(given)
        last = advanced.evaluation.wall_velocity
        speed = float(last[UPPER] - last[LOWER])
        moved = advanced.state.wall_displacement
        mean = float(moved[UPPER] - moved[LOWER]) / advanced.state.time
        traction = advanced.evaluation.traction
        share = exact.traction / exact.stress
        missing = share * exact_sheets(given).lag / exact.height
        expected = exact.relative_speed * (1 - missing)
        heights = _heights(given)
        found = _profile(suspension, advanced, heights)
        wanted = exact.velocity(heights)
        return self.outcome(
            result={
                "relative_speed": speed,
                "traction": traction,
                "lag": 1 - speed / exact.relative_speed,
                "outer_gap": channel.outer_gap,
            },
            reference={
                "relative_speed": exact.relative_speed,
                "traction": exact.traction,
                "lag": missing,
            },
            errors={
                "relative_speed": abs(speed / exact.relative_speed - 1),
                "traction": abs(traction / exact.traction - 1),
                "profile": float(np.abs(found - wanted).max()) / (0.5 * exact.relative_speed),
                "regularised_speed": abs(speed / expected - 1),
                "drift": max(abs(first / speed - 1), abs(mean / speed - 1)),
            },
            tolerances={
                "relative_speed": 5e-3,
                "traction": 1e-9,  # Closed form.
                "profile": EWALD_ERROR * share,
                "regularised_speed": EWALD_ERROR * share,
                "drift": EWALD_ERROR * share,
            },
        )

    def settings(self) -> Parameters:
        """Return the product's parameters of this scene.

        Raises
        ------
        ConfigError
            When they contradict each other.
        """
        cells = round((self.channel_height + self.outer_gap) / REFERENCE_MESH_SIZE)
        gap = cells * REFERENCE_MESH_SIZE - self.channel_height
        return empty_channel(
            self.fidelity,
            channel={"height": self.channel_height, "outer_gap": gap, "outside": self.outside},
            rheometer={"stress": self.stress},
        )


def _followed(given: Parameters) -> tuple[Suspension, float, Advanced]:
    """Return the scene, the relative wall speed at the start, and where some steps lead."""
    bare = at_rest(np.empty((0, 2)), layout_of_circles(given, MEAN_RADIUS), given)
    scene = replace(bare, state=bare.suspension.load(bare.state))
    speeds: list[float] = []

    def visit(_: State, evaluation: Evaluation) -> None:
        walls = evaluation.wall_velocity
        speeds.append(float(walls[UPPER] - walls[LOWER]))

    stops = given.time_stepping.step * np.array([STEPS])
    advanced = advance_to(scene, stops, visit)
    return scene.suspension, speeds[0], advanced


def _heights(given: Parameters) -> FloatArray:
    """Return heights within the channel that are clear of the walls, shape (heights,)."""
    hydrodynamics, height = given.hydrodynamics, given.channel.height
    widest = max(1.0, 0.5 * hydrodynamics.node_spacing) / hydrodynamics.resolution
    clear = max(0.05 * height, CLEARANCE * widest)
    return np.linspace(clear, height - clear, HEIGHTS)


def _profile(suspension: Suspension, advanced: Advanced, heights: FloatArray) -> FloatArray:
    """Return the velocity along x at heights within the channel, same shape."""
    points = np.column_stack((np.full_like(heights, 0.5 * LENGTH), heights))
    velocity: FloatArray = suspension.velocities_at(points, advanced.evaluation)[:, 0]
    return velocity
