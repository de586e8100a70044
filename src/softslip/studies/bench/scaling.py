"""How the cost of an evaluation grows with the number of particles, and where the time goes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from softslip.config.parameters import Parameters
from softslip.simulation import assembly
from softslip.simulation.assembly import regularisation_of
from softslip.solver.geometry import FloatArray, Layout
from softslip.solver.membrane import add_tension, remove_flux
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.quadrature import CorrectedQuadrature
from softslip.studies import scenes
from softslip.studies.timing import Tell, Work, alternately, silent

SIZES = (50, 100, 200, 400, 800)
"""Numbers of particles that the exponent is fitted to, up to the paper's."""

PARTS = ("spread", "fft", "gather", "near", "contact", "membrane", "quadrature", "control")
"""Of an evaluation: ``control`` is what is left, assembling forces, tethers and rates."""

NANO = 1e9


class _Still:
    """A mobility that moves nothing: what is left of one built around it is its own work."""

    def velocities(self, positions: FloatArray, forces: FloatArray) -> FloatArray:
        return np.zeros_like(positions)

    def velocities_at(
        self, points: FloatArray, positions: FloatArray, forces: FloatArray
    ) -> FloatArray:
        return np.zeros_like(points)


class EvaluationParts:
    """The parts of an evaluation on the data of a scene, one by one.

    Attributes
    ----------
    ewald
        The plain sum, which has its mesh and counts its pairs.
    layout, parameters
        Of the scene.
    velocities
        Of all nodes, shape (nodes, 2): the near part sets them, and the membranes take the flux
        out of them, again at each call.
    """

    def __init__(self, scene: scenes.Scene) -> None:
        self.parameters: Parameters = scene.parameters
        self.layout: Layout = scene.layout
        self.ewald: EwaldMobility = scenes.plain_sum(scene.parameters, scene.layout)
        self._scene = scene
        evaluation = scene.suspension.evaluate(scene.state)
        self._positions, self._forces = evaluation.positions, evaluation.forces
        # Leaves the nodes of this state in the solver's arrays.
        self.ewald.velocities(self._positions, self._forces)
        self.velocities = np.zeros_like(self._positions)
        shared = (self.ewald.near_pairs, self.ewald.reach)
        self._contacts = assembly.contacts_of(scene.parameters, scene.layout, shared)
        self._correction = CorrectedQuadrature(
            _Still(),
            scene.layout,
            scene.parameters.channel.length,
            regularisation_of(scene.parameters),
            scene.parameters.solvent.viscosity,
        )

    def works(self) -> dict[str, Work]:
        """Return the parts but ``control``, in their order, and last the whole ``evaluation``."""
        ewald = self.ewald
        return {
            "spread": lambda: ewald._spread(ewald._room),
            "fft": ewald._solve,
            "gather": lambda: ewald._gather(ewald._room),
            "near": self._near,
            "contact": lambda: self._contacts.add_forces(
                self._positions, np.zeros_like(self._forces)
            ),
            "membrane": self._membrane,
            "quadrature": lambda: self._correction.velocities(self._positions, self._forces),
            "evaluation": lambda: self._scene.suspension.evaluate(self._scene.state),
        }

    def _near(self) -> None:
        """Take the nodes, sum over their pairs, and give the velocities back."""
        ewald, room = self.ewald, self.ewald._room
        listed = ewald.near_pairs(self._positions)
        room.take(self._positions, self._forces, ewald.reach)
        ewald._near(room, listed)
        ewald._give(room, self._forces, self.velocities)

    def _membrane(self) -> None:
        given, layout = self.parameters.membrane, self.layout
        forces = np.zeros_like(self._forces)
        add_tension(
            self._positions,
            layout.offsets,
            layout.spacing,
            given.elastic_constant,
            given.order,
            forces,
        )
        remove_flux(
            self._positions,
            layout.offsets,
            given.order,
            given.area_restoring,
            layout.reference_area,
            self.velocities[: layout.particle_nodes],
        )


def bench_scaling(
    sizes: Sequence[int] = SIZES,
    fidelity: str = "paper",
    *,
    ageing: float = scenes.AGEING,
    shearing: float = scenes.SHEARING,
    budget: float = 3.0,
    tell: Tell = silent,
) -> dict[str, Any]:
    """Time an evaluation of the equations of motion and its parts in sheared packings of N.

    Repeated evaluations of one state build no lists of pairs. What they cost, and what
    the stepper and its guards do between evaluations, is part of ``running``.

    Parameters
    ----------
    sizes
        Numbers of particles N, ascending.
    fidelity
        Level.
    ageing, shearing
        Times at rest and under stress before anything is measured [time unit].
    budget
        Time for the repeats at each size [s].

    Returns
    -------
    dict
        For each of ``particles``: ``nodes``, ``pairs``, mesh ``points``, ``seconds`` an
        evaluation, ``running`` core-seconds an evaluation while it was sheared, with ``steps``
        and ``evaluations`` per time unit then; ``exponent`` of seconds ~ N^exponent, absent for
        one size; and by part ``nanoseconds`` per node.

    Raises
    ------
    SoftslipError
        When there is no such scene.
    """
    rows = []
    for particles in sizes:
        tell(f"making {particles} aged and sheared particles at fidelity {fidelity}")
        scene, stretch = scenes.flowing(particles, fidelity, ageing, shearing)
        tell(f"timing the evaluation of {particles} particles and its parts")
        rows.append(_row(scene, stretch, budget))
    result = {"bench": "scaling", "fidelity": fidelity, "particles": list(sizes), **_columns(rows)}
    if len(sizes) > 1:
        result["exponent"] = fitted_exponent(sizes, result["seconds"])
    return result


def fitted_exponent(sizes: Sequence[int], seconds: Sequence[float]) -> float:
    """Return p of the least-squares line ln(seconds) = p ln(N) + constant."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def _row(scene: scenes.Scene, stretch: scenes.Stretch, budget: float) -> dict[str, Any]:
    """Return all figures of one size."""
    parts = EvaluationParts(scene)
    seconds = alternately(parts.works(), budget)
    whole = seconds.pop("evaluation")
    seconds["control"] = whole - sum(seconds.values())
    nodes, mesh = scene.layout.nodes, parts.ewald.shape
    return {
        "nodes": nodes,
        "pairs": parts.ewald.pairs,
        "points": mesh[0] * mesh[1],
        "seconds": whole,
        "running": stretch.core_seconds / stretch.evaluations,
        "steps": stretch.steps / stretch.duration,
        "evaluations": stretch.evaluations / stretch.duration,
        "nanoseconds": {part: NANO * seconds[part] / nodes for part in PARTS},
    }


def _columns(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Turn a list of rows into a row of lists, also within tables by part."""
    return {
        key: _columns([row[key] for row in rows])
        if isinstance(value, dict)
        else [row[key] for row in rows]
        for key, value in rows[0].items()
    }
