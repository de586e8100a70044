"""What is measured of one instant: wall speeds, bulk shear rate, slip, stress, areas and films."""

import math

import numpy as np

from softslip.config.parameters import Parameters
from softslip.solver.chains import Subdivision
from softslip.solver.geometry import LOWER, UPPER, BoolArray, FloatArray, Layout
from softslip.solver.membrane import membrane_areas
from softslip.solver.mobility.profile import MeanFlow
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation

WALL_CLEARANCE = 4
"""Mesh lines from a wall at which its regularised force no longer reaches the stress profile."""

PROFILE_SPACING = 2.0
"""Largest distance between the points whose forces make the mean velocity profile [mesh size].
The lumps of nodes 6 apart give it a zigzag, at a stress of 0.02 of 1.5 % (rms) of the wall speed;
points 2 apart leave what closer ones do."""

Sample = dict[str, FloatArray]
"""Observables of one instant by their dataset names."""


def _points_per_node(parameters: Parameters) -> int:
    """Return into how many points the force of a node is divided for the mean velocity profile.

    The paper's mesh scheme moves nodes with the flow of the very lumps of force that they are, so
    that its profile has them too. The corrected quadrature takes the flow of membranes instead.
    """
    hydrodynamics = parameters.hydrodynamics
    if hydrodynamics.quadrature == "plain":
        return 1
    return math.ceil(hydrodynamics.node_spacing / PROFILE_SPACING)


class Observer:
    """Measures one evaluation: wall speeds, bulk shear rate, slip, stress, areas and films.

    Parameters
    ----------
    parameters, layout
        Of the run.
    flow
        Its x-averaged flow.
    """

    def __init__(self, parameters: Parameters, layout: Layout, flow: MeanFlow) -> None:
        self._layout = layout
        self._flow = flow
        self._order = parameters.membrane.order
        self._subdivision = Subdivision(
            layout, parameters.channel.length, _points_per_node(parameters)
        )
        self._height = height = parameters.channel.height
        inside = flow.heights <= height * (1 + 1e-12)
        self.heights = flow.heights[inside]
        bump = float(layout.wall_reference[LOWER, :, 1].max(initial=0.0))
        clear = bump + WALL_CLEARANCE * flow.mesh_size
        between = flow.heights + 0.5 * flow.mesh_size
        self._clear = (between > clear) & (between < height - clear)
        margin = parameters.recording.bulk_margin
        self._bulk: BoolArray | None = None
        if margin is not None:
            edge = margin * parameters.suspension.mean_radius
            self._bulk = (self.heights >= edge) & (self.heights <= height - edge)

    def measure(self, state: State, evaluation: Evaluation) -> Sample:
        """Return every observable of one instant by its dataset name."""
        flow = self._flow
        heights = np.ascontiguousarray(self._subdivision.points(evaluation.positions)[:, 1])
        velocity = flow.velocity(self._force_density(heights, evaluation.forces))
        carried = self._carried_stress(heights, evaluation)
        stress = (flow.viscous_stress(velocity) + carried)[self._clear]
        profile = velocity[: self.heights.size]
        areas = membrane_areas(state.node_position, self._layout.offsets, self._order)
        drift = np.abs(areas / self._layout.reference_area - 1)
        walls = evaluation.wall_velocity
        apart = state.wall_displacement[UPPER] - state.wall_displacement[LOWER]
        film = evaluation.film_thickness
        values = {
            "wall_velocity": walls,
            "shear_rate_wall": np.asarray((walls[UPPER] - walls[LOWER]) / self._height),
            "traction": np.asarray(evaluation.traction),
            "stress": np.asarray(evaluation.stress),
            "stress_deviation": np.abs(stress - evaluation.stress).max(initial=0.0),
            "area_deviation": drift.max(initial=0.0),
            "film_thickness": np.asarray(film if np.isfinite(film) else np.nan),
            "strain": np.asarray(apart / self._height),
            "velocity_profile": profile,
        }
        if self._bulk is not None:
            values |= self._bulk_flow(profile, walls)
        return values

    def _force_density(self, heights: FloatArray, forces: FloatArray) -> FloatArray:
        """Return the x-averaged force density of forces on the nodes, on the mesh lines."""
        shares = np.ascontiguousarray(self._subdivision.shares(forces)[:, 0])
        return self._flow.force_density(heights, shares)

    def _carried_stress(self, heights: FloatArray, evaluation: Evaluation) -> FloatArray | float:
        """Return the stress that bodies carry across each height; without particles, nothing."""
        if not self._layout.particles:
            return 0.0
        return self._flow.carried_stress(self._force_density(heights, evaluation.body_forces))

    def _bulk_flow(self, profile: FloatArray, walls: FloatArray) -> Sample:
        """Fit a line to the profile between the margins; its wall intercepts give the slip."""
        slope, intercept = np.polyfit(self.heights[self._bulk], profile[self._bulk], 1)
        slip = np.array([intercept - walls[LOWER], walls[UPPER] - intercept - slope * self._height])
        return {
            "shear_rate_bulk": np.asarray(slope),
            "slip_velocity_wall": slip,
            "slip_velocity": slip.mean(),
        }
