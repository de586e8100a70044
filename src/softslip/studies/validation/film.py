"""Two parallel sheets that slide past each other: how thin a film seems to the solver."""

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.assembly import regularisation_of, split_length_of
from softslip.simulation.sample import channel_box
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import LOWER, UPPER, Layout
from softslip.solver.mobility import Mobility
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.outside import StillOutside
from softslip.solver.rheometer import relative_speed
from softslip.solver.splitting import EWALD_REACH
from softslip.studies.boxes import MEAN_RADIUS
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.single_particle import layout_of_circles
from softslip.studies.validation.solvent_channel import empty_channel, exact_sheets

GAP = 1 / 64
"""Solvent outside the sheets, which is still [length unit]."""

EWALD_ERROR = 2e-4
"""Error of the Ewald sum over the velocity that a sheet alone would cause across its reach."""


ROUNDING = 1e-6
"""Relative error that is left on the mesh: nodes at 1.42 dx, seen through the kernel."""


HARMONICS = 100
"""Waves of the node spacing that are counted."""


class Film(Case):
    """Two parallel sheets under opposite tractions, a contact film apart."""

    name: ClassVar[str] = "film"
    summary: ClassVar[str] = "thin film between two parallel sheets that slide past each other"
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "film": ("length unit", "effective film thickness, relative speed times η/σ"),
        "thinning": ("1", "share of the film that the regularisation takes away"),
        "thickness": ("length unit", "distance between the sheets"),
    }

    thickness: float = quantity(
        0.75,
        symbol="h/σ_LJ",
        unit="1",
        gt=0,
        le=100,
        description="Distance between the sheets over the contact range of 9 reference mesh sizes.",
    )
    regularisation: float | None = quantity(
        None,
        symbol="ε/dx",
        unit="1",
        gt=0,
        le=8,
        description="Regularisation length over the reference mesh size; null takes the level's.",
    )

    def solve(self) -> Outcome:
        """Put the sheets under tractions ±1 and compare their relative speed.

        Raises
        ------
        ConfigError
            When the settings make no scene.
        """
        given = self.settings()
        height, viscosity = given.channel.height, given.solvent.viscosity
        layout = layout_of_circles(given, MEAN_RADIUS)
        mobility = StillOutside(_mobility(given, layout), channel_box(given), viscosity)
        forces = np.zeros((layout.nodes, 2))
        for wall, traction in ((LOWER, -1.0), (UPPER, 1.0)):
            forces[layout.wall_rows(wall), 0] = traction * layout.wall_spacing
        moved = mobility.velocities(layout.wall_reference.reshape(-1, 2), forces)[:, 0]
        film = viscosity * relative_speed(moved.reshape(2, -1))
        exact = exact_sheets(given).film
        return self.outcome(
            result={"film": film, "thinning": 1 - film / height, "thickness": height},
            reference={"film": exact, "thinning": 1 - exact / height},
            errors={"film": abs(film / exact - 1)},
            tolerances={"film": _tolerance(given, exact)},
        )

    def settings(self) -> Parameters:
        """Return the product's parameters of this scene.

        Raises
        ------
        ConfigError
            When they contradict each other.
        """
        height = 9 * REFERENCE_MESH_SIZE * self.thickness
        cells = math.ceil((height + GAP) / REFERENCE_MESH_SIZE)
        own = {} if self.regularisation is None else {"regularisation": self.regularisation}
        return empty_channel(
            self.fidelity,
            channel={"height": height, "outer_gap": cells * REFERENCE_MESH_SIZE - height},
            hydrodynamics=own,
        )


def _mobility(given: Parameters, layout: Layout) -> Mobility:
    """Return the level's mobility; the sheets may be within each other's near sum."""
    if given.hydrodynamics.mobility == "grid":
        return assembly.mobility_of(given, layout)
    epsilon, viscosity = regularisation_of(given), given.solvent.viscosity
    solver = EwaldMobility(channel_box(given), epsilon, viscosity, split_length_of(given))
    return assembly.mobility_of(given, layout, solver)


def _tolerance(given: Parameters, film: float) -> float:
    """Return the relative error that is left beside the regularisation.

    The nodes of one sheet make the other feel waves of their spacing Δs, which decay as e^{-qh},
    q = 2πm/Δs: at most Σ_m (1 + qh) e^{-qh}/q of the film. The Ewald sum errs by `EWALD_ERROR` of
    what a sheet does over the sum's reach.
    """
    hydrodynamics, height = given.hydrodynamics, given.channel.height
    q = 2 * np.pi * hydrodynamics.resolution / hydrodynamics.node_spacing * np.arange(1, HARMONICS)
    waves = float(np.sum((1 + q * height) * np.exp(-q * height) / q))
    if hydrodynamics.mobility == "grid":
        return ROUNDING + waves / film
    return (waves + EWALD_ERROR * EWALD_REACH * split_length_of(given)) / film
