"""Order of accuracy of the solver, on two particles that collide between walls."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from softslip.config.fields import quantity
from softslip.config.parameters import Parameters
from softslip.errors import NumericalError
from softslip.simulation.assembly import regularisation_of
from softslip.solver.geometry import FloatArray
from softslip.solver.splitting import SPLIT_OVER_SPACING
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation
from softslip.studies.boxes import CELL, outer_gap
from softslip.studies.boxes import MEAN_RADIUS as RADIUS
from softslip.studies.membrane_nodes import interpolation
from softslip.studies.scenes import Scene, advance_to, at_rest
from softslip.studies.validation.case import Case, Outcome
from softslip.studies.validation.single_particle import layout_of_circles, unit_circle
from softslip.studies.validation.solvent_channel import level_of

LENGTH, HEIGHT = 5 * CELL, 4 * CELL
"""L_x and H [length unit], nine and seven radii."""

SHEAR_RATE = 6.0
"""Relative wall speed over H [1 / time unit]: the capillary number is 0.05."""

FILM, ANGLE = 0.7, math.radians(45)
"""Film between the circles at the start [contact range], and angle of the line through their
centres to the flow, against which the shear turns it. Particles that start farther apart never
touch: two soft ones pass each other on a film of solvent thicker than the contact range."""

STRAIN = 1.2
"""Shear γ̇t at which positions are compared: the particles press on each other all the while."""

LOOSEST = 0.1
"""Tolerance at which no error estimate shortens a step, the largest there is."""

FINE_STEP = 1e-3
"""Step of 'rkc2' where something else is refined [time unit]; its error is common to all levels."""

ORDERS: Mapping[str, float] = {
    "euler": 1.0,
    "rkc2": 2.0,
    "imex_rkc2": 2.0,
    "node_spacing": 2.0,
    "regularisation": 1.0,
    "resolution": 1.0,
}
"""What is expected. Of the time steppers, their own order. Of the nodes, that of a sum over the
contact force, whose slope jumps at its range; this jump is so small that more than twice the order
is seen until positions agree to 1e-7 of a radius. Of ε and of the mesh, the first: films shear as
if they were thinner by E|ξ|, which is proportional to both."""

COARSEST: Mapping[str, float] = {
    "euler": 2e-3,
    "rkc2": 2e-3,
    "imex_rkc2": 2e-3,
    "node_spacing": 6.0,
    "regularisation": 0.8,
    "resolution": 2048,
}
"""Value of what is refined in the first level: time units, mesh sizes, and 1/dx. From these steps
on 'rkc2' takes two stages, the fewest; the constant in its error depends on their number, so that
from longer steps, which take more, it seems to lose a quarter of an order."""

TOLERANCE = 0.25
"""What may lack of the order: so much it varies between levels that still have terms of higher
order, or errors of several origins."""


@dataclass(frozen=True)
class Level:
    """Where the nodes are in the end, at one level of refinement.

    Attributes
    ----------
    size
        Step, distance between nodes, ε or dx [time or length unit].
    positions
        Of the nodes of each particle, (nodes, 2) each, not wrapped [length unit].
    film_thickness
        Smallest distance between nodes of two bodies on the way [contact range].
    evaluations
        Of the equations of motion, in each step.
    """

    size: float
    positions: tuple[FloatArray, ...]
    film_thickness: float
    evaluations: float


class Order(Case):
    """Two circles in shear, one above and behind the other, pressed together by the flow."""

    name: ClassVar[str] = "order"
    summary: ClassVar[str] = "observed order of accuracy of a collision of two particles"
    units: ClassVar[Mapping[str, tuple[str, str]]] = {
        "order": ("1", "slope of the differences of successive levels"),
        "last_order": ("1", "the same from the last two differences alone"),
        "film_thickness": ("contact range", "smallest distance of the particles on the way"),
        **{
            f"difference_{level}": (
                "radius",
                f"rms distance of the nodes of levels {level} and {level + 1} at the end",
            )
            for level in range(1, 7)
        },
        **{f"size_{level}": ("1", f"what is refined, at level {level}") for level in range(1, 8)},
        **{
            f"evaluations_{level}": ("1", f"evaluations in each step of level {level}")
            for level in range(1, 8)
        },
    }

    vary: Literal["step", "node_spacing", "regularisation", "resolution"] = quantity(
        "step",
        symbol="h",
        unit="1",
        description="What is halved from level to level: the time step, the distance between "
        "nodes, the regularisation length, or the mesh size of the paper's scheme (with nodes in "
        "proportion), which then takes the place of the level's mobility.",
    )
    integrator: Literal["euler", "rkc2", "imex_rkc2"] = quantity(
        "rkc2",
        symbol="scheme",
        unit="1",
        description="Time stepper; always with steps of one length.",
    )
    halvings: int = quantity(
        3,
        symbol="m",
        unit="1",
        ge=2,
        le=6,
        description="How often it is halved; three runs are the fewest that show an order.",
    )
    coarsest: float | None = quantity(
        None,
        symbol="h_1",
        unit="1",
        gt=0,
        description="Its value at the first level: a step in time units, distances and lengths in "
        "mesh sizes, a resolution as 1/dx; null takes the case's own.",
    )
    strain: float = quantity(
        STRAIN,
        symbol="γ",
        unit="1",
        gt=0,
        le=4,
        description="Shear γ̇t at which the positions are compared; contacts act from the start.",
    )

    def solve(self) -> Outcome:
        """Run all levels and fit the order to the differences of successive ones.

        Raises
        ------
        ConfigError
            When the settings make no scene.
        NumericalError
            When the solver stops, or something else than the wanted length limits a step.
        """
        levels = [self.level(self.parameters(n)) for n in range(self.halvings + 1)]
        differences = [apart(coarse, fine) / RADIUS for coarse, fine in itertools.pairwise(levels)]
        sizes = np.log([level.size for level in levels[:-1]])
        slopes = np.diff(np.log(differences)) / np.diff(sizes)
        observed = float(np.polyfit(sizes, np.log(differences), 1)[0])
        expected = ORDERS[self._refined]
        result = {
            "order": observed,
            "last_order": float(slopes[-1]),
            "film_thickness": min(level.film_thickness for level in levels),
            **{f"difference_{n}": value for n, value in enumerate(differences, 1)},
            **{f"size_{n}": level.size for n, level in enumerate(levels, 1)},
            **{f"evaluations_{n}": level.evaluations for n, level in enumerate(levels, 1)},
        }
        shortfall = max(0.0, expected - observed)
        return self.outcome(result, {"order": expected}, {"order": shortfall}, {"order": TOLERANCE})

    @property
    def _refined(self) -> str:
        return self.integrator if self.vary == "step" else self.vary

    @property
    def _coarsest(self) -> float:
        return self.coarsest or COARSEST[self._refined]

    def parameters(self, halvings: int) -> Parameters:
        """Return the solver's parameters after some halvings.

        Raises
        ------
        ConfigError
            When they make no scene.
        """
        value = self._coarsest / 2**halvings
        groups: dict[str, dict[str, Any]] = {
            "channel": {"length": LENGTH, "height": HEIGHT, "outer_gap": outer_gap(HEIGHT)},
            "suspension": {
                "area_fraction": 2 * math.pi * RADIUS**2 / (LENGTH * HEIGHT),
                "mean_radius": RADIUS,
                "size_ratio": 1.0,
            },
            "rheometer": {"mode": "rate", "stress": None, "shear_rate": SHEAR_RATE},
            "recording": {"bulk_margin": None},
            "hydrodynamics": {},
        }
        step = value if self.vary == "step" else FINE_STEP
        groups["time_stepping"] = {
            "integrator": self.integrator,
            "step": step,
            "longest_step": step,
            "tolerance": LOOSEST,
        }
        if self.vary == "resolution":
            groups["hydrodynamics"] = {
                "mobility": "grid",
                "quadrature": "plain",
                "node_spacing": 1.42,
                "resolution": round(self._coarsest * 2**halvings),
            }
        elif self.vary != "step":
            groups["hydrodynamics"] = {self.vary: value}
            if self.vary == "node_spacing":
                # Otherwise the split follows the spacing, and with it the Ewald sum's own error.
                groups["hydrodynamics"]["split"] = SPLIT_OVER_SPACING * self._coarsest
        return Parameters.from_mapping({"fidelity": level_of(self.fidelity), **groups})

    def level(self, parameters: Parameters) -> Level:
        """Return where the nodes are after the wanted shear."""
        scene = collision(parameters)
        films: list[float] = []

        def visit(_: State, evaluation: Evaluation) -> None:
            films.append(evaluation.film_thickness)

        step = parameters.time_stepping.step
        longest = self._coarsest if self.vary == "step" else FINE_STEP
        duration = max(round(self.strain / (SHEAR_RATE * longest)), 1) * longest
        done = advance_to(scene, np.array([duration]), visit)
        if done.state.step != round(duration / step):
            raise NumericalError(
                "step_size",
                0,
                done.state.step,
                f"something else than the wanted {step:g} has limited the steps; "
                "use another fidelity or a smaller strain",
            )
        offsets = scene.layout.offsets
        positions = np.split(done.state.node_position, offsets[1:-1])
        size = {
            "step": step,
            "node_spacing": 2 * math.pi * RADIUS / float(offsets[1]),
            "regularisation": regularisation_of(parameters),
            "resolution": 1 / parameters.hydrodynamics.resolution,
        }
        film = min(films) / parameters.steric.length
        work = done.evaluations / done.state.step
        return Level(size[self.vary], tuple(positions), film, work)


def collision(parameters: Parameters) -> Scene:
    """Return two circles at rest about to collide."""
    layout = layout_of_circles(parameters, RADIUS)
    middle = 0.5 * np.array([parameters.channel.length, parameters.channel.height])
    distance = 2 * RADIUS + FILM * parameters.steric.length
    shift = 0.5 * distance * np.array([-math.cos(ANGLE), math.sin(ANGLE)])
    centres = (middle + shift, middle - shift)
    rings = [
        centre + RADIUS * unit_circle(int(count))
        for count, centre in zip(np.diff(layout.offsets), centres, strict=True)
    ]
    return at_rest(np.concatenate(rings), layout, parameters)


def apart(coarse: Level, fine: Level) -> float:
    """Return the rms distance of the nodes of a level from the same points of a finer one.

    Between its nodes the finer membrane is the trigonometric polynomial through them.
    """
    squares = []
    for here, there in zip(coarse.positions, fine.positions, strict=True):
        difference = interpolation(len(there), len(here)) @ there - here
        # Either may have been moved by a period.
        difference[:, 0] -= LENGTH * np.round(difference[:, 0].mean() / LENGTH)
        squares.append(np.sum(difference**2, axis=1))
    return math.sqrt(float(np.concatenate(squares).mean()))
