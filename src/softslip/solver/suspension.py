"""The equations of motion: forces, mobility and rheometer assembled into d(state)/dt."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from softslip.config.parameters import Parameters
from softslip.errors import NumericalError
from softslip.solver import membrane, rheometer
from softslip.solver.contacts import Contacts, NoContacts
from softslip.solver.geometry import LOWER, UPPER, Box, FloatArray, Layout
from softslip.solver.integrators import Vector
from softslip.solver.mobility import Mobility
from softslip.solver.mobility.outside import StillOutside
from softslip.solver.mobility.rest import RestWithoutForce
from softslip.solver.state import State

RIGIDITY_TOLERANCE = 0.02
"""Part of the walls' deformation rate that the tethers may leave when a stage starts."""

ROUNDING = 1e-12
"""Deformation of the walls, over their speed, that counts as none: flat walls without particles
move rigidly but for rounding (1e-16 to 1e-15), which no tethers take away."""


@dataclass(frozen=True)
class Evaluation:
    """One evaluation of the equations of motion.

    Attributes
    ----------
    positions
        All nodes, walls included, shape (nodes, 2) [length unit].
    body_forces
        Membrane and contact forces on all nodes, shape (nodes, 2).
    forces
        All forces on the fluid, with tethers and the mean traction, shape (nodes, 2).
    traction
        Mean traction f on the upper wall [stress unit].
    stress
        Shear stress σ that the packing carries [stress unit].
    film_thickness
        Smallest distance between nodes of two bodies; infinite when nothing is in contact range.
    wall_velocity
        Velocity of each wall along x, shape (2,).
    rate
        d/dt of the state's vector.
    """

    positions: FloatArray
    body_forces: FloatArray
    forces: FloatArray
    traction: float
    stress: float
    film_thickness: float
    wall_velocity: FloatArray
    rate: Vector


class Suspension:
    """Membranes and contacts in Stokes flow between driven, rigid walls.

    Parameters
    ----------
    parameters
        The run's parameters.
    layout
        Its nodes.
    mobility
        Stokes solver in the run's box.
    contacts
        Between the nodes.
    box
        The run's box.
    stress
        Imposed stress σ; None imposes ``shear_rate`` instead.
    shear_rate
        Imposed relative wall speed over H.
    printed_control
        Whether the paper's own equation drives the walls.
    """

    def __init__(
        self,
        parameters: Parameters,
        layout: Layout,
        mobility: Mobility,
        contacts: Contacts | NoContacts,
        box: Box,
        *,
        stress: float | None,
        shear_rate: float | None = None,
        printed_control: bool = False,
    ) -> None:
        channel = parameters.channel
        self.box = box
        self.layout = layout
        self._parameters = parameters
        still = channel.outside == "still"
        viscosity = parameters.solvent.viscosity
        whole = StillOutside(mobility, self.box, viscosity) if still else mobility
        self._mobility = RestWithoutForce(whole)
        self._stress = stress
        self._shear_rate = shear_rate
        self._printed = printed_control
        self._contacts = contacts
        self._drive = rheometer.unit_drive(layout.wall_nodes, channel.length)
        heights = layout.wall_reference[:, :, 1].mean(axis=1)
        self._balance = rheometer.Balance(
            self.box, float(heights[UPPER] - heights[LOWER]), channel.outside == "still"
        )

    def load(self, state: State) -> State:
        """Return the state as the control wants it before the first step.

        The tethers are set to what holds the walls rigid under the forces of this instant (to
        `RIGIDITY_TOLERANCE`, or to `ROUNDING`). Left to grow at their own rate, they would let
        the solvent through the walls by traction over K_w: a good part of a contact film where
        particles press.
        The printed control begins instead as the paper does (Sec. II B), with the whole imposed
        stress added to the tethers.

        Raises
        ------
        NumericalError
            When no such tethers are found.
        """
        loaded = state.replace(state.vector.copy(), state.time, state.step)
        if self._printed and self._stress is not None:
            loaded.tether[:, :, 0] += self._stress * self._drive / self.layout.wall_spacing
            return loaded
        given = self.evaluate(loaded)
        bare = state.like(given.rate).tether.ravel()
        speed = self._parameters.wall.stiffness * float(np.abs(given.wall_velocity).max())

        def response(tether: FloatArray) -> FloatArray:
            trial = state.replace(state.vector.copy(), state.time, state.step)
            trial.tether[:] += tether.reshape(trial.tether.shape)
            return state.like(self.rate(trial)).tether.ravel() - bare

        size = bare.size
        operator = LinearOperator((size, size), matvec=response, dtype=np.float64)
        tether, missed = gmres(
            operator,
            -bare,
            rtol=RIGIDITY_TOLERANCE,
            atol=ROUNDING * speed * np.sqrt(size),
            restart=60,
            maxiter=5,
        )
        if missed:
            raise NumericalError(
                "tether",
                0,
                state.step,
                f"no tractions found that hold the walls rigid to {RIGIDITY_TOLERANCE:.0%}; "
                "use a finer hydrodynamics.resolution or a lower suspension.area_fraction",
            )
        held = tether.reshape(loaded.tether.shape)
        # Tethers drag no wall along x as a whole: the traction does that, and the solution is free
        # of it but for rounding, which nothing would bring to rest again.
        held[:, :, 0] -= held[:, :, 0].mean(axis=1, keepdims=True)
        loaded.tether[:] += held
        return loaded

    def velocities_at(self, points: FloatArray, evaluation: Evaluation) -> FloatArray:
        """Return the fluid velocity at any points of the channel, shape (points, 2)."""
        return self._mobility.velocities_at(points, evaluation.positions, evaluation.forces)

    def error_scale(self, state: State) -> Vector:
        """Return the error of each component of the state's vector that counts as one.

        It is the contact range for positions. A tether is K_w times how far the fluid has crept
        past its node, so that its error counts as that displacement.
        """
        scale = np.full(state.vector.size, self._parameters.steric.length)
        state.like(scale).tether[:] *= self._parameters.wall.stiffness
        return scale

    def closing_rate(self, evaluation: Evaluation) -> float:
        """Return the largest rate -d(ln h)/dt at which a contact film closes [1 / time unit]."""
        velocities = np.empty_like(evaluation.positions)
        count = self.layout.particle_nodes
        velocities[:count] = evaluation.rate[: 2 * count].reshape(-1, 2)
        self._walls(velocities)[:] = 0.0
        self._walls(velocities)[:, :, 0] = evaluation.wall_velocity[:, None]
        return self._contacts.closing_rate(evaluation.positions, velocities)

    def positions(self, state: State) -> FloatArray:
        """Return the positions of all nodes, particles and then walls, shape (nodes, 2).

        Each membrane is shifted by whole periods so that its first node lies in [0, L_x), as
        `solver.membrane.wrap_particles` also leaves states: both then evaluate to the same bits.
        """
        walls = self.layout.wall_reference.copy()
        walls[:, :, 0] += np.mod(state.wall_displacement, self.box.length)[:, None]
        positions = np.concatenate((state.node_position, walls.reshape(-1, 2)))
        membrane.wrap_particles(positions, self.layout.offsets, self.box.length)
        return positions

    def body_forces(self, positions: FloatArray) -> tuple[FloatArray, float]:
        """Return membrane and contact forces on all nodes and the smallest film thickness."""
        layout, parameters = self.layout, self._parameters
        forces = np.zeros_like(positions)
        membrane.add_tension(
            positions,
            layout.offsets,
            layout.spacing,
            parameters.membrane.elastic_constant,
            parameters.membrane.order,
            forces,
        )
        film = self._contacts.add_forces(positions, forces)
        return forces, film

    def evaluate(self, state: State) -> Evaluation:
        """Evaluate forces, velocities and the rate of change of a state.

        Raises
        ------
        NumericalError
            When the wall traction is not finite.
        """
        positions = self.positions(state)
        body_forces, film = self.body_forces(positions)
        forces = body_forces.copy()
        self._walls(forces)[:] += self.layout.wall_spacing * state.tether
        rest = self._moment(positions, forces)
        if self._printed:
            traction = self._tethered_traction(state)
            rest -= traction * self._balance.arm
        else:
            traction = self._traction(positions, forces, rest)
            if traction:
                self._walls(forces)[:, :, 0] += traction * self._drive
        rheometer.check_traction(traction, state.step)
        velocities = self._mobility.velocities(positions, forces)
        rate = self._rate(state, positions, velocities)
        return Evaluation(
            positions=positions,
            body_forces=body_forces,
            forces=forces,
            traction=traction,
            stress=self._balance.stress(traction, rest),
            film_thickness=film,
            wall_velocity=state.like(rate).wall_displacement.copy(),
            rate=rate,
        )

    def rate(self, state: State) -> Vector:
        """Return d/dt of the state's vector."""
        return self.evaluate(state).rate

    def _unit_forces(self) -> FloatArray:
        """Return the forces of unit mean traction on all nodes, shape (nodes, 2)."""
        unit = np.zeros((self.layout.nodes, 2))
        unit[self.layout.particle_nodes :, 0] = self._drive.ravel()
        return unit

    def _moment(self, positions: FloatArray, forces: FloatArray) -> float:
        """Return the moment M of `solver.rheometer`; 0 where it is not needed.

        Still solvent outside carries no stress that M would have to balance.
        """
        if self._balance.still:
            return 0.0
        return rheometer.moment(positions[:, 1], forces[:, 0], self.box.length)

    def _tethered_traction(self, state: State) -> float:
        """Return the mean traction that the upper wall's tethers exert (printed control)."""
        total = float(state.tether[UPPER, :, 0].sum())
        return total * self.layout.wall_spacing / self.box.length

    def _traction(self, positions: FloatArray, forces: FloatArray, rest: float) -> float:
        """Return the mean traction that imposes the stress or the rate exactly.

        An imposed rate costs two more flow solutions: what the walls do under all other forces
        and under unit traction, which for rough walls depends on how the bumps face each other.
        """
        if self._stress is not None:
            return self._balance.traction(self._stress, rest)
        assert self._shear_rate is not None
        return rheometer.traction_at_rate(
            self._shear_rate * self.box.height,
            self._wall_speed(self._mobility.velocities(positions, forces)),
            self._wall_speed(self._mobility.velocities(positions, self._unit_forces())),
        )

    def _walls(self, velocities: FloatArray) -> FloatArray:
        return velocities[self.layout.particle_nodes :].reshape(2, -1, 2)

    def _wall_speed(self, velocities: FloatArray) -> float:
        return rheometer.relative_speed(self._walls(velocities)[:, :, 0])

    def _rate(self, state: State, positions: FloatArray, velocities: FloatArray) -> Vector:
        """Assemble the rate of change from the velocities of all nodes (Eqs. 17, 21, 25-27)."""
        layout, parameters = self.layout, self._parameters
        walls = self._walls(velocities)
        mean = walls[:, :, 0].mean(axis=1)
        rate = np.zeros_like(state.vector)
        view = state.like(rate)
        view.node_position[:] = velocities[: layout.particle_nodes]
        if parameters.membrane.area_correction == "flux":
            membrane.remove_flux(
                positions,
                layout.offsets,
                parameters.membrane.order,
                parameters.membrane.area_restoring,
                layout.reference_area,
                view.node_position,
            )
        view.wall_displacement[:] = mean
        target = state.wall_speed if self._printed else mean
        view.tether[:] = rheometer.tether_rate(walls, target, parameters.wall.stiffness)
        if self._printed:
            view.wall_speed[:] = rheometer.printed_acceleration(
                state.wall_speed,
                mean,
                self.box,
                parameters.solvent.viscosity,
                parameters.wall.stiffness,
            )
        return rate
