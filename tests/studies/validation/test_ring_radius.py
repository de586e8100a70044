import math

import numpy as np
import pytest

from softslip.solver.geometry import Box
from softslip.solver.mobility.grid import GridMobility
from softslip.studies.validation.ring_radius import directed_lag, hydrodynamic_radius, mesh_lag
from softslip.studies.validation.solutions import MeshSheets
from softslip.studies.validation.unbounded import Unbounded


@pytest.mark.parametrize("epsilon", [0.05, 0.2])
def test_radius_is_that_of_a_ring_in_unbounded_fluid(epsilon):
    """Dense solution for u = e_x: a cylinder moves at (F/4πη) (1/2 - ln a) with these kernels."""
    count = math.ceil(2 * math.pi / epsilon)  # Nodes ε apart: the rule's error is e^{-4π²}.
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    kernel = Unbounded(epsilon, 1.0)
    units = np.eye(2 * count).reshape(-1, count, 2)
    matrix = np.column_stack([kernel.velocities(ring, unit).ravel() for unit in units])
    forces = np.linalg.lstsq(matrix, np.tile([1.0, 0.0], count), rcond=1e-10)[0]
    found = math.exp(0.5 - 4 * math.pi / forces[::2].sum())
    # Steps of 0.05 in the integrals and what is left out beyond their ends.
    assert hydrodynamic_radius(1.0, epsilon) == pytest.approx(found, rel=1e-5)


def test_radius_grows_by_half_the_lag_of_a_flat_sheet_at_first():
    for epsilon in (1e-3, 2e-3):
        grown = hydrodynamic_radius(1.0, epsilon) - 1
        assert grown == pytest.approx(epsilon / math.sqrt(math.pi), abs=2 * epsilon**2)


def test_radius_scales_with_its_unit():
    assert hydrodynamic_radius(3.0, 0.3) == pytest.approx(3 * hydrodynamic_radius(1.0, 0.1))


def test_lag_along_mesh_lines_is_the_mean_over_places_of_the_sheets():
    places = (np.arange(40) + 0.5) / 40
    lags = [MeshSheets(30.0 + 1 / 3, 1.0, place).lag for place in places]
    assert directed_lag(1e-3) == pytest.approx(np.mean(lags), abs=1e-3)


@pytest.mark.parametrize("steps", [(4, 1), (2, 1), (1, 1)])
def test_lag_of_an_inclined_sheet_is_that_on_the_mesh(steps):
    """Two parallel sheets that go around a periodic box and pull past each other.

    At tractions ±1 they part by h (1 - h/P) - E|ξ|, P being the period along their normal.
    """
    cells, across, up = 96, *steps
    box = Box(cells / 64, 0.5, cells / 64 - 0.5)
    angle = math.atan2(up, across)
    tangent = np.array([math.cos(angle), math.sin(angle)])
    normal = np.array([-tangent[1], tangent[0]])
    # Around the box `up` times along y and `across` times along x.
    length, period = box.length * math.hypot(across, up), box.length / math.hypot(across, up)
    count = math.ceil(length * 64 / 0.37)
    apart = 0.31 * period
    along = np.arange(count)[:, None] * (length / count) * tangent
    positions = np.concatenate((along, along + apart * normal)) + 0.0042
    forces = np.repeat([-1.0, 1.0], count)[:, None] * (length / count) * tangent
    velocities = GridMobility(box, 64, 1.0).velocities(positions, forces) @ tangent
    lower, upper = velocities.reshape(2, -1).mean(axis=1)
    lag = apart * (1 - apart / period) - (upper - lower)
    # Sheets in a rational direction see only some of the places between mesh lines.
    assert 64 * lag == pytest.approx(directed_lag(angle), abs=3e-3)


def test_mean_lag_lies_between_those_of_mesh_lines_and_diagonals():
    assert directed_lag(math.pi / 4) < mesh_lag() < directed_lag(0.01)
