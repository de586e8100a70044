"""The equations of motion: forces, mobility and rheometer assembled into d(state)/dt."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from softslip.errors import NumericalError
from softslip.solver.contacts import Contacts, NoContacts
from softslip.solver.control import Control
from softslip.solver.geometry import Box, FloatArray, Layout
from softslip.solver.integrators import Solve, Vector
from softslip.solver.membrane import MembraneLaw, wrap_particles
from softslip.solver.membrane_response import MembraneResponse
from softslip.solver.mobility import Mobility
from softslip.solver.mobility.rest import RestWithoutForce
from softslip.solver.rheometer import check_traction, relative_speed, tether_rate
from softslip.solver.state import State
from softslip.solver.wall_response import WallResponse

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
    layout
        The run's nodes.
    box
        Its box.
    mobility
        Stokes solver, which treats the solvent outside the walls as the control's balance does.
    contacts
        Between the nodes.
    membranes
        Forces and areas of the membranes.
    control
        What drives the walls.
    membrane_response, wall_response
        Linear responses of membranes and walls to their own forces.
    wall_stiffness
        K_w.
    contact_range
        σ_LJ [length unit].
    """

    def __init__(
        self,
        layout: Layout,
        box: Box,
        mobility: Mobility,
        contacts: Contacts | NoContacts,
        membranes: MembraneLaw,
        control: Control,
        *,
        membrane_response: MembraneResponse,
        wall_response: WallResponse,
        wall_stiffness: float,
        contact_range: float,
    ) -> None:
        self.layout = layout
        self.box = box
        self._mobility = RestWithoutForce(mobility)
        self._contacts = contacts
        self._membranes = membranes
        self._control = control
        self._membrane_response, self._wall_response = membrane_response, wall_response
        self._wall_stiffness = wall_stiffness
        self._contact_range = contact_range

    def load(self, state: State) -> State:
        """Return the state as the control wants it before the first step.

        Raises
        ------
        NumericalError
            When the control asks for rigid walls and no tethers are found that hold them so.
        """
        return self._control.load(state, self._held_rigid)

    def _held_rigid(self, state: State) -> State:
        """Return the state with the tethers that hold the walls rigid under its forces.

        To `RIGIDITY_TOLERANCE`, or to `ROUNDING`. Left to grow at their own rate, tethers would
        let the solvent through the walls by traction over K_w: a good part of a contact film
        where particles press.
        """
        loaded = state.replace(state.vector.copy(), state.time, state.step)
        start = self.evaluate(loaded)
        bare = state.like(start.rate).tether.ravel()
        speed = self._wall_stiffness * float(np.abs(start.wall_velocity).max())

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
        scale = np.full(state.vector.size, self._contact_range)
        state.like(scale).tether[:] *= self._wall_stiffness
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
        wrap_particles(positions, self.layout.offsets, self.box.length)
        return positions

    def body_forces(self, positions: FloatArray) -> tuple[FloatArray, float]:
        """Return membrane and contact forces on all nodes and the smallest film thickness."""
        forces = np.zeros_like(positions)
        self._membranes.add_forces(positions, self.layout, forces)
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

        def speed(trial: FloatArray) -> float:
            velocities = self._mobility.velocities(positions, trial)
            return relative_speed(self._walls(velocities)[:, :, 0])

        traction, stress = self._control.drive(state, positions, forces, speed)
        check_traction(traction, state.step)
        velocities = self._mobility.velocities(positions, forces)
        rate = self._rate(state, positions, velocities)
        return Evaluation(
            positions=positions,
            body_forces=body_forces,
            forces=forces,
            traction=traction,
            stress=stress,
            film_thickness=film,
            wall_velocity=state.like(rate).wall_displacement.copy(),
            rate=rate,
        )

    def rate(self, state: State) -> Vector:
        """Return d/dt of the state's vector."""
        return self.evaluate(state).rate

    def response(self, state: State, shift: float) -> Solve:
        """Return the multiplication by P_g ≈ (1 - g L)⁻¹ of changes of a state's vector.

        L is what each membrane and each wall does to itself; see `solver.membrane_response` and
        `solver.wall_response`. Contacts, and flows from one body to another, are not in it.

        Parameters
        ----------
        state
            About which the rate is linearised.
        shift
            g, positive [time unit].
        """
        membranes = self._membrane_response.at(state.node_position, shift)

        def solve(change: Vector) -> Vector:
            view = state.like(change.copy())
            membranes(view.node_position)
            self._wall_response.solve(view.tether, shift)
            return view.vector

        return solve

    def _walls(self, velocities: FloatArray) -> FloatArray:
        return velocities[self.layout.particle_nodes :].reshape(2, -1, 2)

    def _rate(self, state: State, positions: FloatArray, velocities: FloatArray) -> Vector:
        """Assemble the rate of change from the velocities of all nodes (Eqs. 17, 21, 25-27)."""
        walls = self._walls(velocities)
        mean = walls[:, :, 0].mean(axis=1)
        rate = np.zeros_like(state.vector)
        view = state.like(rate)
        view.node_position[:] = velocities[: self.layout.particle_nodes]
        self._membranes.keep_areas(positions, self.layout, view.node_position)
        view.wall_displacement[:] = mean
        target = self._control.held_speed(state, mean)
        view.tether[:] = tether_rate(walls, target, self._wall_stiffness)
        view.wall_speed[:] = self._control.acceleration(state, mean)
        return rate
