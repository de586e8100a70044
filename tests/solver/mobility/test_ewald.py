"""The Ewald sum against its defining Fourier series, its closed forms and the mesh scheme."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from softslip.errors import ConfigError
from softslip.simulation import assembly, hydrodynamics
from softslip.simulation.sample import channel_box
from softslip.solver.geometry import Box
from softslip.solver.mobility import blob
from softslip.solver.mobility import ewald as module
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility, regularisation_length
from softslip.solver.splitting import EWALD_REACH, SPLIT_OVER_SPACING, best_split
from softslip.solver.state import State
from softslip.studies import scenes as studied

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
    # What the far mesh leaves out, for forces that vary from node to node.
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
    # The errors of both, each at most that of the test above.
    assert difference < 4e-4, f"splits {one:.3f} and {other:.3f} differ by {difference:.1e}"


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


def test_velocity_at_a_node_is_the_velocity_of_the_node():
    positions, forces = cloud(5)
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    nodes = mobility.velocities(positions, forces)
    points = mobility.velocities_at(positions[:7], positions, forces)
    without_self = points - nodes[:7]
    # A point is no node: it feels the node that it lies on, whose force is the node's own.
    # Polynomials stand for what a node has of itself in closed form.
    assert root_mean_square(without_self) < 1e-5 * root_mean_square(nodes)


@settings(max_examples=10)
@given(st.integers(0, 2**31), st.floats(0.05, 0.49))
def test_an_old_list_gives_the_same_bytes_as_a_new_one(seed, share):
    """Up to the move of half the skin at which the list is rebuilt, and across whole periods."""
    positions, forces = cloud(seed, count=200)
    old = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    old.velocities(positions, forces)
    angle = 2 * np.pi * scenes.generator(seed, 7).random(len(positions))
    step = share * module.SKIN * old.reach
    moved = positions + step * np.column_stack((np.cos(angle), np.sin(angle)))
    moved[:20, 0] += BOX.length
    listed = old._list.pairs(positions, np.arange(200), 200)
    assert old._list.pairs(moved, np.arange(200), 200) is listed
    new = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    assert old.velocities(moved, forces).tobytes() == new.velocities(moved, forces).tobytes()


@given(st.integers(0, 2**31), st.integers(-3, 3))
@settings(max_examples=10)
def test_whole_periods_along_the_flow_change_nothing(seed, periods):
    positions, forces = cloud(seed)
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    here = mobility.velocities(positions, forces)
    there = positions.copy()
    there[::2, 0] += periods * BOX.length
    difference = root_mean_square(mobility.velocities(there, forces) - here)
    # Positions lose 3e-16 of three periods, some 1e-14 of the smallest length, ε.
    assert difference < 1e-12 * root_mean_square(here)


@settings(max_examples=15)
@given(st.integers(0, 2**31), st.floats(-3, 3), st.floats(-0.17, 0.17))
def test_translations_change_little(seed, along, across):
    """Wherever the nodes lie between the lines of the far mesh."""
    positions, forces = cloud(seed)
    positions[:, 1] = 0.5 * (positions[:, 1] + 0.5 * BOX.height)  # Room to stay in the channel.
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    here = mobility.velocities(positions, forces)
    there = mobility.velocities(positions + np.array([along, across]), forces)
    difference = root_mean_square(there - here) / root_mean_square(here)
    # Each sum may be off by 3e-4, as below.
    assert difference < 6e-4, f"differ by {difference:.1e}"


@settings(max_examples=10)
@given(st.integers(0, 2**31), st.sampled_from([0.6, 0.3, 0.03, 0.003]))
def test_split_does_not_matter_down_to_vanishing_regularisation(seed, ratio):
    positions, forces = cloud(seed)
    # Nodes of one membrane and of touching ones come much closer than those of a random cloud.
    positions[1::2] = positions[::2] + 0.1 * SPLIT * scenes.generator(seed, 1).random((20, 2))
    first, second = (
        EwaldMobility(BOX, ratio * SPLIT, 1.0, split).velocities(positions, forces)
        for split in (SPLIT, 1.3 * SPLIT)
    )
    difference = root_mean_square(first - second) / root_mean_square(first)
    # Each sum may be off by 3e-4: the forces are as rough as can be, and the meshes tiny.
    assert difference < 6e-4, f"ε/a = {ratio}: differ by {difference:.1e}"


def walls(count, shift=(0.0, 0.0)):
    x = (np.arange(count) + 0.5) * BOX.length / count
    bumpy = 0.02 * (1 + np.sin(6 * np.pi * x))
    lower, upper = np.column_stack((x, bumpy)), np.column_stack((x, BOX.height - bumpy))
    displaced = np.column_stack((np.repeat(shift, count), np.zeros(2 * count)))
    return np.concatenate((lower, upper)) + displaced


@settings(max_examples=10)
@given(st.integers(0, 2**31), st.floats(-2, 2), st.floats(-2, 2))
def test_rigid_nodes_move_as_any(seed, lower, upper):
    inner, _ = cloud(seed)
    positions = np.concatenate((inner, walls(60, (lower, upper))))
    forces = scenes.generator(seed, 2).standard_normal(positions.shape)
    plain = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    rigid = EwaldMobility(BOX, EPSILON, 1.0, SPLIT, rigid=walls(60))
    exact, found = (m.velocities(positions, forces) for m in (plain, rigid))
    assert rigid.pairs == plain.pairs
    error = root_mean_square(found - exact) / root_mean_square(exact)
    # Rigid pairs are worked out in closed form, others by polynomials.
    assert error < 1e-6, f"relative error {error:.1e}"
    points = np.concatenate((inner[:3] + 0.01, positions[-2:]))
    exact, found = (m.velocities_at(points, positions, forces) for m in (plain, rigid))
    assert root_mean_square(found - exact) < 1e-6 * root_mean_square(exact)


def test_rigid_walls_within_each_others_reach_are_refused():
    close = walls(60)
    close[60:, 1] -= BOX.height - 0.1
    with pytest.raises(ValueError, match=r"within 0\.0\d+ of each other, less than"):
        EwaldMobility(BOX, EPSILON, 1.0, SPLIT, rigid=close)


@pytest.mark.parametrize("rigid", [None, walls(400)])
def test_pairs_are_as_many_as_a_k_d_tree_finds_within_the_reach(rigid):
    """Between nodes in the channel, between them and the walls, and within each wall."""
    inner, _ = cloud(9, count=3000)
    positions = np.concatenate((inner, walls(400, (0.3, -1.7))))
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT, rigid=rigid)
    mobility.velocities(positions, np.zeros_like(positions))
    tree = cKDTree(positions % (BOX.length, np.inf), boxsize=(BOX.length, 0.0))
    close = tree.query_pairs(mobility.reach, output_type="ndarray")
    assert mobility.pairs == len(close) > 10**5


def test_a_node_that_is_no_number_spoils_the_result_visibly():
    positions, forces = cloud(10)
    positions[3, 0] = np.nan
    velocities = EwaldMobility(BOX, EPSILON, 1.0, SPLIT).velocities(positions, forces)
    assert np.isnan(velocities).all()


def test_arguments_are_left_alone():
    positions, forces = cloud(11)
    kept = positions.copy(), forces.copy()
    mobility = EwaldMobility(BOX, EPSILON, 1.0, SPLIT)
    first = mobility.velocities(positions, forces)
    assert np.array_equal(positions, kept[0])
    assert np.array_equal(forces, kept[1])
    strided = np.repeat(positions, 2, axis=1)[:, ::2]
    assert mobility.velocities(strided, forces).tobytes() == first.tobytes()


@given(st.floats(3, 3000))
def test_mesh_has_lines_enough_and_not_many_more(fewest):
    lines = module.mesh_lines(fewest)
    assert lines >= fewest
    assert lines % 2 == 0
    assert lines <= 2 * max(fewest, 2), f"{lines} lines for {fewest}"


@pytest.mark.parametrize(("regularisation", "spacing"), [(0.8, 4.0), (4.0, 1.0), (0.01, 4.0)])
def test_best_split_exceeds_the_regularisation(regularisation, spacing):
    split = best_split(regularisation, spacing)
    assert split > regularisation
    assert split >= SPLIT_OVER_SPACING * spacing


@pytest.mark.parametrize("net", ["none", "each"])
def test_sums_are_accurate_on_a_foam(foam, smooth, net):
    """Smooth forces along membranes with and without a total on each; a finer sum is the truth."""
    layout = assembly.layout_of(foam.rename(area="reference_area"), smooth)
    positions = foam["node_position"].values
    random, pieces = scenes.generator(12), []
    for size in np.diff(layout.offsets):
        angle = 2 * np.pi * np.arange(size) / size
        waves = np.column_stack([f(m * angle) for m in range(1, 9) for f in (np.cos, np.sin)])
        pieces.append(waves @ random.standard_normal((16, 2)))
        pieces[-1] -= pieces[-1].mean(axis=0)
        if net == "each":
            pieces[-1] += random.standard_normal(2)
    forces = np.concatenate(pieces)
    box, mesh_size = channel_box(smooth), 1 / smooth.hydrodynamics.resolution
    epsilon, spacing = regularisation_length(mesh_size, "compact"), layout.spacing[0]
    # The error falls with the reach over the size of what the forces vary over.
    finer = EwaldMobility(box, epsilon, 1.0, box.outer_gap / EWALD_REACH)
    found = EwaldMobility(box, epsilon, 1.0, best_split(epsilon, spacing))
    exact = finer.velocities(positions, forces)
    error = root_mean_square(found.velocities(positions, forces) - exact) / root_mean_square(exact)
    assert found.reach < 0.5 * finer.reach
    # What the sums may be off by: these forces vary faster than those of membranes in contact.
    assert error < 3e-4, f"relative error {error:.1e}"


def finer(monkeypatch, make):
    """Return a sum whose far mesh leaves out next to nothing: e^-8 of what the usual one does."""
    reach = 18.0
    with monkeypatch.context() as patch:
        patch.setattr(blob, "_BEYOND", reach * blob._BEYOND / blob.MESH_REACH)
        for place in (module, blob):
            patch.setattr(place, "MESH_REACH", reach)
        return make()


@pytest.mark.parametrize("level", ["standard", "paper"])
@pytest.mark.parametrize("seed", [11, 12])
def test_sums_are_accurate_on_packings_that_nothing_was_chosen_on(level, seed, monkeypatch):
    """Forces of membranes in contact, and forces that vary at random from node to node."""
    given = studied.parameters_of(24, level, seed=seed, time_stepping={"ageing_time": 0.1})
    scene = studied.scene_of(studied.aged_packing(given), given)
    flow = scene.suspension.evaluate(scene.state)
    random = np.random.default_rng(seed).standard_normal(flow.forces.shape)
    found = studied.plain_sum(given, scene.layout)
    epsilon, split = assembly.regularisation_of(given), found.reach / EWALD_REACH
    exact = finer(monkeypatch, lambda: EwaldMobility(channel_box(given), epsilon, 1.0, split))
    for forces, limit in ((flow.forces, 4e-4), (random - random.mean(axis=0), 1e-4)):
        wanted = exact.velocities(flow.positions, forces)
        missed = found.velocities(flow.positions, forces) - wanted
        error = root_mean_square(missed) / root_mean_square(wanted)
        assert error < limit, f"relative error {error:.1e}"
        assert np.abs(missed).max() < 4 * limit * root_mean_square(wanted)


def test_foam_moves_as_on_the_mesh(foam, smooth):
    """What remains between them is the shape of the mesh's delta function: it shrinks with dx."""
    layout = assembly.layout_of(foam.rename(area="reference_area"), smooth)
    suspension = assembly.assemble(smooth, layout, stress=0.3)
    state = suspension.load(State.at_rest(foam["node_position"].values, layout))
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
        flows[mobility] = hydrodynamics.shear(aged, given)
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
        "import test_ewald as t, hashlib; p, f = t.cloud(8);"
        "m = t.EwaldMobility(t.BOX, t.EPSILON, 1.0, t.SPLIT);"
        "print(hashlib.sha256(m.velocities(p, f).tobytes()).hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", script],
            cwd=__file__.rpartition("/")[0],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for _ in range(2)
    }
    assert len(digests) == 1
