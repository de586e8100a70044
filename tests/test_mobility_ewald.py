"""The Ewald sum against its defining Fourier series, its closed forms and the mesh scheme."""

import math
import subprocess
import sys

import numpy as np
import pytest
import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import j0, j1

from softslip import shear
from softslip.errors import ConfigError
from softslip.geometry import Box
from softslip.mobility import ewald as module
from softslip.mobility.ewald import EwaldMobility
from softslip.mobility.grid import GridMobility, regularisation_length

BOX = Box(length=1.0, height=0.7, outer_gap=0.5)
EPSILON, SPLIT = 0.012, 0.04


def cloud(seed, count=40, box=BOX):
    """Random nodes in the channel with forces of zero sum."""
    random = scenes.generator(seed)
    positions = random.random((count, 2)) * (box.length, box.height)
    forces = random.standard_normal((count, 2))
    return positions, forces - forces.mean(axis=0)


def root_mean_square(values):
    return math.sqrt(np.mean(np.sum(values**2, axis=-1)))


def fourier_sum(positions, forces, epsilon, viscosity, box=BOX):
    """The defining series, summed to where its Gaussian is 1e-14."""
    highest = math.sqrt(32) / epsilon
    nx, ny = (math.ceil(highest * side / (2 * math.pi)) for side in (box.length, box.period))
    kx = 2 * math.pi * np.arange(-nx, nx + 1) / box.length
    ky = 2 * math.pi * np.arange(-ny, ny + 1) / box.period
    along = np.exp(1j * np.outer(positions[:, 0], kx))
    across = np.exp(1j * np.outer(positions[:, 1], ky))
    fx, fy = (along.conj().T @ (forces[:, c, None] * across.conj()) for c in (0, 1))
    squared = kx[:, None] ** 2 + ky[None, :] ** 2
    squared[nx, ny] = 1.0
    weight = np.exp(-(epsilon**2) * squared) / (viscosity * squared * box.length * box.period)
    weight[nx, ny] = 0.0
    longitudinal = (kx[:, None] * fx + ky[None, :] * fy) / squared
    ux = weight * (fx - kx[:, None] * longitudinal)
    uy = weight * (fy - ky[None, :] * longitudinal)
    return np.stack(
        [np.real(np.einsum("ik,kl,il->i", along, modes, across)) for modes in (ux, uy)], axis=-1
    )


@pytest.mark.parametrize("split", [0.025, 0.04, 0.06])
@pytest.mark.parametrize("viscosity", [1.0, 2.5])
def test_velocities_are_those_of_the_fourier_series(split, viscosity):
    positions, forces = cloud(1)
    exact = fourier_sum(positions, forces, EPSILON, viscosity)
    found = EwaldMobility(BOX, EPSILON, viscosity, split).velocities(positions, forces)
    error = root_mean_square(found - exact) / root_mean_square(exact)
    # Where the near sum is cut off, its Gaussian is e^{-7.6}, some 1e-4 of the whole.
    assert error < 2e-4, f"relative error {error:.1e}"


@settings(max_examples=15)
@given(st.integers(0, 2**31), st.floats(0.02, 0.045), st.floats(0.02, 0.045))
def test_the_split_does_not_matter(seed, one, other):
    positions, forces = cloud(seed)
    first, second = (
        EwaldMobility(BOX, EPSILON, 1.0, split).velocities(positions, forces)
        for split in (one, other)
    )
    difference = root_mean_square(first - second) / root_mean_square(first)
    assert difference < 2e-4, f"splits {one:.3f} and {other:.3f} differ by {difference:.1e}"


@settings(max_examples=15)
@given(st.integers(0, 2**31))
def test_mobility_is_symmetric(seed):
    positions, forces = cloud(seed)
    _, others = cloud(seed + 1)
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    left = np.sum(others * mobility.velocities(positions, forces))
    right = np.sum(forces * mobility.velocities(positions, others))
    scale = root_mean_square(forces) * root_mean_square(mobility.velocities(positions, others))
    assert abs(left - right) < 1e-12 * scale * len(positions)


def test_mobility_dissipates():
    positions, forces = cloud(3)
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    for factor in (1.0, -2.0):
        assert np.sum(factor * forces * mobility.velocities(positions, factor * forces)) > 0


def test_a_force_on_everything_moves_nothing_far_away():
    positions, _ = cloud(4)
    velocity = EwaldMobility(BOX, EPSILON, 1.0, SPLIT).velocities_at(
        np.array([[0.5, 0.95]]), positions, np.zeros_like(positions)
    )
    assert not velocity.any()


@pytest.mark.parametrize("distance", [0.3, 1.0, 4.0, 12.0])
def test_near_profiles_are_the_hankel_integrals(distance):
    epsilon, split = 0.8, 3.0

    def near(k):
        far = math.exp(-((split * k) ** 2)) * (1 + (split**2 - epsilon**2) * k**2)
        return (math.exp(-((epsilon * k) ** 2)) - far) / k

    def transform(bessel):
        return quad(lambda k: near(k) * bessel(k * distance), 1e-9, 12, limit=400)[0]

    ratio = transform(lambda x: j1(x) / x)
    plain = transform(j0)
    tangential, excess = module.near_profiles(np.array([distance]), epsilon, split)
    assert tangential[0] == pytest.approx(plain - ratio, abs=1e-7)
    assert excess[0] == pytest.approx(2 * ratio - plain, abs=1e-7)


def test_near_profiles_meet_the_value_at_zero_distance():
    tangential, excess = module.near_profiles(np.array([1e-3]), 0.8, 3.0)
    assert tangential[0] == pytest.approx(module.near_on_itself(0.8, 3.0), rel=1e-5)
    assert abs(excess[0]) < 1e-5


def test_table_is_the_closed_forms():
    epsilon, split = 0.8, 4.0
    table = module.near_table(epsilon, split)
    distance = np.linspace(0.05, 0.999 * module.EWALD_REACH * split, 3000)
    width = (module.EWALD_REACH * split) ** 2 / module.TABLE_SIZE
    cell = (distance**2 / width).astype(int)
    t = distance**2 - cell * width
    powers = t[:, None] ** np.arange(4)
    tangential, excess = module.near_profiles(distance, epsilon, split)
    for columns, exact in ((slice(0, 4), tangential), (slice(4, 8), excess / distance**2)):
        found = np.sum(table[cell, columns] * powers, axis=1)
        error = np.abs(found - exact).max() / np.abs(exact).max()
        assert error < 5e-5, f"columns {columns}: {error:.1e}"


def test_velocity_at_a_node_is_the_velocity_of_the_node():
    positions, forces = cloud(5)
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    nodes = mobility.velocities(positions, forces)
    points = mobility.velocities_at(positions[:7], positions, forces)
    without_self = points - nodes[:7]
    # A point is no node: it feels the node that it lies on, whose force is the node's own.
    # The table interpolates to 1e-5 what a node has of itself in closed form.
    assert root_mean_square(without_self) < 1e-5 * root_mean_square(nodes)


def test_an_old_list_gives_the_same_bytes_as_a_new_one():
    positions, forces = cloud(6)
    old = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    old.velocities(positions, forces)
    moved = positions + 0.1 * module.SKIN * module.EWALD_REACH * SPLIT * scenes.generator(7).random(
        positions.shape
    )
    new = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    assert old.velocities(moved, forces).tobytes() == new.velocities(moved, forces).tobytes()


def test_foam_moves_as_on_the_mesh(foam, smooth):
    """What remains between them is the shape of the mesh's delta function: it shrinks with dx."""
    layout = shear.layout_of(foam.rename(area="reference_area"), smooth)
    suspension = shear.assemble(smooth, layout, stress=0.3)
    state = suspension.load(shear.State.at_rest(foam["node_position"].values, layout))
    at_start = suspension.evaluate(state)
    errors = []
    for resolution in (2048, 4096):
        mesh_size = 1 / resolution
        box = Box(smooth.channel.length, smooth.channel.height, smooth.channel.outer_gap)
        grid = GridMobility(box, resolution, 1.0)
        epsilon = regularisation_length(mesh_size, "compact")
        fast = EwaldMobility(box, epsilon, 1.0, 4 * mesh_size)
        exact = grid.velocities(at_start.positions, at_start.forces)
        found = fast.velocities(at_start.positions, at_start.forces)
        errors.append(root_mean_square(found - exact) / root_mean_square(exact))
    assert errors[1] < 0.02, f"relative errors {errors}"
    assert errors[1] < 0.65 * errors[0], f"the mesh does not approach the sum: {errors}"


def test_a_sheared_foam_flows_as_on_the_mesh(aged):
    """The same run with both mobilities, over times in which nothing has become chaotic."""
    flows = {}
    for mobility in ("grid", "ewald"):
        given = scenes.parameters(
            rheometer={"stress": 0.5}, hydrodynamics={"mobility": mobility, "split": 4.0}
        )
        flows[mobility] = shear.shear(aged, given)
    for name in ("shear_rate_wall", "shear_rate_bulk"):
        grid, fast = (flows[mobility][name].values for mobility in ("grid", "ewald"))
        error = np.abs(fast / grid - 1).max()
        # On so coarse a mesh a contact film is 1.8 mesh sizes thick, and the shapes differ.
        assert error < 0.04, f"{name} differs by {error:.1%}"
    assert float(flows["ewald"]["area_deviation"].max()) < 1e-3


def test_a_reach_beyond_the_outer_gap_is_refused():
    with pytest.raises(ConfigError, match=r"hydrodynamics\.split: 8\.0 makes the near sum reach"):
        scenes.parameters(hydrodynamics={"mobility": "ewald", "split": 8.0})


def test_same_input_gives_the_same_bytes_in_every_process():
    script = (
        "import test_mobility_ewald as t, hashlib; p, f = t.cloud(8);"
        "m = t.EwaldMobility(t.BOX, t.EPSILON, 1.0, t.SPLIT);"
        "print(hashlib.sha256(m.velocities(p, f).tobytes()).hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", script],
            cwd=__file__.rpartition("/")[0],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for _ in range(2)
    }
    assert len(digests) == 1
