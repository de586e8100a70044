import numpy as np
import pytest
import scenes
from hypothesis import given, settings
from hypothesis import strategies as st

from softslip.solver.geometry import Box
from softslip.solver.mobility.grid import GridMobility
from softslip.solver.mobility.outside import StillOutside, outside_stress

BOX = Box(length=0.25, height=0.375, outer_gap=0.125)
VISCOSITY = 1.3


def balanced(seed, count=20):
    random = scenes.generator(seed)
    positions = random.uniform(0, 1, (count, 2)) * (BOX.length, BOX.height)
    forces = random.standard_normal((2, count, 2))
    return positions, *(forces - forces.mean(axis=1, keepdims=True))


def still(box=BOX, resolution=64):
    return StillOutside(GridMobility(box, resolution, VISCOSITY), box, VISCOSITY)


@settings(max_examples=15)
@given(st.integers(0, 2**31))
def test_mobility_stays_symmetric_for_forces_of_zero_sum(seed):
    positions, one, two = balanced(seed)
    solver = still()
    there = np.vdot(two, solver.velocities(positions, one))
    back = np.vdot(one, solver.velocities(positions, two))
    power = np.vdot(one, solver.velocities(positions, one))
    assert power > 0
    assert abs(there - back) <= 1e-12 * power, f"off by {abs(there - back) / power:.1e}"


@settings(max_examples=15)
@given(st.integers(0, 2**31))
def test_outer_solvent_carries_no_stress(seed):
    """Its x-averaged velocity, measured out of reach of the kernels, has no slope."""
    positions, forces, _ = balanced(seed)
    positions[:, 1] = 0.05 + 0.5 * positions[:, 1]
    x = np.arange(16) / 64
    speeds = []
    # Velocities beyond L_y - H/2 belong below the lower wall: the same solvent, one period down.
    for height in (BOX.height, BOX.height + 0.02, BOX.height + 0.04):
        points = np.column_stack((x, np.full(16, height)))
        speeds.append(still().velocities_at(points, positions, forces)[:, 0].mean())
    shear = np.ptp(speeds) / 0.04
    stress = abs(outside_stress(positions[:, 1], forces[:, 0], BOX)) / VISCOSITY
    assert shear <= 1e-10 * (1 + stress / 0.04), f"sheared at {shear:.1e}"


class Marked:
    """A mobility that tells nodes from other points, as the corrected sum does."""

    def velocities(self, positions, forces):
        return np.full_like(positions, 2.0)

    def velocities_at(self, points, positions, forces):
        return np.full_like(points, 3.0)


def test_nodes_and_points_are_asked_for_as_such():
    """Both with the same shear on top."""
    positions, forces, _ = balanced(5)
    solver = StillOutside(Marked(), BOX, VISCOSITY)
    nodes, points = (
        solver.velocities(positions, forces),
        solver.velocities_at(positions, positions, forces),
    )
    assert np.all(nodes[:, 1] == 2.0)
    assert np.all(points[:, 1] == 3.0)
    assert nodes[:, 0] - 2.0 == pytest.approx(points[:, 0] - 3.0, abs=1e-14)
    assert np.ptp(nodes[:, 0]) > 1e-3, "no shear to speak of"


def test_stress_does_not_depend_on_the_origin():
    positions, forces, _ = balanced(3)
    here = outside_stress(positions[:, 1], forces[:, 0], BOX)
    there = outside_stress(positions[:, 1] + 7.0, forces[:, 0], BOX)
    assert there == pytest.approx(here, rel=1e-12)


def test_what_is_added_is_a_uniform_shear_about_the_middle():
    positions, forces, _ = balanced(4)
    bare = GridMobility(BOX, 64, VISCOSITY).velocities(positions, forces)
    added = still().velocities(positions, forces) - bare
    stress = np.sum(forces[:, 0] * positions[:, 1]) / (BOX.length * BOX.period)
    wanted = stress / VISCOSITY * (positions[:, 1] - 0.5 * BOX.height)
    assert added[:, 0] == pytest.approx(wanted, abs=1e-13)
    assert not added[:, 1].any()
