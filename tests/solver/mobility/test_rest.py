import numpy as np
import pytest
import scenes

from softslip.solver.geometry import Box
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility
from softslip.solver.mobility.rest import RestWithoutForce

BOX = Box(length=0.25, height=0.375, outer_gap=0.125)
SOLVERS = {
    "grid": lambda: GridMobility(BOX, 64, 1.3),
    "ewald": lambda: EwaldMobility(BOX, 0.01, 1.3, 0.015),
}


class Counted:
    """A mobility that counts what it is asked."""

    def __init__(self, mobility):
        self.mobility, self.count = mobility, 0

    def velocities(self, positions, forces):
        self.count += 1
        return self.mobility.velocities(positions, forces)

    def velocities_at(self, points, positions, forces):
        self.count += 1
        return self.mobility.velocities_at(points, positions, forces)


@pytest.fixture(params=SOLVERS)
def solver(request):
    return Counted(SOLVERS[request.param]())


def nodes(seed, count=20):
    random = scenes.generator(seed)
    return random.uniform(0, 1, (count, 2)) * (BOX.length, BOX.height), random


def test_no_force_makes_no_flow_and_asks_for_none(solver):
    positions, random = nodes(1)
    points, forces = random.uniform(0, 0.25, (7, 2)), np.zeros_like(positions)
    rest = RestWithoutForce(solver)
    found = rest.velocities(positions, forces), rest.velocities_at(points, positions, forces)
    assert solver.count == 0
    wanted = (
        solver.velocities(positions, forces),
        solver.velocities_at(points, positions, forces),
    )
    assert solver.count == 2
    for mine, solved in zip(found, wanted, strict=True):
        assert mine.shape == solved.shape
        assert not mine.any()
        assert not solved.any()


@pytest.mark.parametrize("node", [0, 11, 19])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("size", [1.0, -5e-324, np.inf, np.nan])
def test_a_single_force_counts_however_small_or_wrong(node, axis, size):
    positions, _ = nodes(2)
    forces = np.zeros_like(positions)
    forces[node, axis] = size

    class Told:
        def velocities(self, *given):
            return given

        def velocities_at(self, *given):
            return given

    rest = RestWithoutForce(Told())
    assert rest.velocities(positions, forces) == (positions, forces)
    assert rest.velocities_at(positions, positions, forces)[2] is forces


def test_flow_under_forces_is_that_of_the_mobility(solver):
    positions, random = nodes(3)
    points, forces = random.uniform(0, 0.25, (7, 2)), random.standard_normal(positions.shape)
    rest = RestWithoutForce(solver)
    found = rest.velocities(positions, forces)
    assert found.tobytes() == solver.velocities(positions, forces).tobytes()
    there = rest.velocities_at(points, positions, forces)
    assert there.tobytes() == solver.velocities_at(points, positions, forces).tobytes()
