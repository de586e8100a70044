import numpy as np
import pytest
import scenes
import twins

from softslip import shear
from softslip.geometry import WallContour
from softslip.membrane import membrane_areas
from softslip.shear import mean_flow

CLEARANCE = 4
"""Mesh lines from a wall within which its regularised force blurs the stress."""


def carried_by_planes(suspension, given, positions, heights):
    """Elastic shear stress across each height: the x-force of all links and contacts cut by it.

    Method of planes, from the NumPy twins of both force laws: what bodies above pull on bodies
    below, per unit length.
    """
    layout, steric = suspension.layout, given.steric
    length = given.channel.length
    start, end, pull = twins.links(
        positions, layout.offsets, layout.spacing, given.membrane.elastic_constant
    )
    pairs = twins.close_pairs(positions, layout.body, layout.particles, length, steric.length)
    push = twins.contact_pushes(
        positions, layout.weights, pairs, length, steric.length, steric.energy, steric.reading
    )
    first, second = np.concatenate((start, pairs[0])), np.concatenate((end, pairs[1]))
    force = np.concatenate((pull, push))[:, 0]
    stress = np.zeros_like(heights)
    for one, other, sign in ((first, second, 1.0), (second, first, -1.0)):
        low, high = positions[one, 1], positions[other, 1]
        upwards = low < high
        for k, height in enumerate(heights):
            cut = upwards & (low < height) & (high >= height)
            stress[k] += sign * force[cut].sum() / length
    return stress


@pytest.mark.parametrize("outside", ["still", "periodic"])
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_shear_stress_is_the_imposed_one_at_every_height(roughness, outside):
    """Viscous stress of the fluid plus elastic stress by the method of planes, within 2 %.

    Means over windows of 12 mesh lines, a third of a particle's radius: the fluid feels each
    force smeared over 5 lines, which blurs the ends of a window, but averages out.
    """
    given = scenes.parameters(
        wall={"roughness": roughness},
        channel={"outside": outside},
        hydrodynamics={"resolution": 4096},
        rheometer={"stress": 0.5},
    )
    suspension, state = scenes.of_foam(scenes.foam(given), given)
    state = scenes.stepped(suspension, suspension.load(state), 50, 0.002)
    evaluation = suspension.evaluate(state)
    flow, window, fine = mean_flow(given), 12, 8
    mesh = flow.mesh_size
    velocity = flow.velocity(
        flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0])
    )
    clear = WallContour.of(given).bump_radius + CLEARANCE * mesh
    lines = np.flatnonzero((flow.heights > clear) & (flow.heights < given.channel.height - clear))
    edges = np.arange(lines[0], lines[-1], window)
    viscous = np.diff(velocity[edges]) / (window * mesh) * given.solvent.viscosity
    planes = (edges[0] + (np.arange((len(edges) - 1) * window * fine) + 0.5) / fine) * mesh
    carried = carried_by_planes(suspension, given, evaluation.positions, planes)
    elastic = carried.reshape(len(edges) - 1, -1).mean(axis=1)
    assert np.ptp(elastic) > 0.1 * 0.5, "the packing carries too little for this to be a test"
    error = (viscous + elastic) / 0.5 - 1
    assert np.abs(error).max() <= 0.02, f"off by up to {np.abs(error).max():.1%}"
    assert abs(error.mean()) <= 1e-3, f"off by {error.mean():.1e} on average"


@pytest.mark.parametrize("stage", ["age", "shear"])
def test_same_input_gives_the_same_bytes(foam, aged, smooth, stage):
    given = scenes.parameters(
        rheometer={"stress": 0.5},
        recording={"snapshots": [0.02]},
        time_stepping={"ageing_time": 0.06, "shear_time": 0.06},
    )
    once, again = (
        shear.age(foam, given) if stage == "age" else shear.shear(aged, given) for _ in range(2)
    )
    assert list(once.variables) == list(again.variables)
    for name in once.variables:
        assert once[name].values.tobytes() == again[name].values.tobytes(), name
    assert once.attrs == again.attrs


def test_stages_leave_their_input_as_it_was(foam, aged, smooth):
    copies = foam.copy(deep=True), aged.copy(deep=True)
    given = scenes.parameters(
        rheometer={"stress": 0.5}, time_stepping={"ageing_time": 0.02, "shear_time": 0.02}
    )
    shear.age(foam, given)
    shear.shear(aged, given)
    assert foam.identical(copies[0])
    assert aged.identical(copies[1])


def test_areas_drift_by_less_than_a_thousandth(sheared, aged):
    """The paper's own figure, over a short run of the least resolved mesh."""
    assert float(aged["area_deviation"]) < 1e-3
    assert float(sheared["area_deviation"].max()) < 1e-3


def test_bare_velocities_leak_more(foam, aged, sheared):
    given = scenes.parameters(membrane={"area_correction": "none"}, rheometer={"stress": 0.5})
    leaky = shear.shear(aged, given)["area_deviation"]
    gained = [float(run[-1] - run[0]) for run in (leaky, sheared["area_deviation"])]
    assert gained[0] > 3 * abs(gained[1]), gained


def test_ageing_lowers_the_energy(foam, aged, smooth):
    suspension, _ = scenes.of_foam(foam, smooth)
    layout, steric = suspension.layout, smooth.steric
    energies = []
    for dataset in (foam, aged):
        _, state = scenes.of_foam(dataset, smooth)
        state.wall_displacement[:] = dataset.get("wall_displacement", np.zeros(2))
        positions = suspension.positions(state)
        pairs = twins.close_pairs(
            positions, layout.body, layout.particles, smooth.channel.length, steric.length
        )
        energies.append(
            twins.membrane_energy(positions, layout.offsets, layout.spacing, 1.0)
            + twins.contact_energy(
                positions,
                layout.weights,
                pairs,
                smooth.channel.length,
                steric.length,
                steric.energy,
                steric.reading,
            )
        )
    assert energies[1] < 0.95 * energies[0], f"from {energies[0]:.3e} to {energies[1]:.3e}"


def test_aged_packing_is_handed_over_whole(aged, foam):
    assert np.array_equal(aged["reference_area"].values, foam["area"].values)
    assert np.array_equal(aged["nodes_per_particle"].values, foam["nodes_per_particle"].values)
    assert aged["node_position"].shape == foam["node_position"].shape
    offsets = np.append(0, np.cumsum(foam["nodes_per_particle"].values))
    first = aged["node_position"].values[offsets[:-1], 0]
    assert np.all((first >= 0) & (first < 0.0625)), "membranes are not wrapped into the period"


def test_no_ageing_hands_over_the_packing_as_it_is(foam):
    given = scenes.parameters(time_stepping={"ageing_time": 0.0})
    aged = shear.age(foam, given)
    assert np.array_equal(aged["node_position"].values, foam["node_position"].values)
    assert np.isfinite(aged["tether"].values).all()


def test_rest_distances_are_those_of_the_equal_area_circle(aged, smooth):
    layout = shear.layout_of(aged, smooth)
    radius = np.sqrt(aged["reference_area"].values / np.pi)
    wanted = 2 * np.pi * radius / aged["nodes_per_particle"].values
    assert layout.spacing == pytest.approx(wanted, rel=1e-13)


def test_layout_keeps_the_books(aged, smooth):
    layout = shear.layout_of(aged, smooth)
    assert layout.particles == aged.sizes["particle"]
    assert layout.nodes == layout.particle_nodes + 2 * layout.wall_nodes
    assert layout.weights.shape == layout.body.shape == (layout.nodes,)
    wanted = smooth.hydrodynamics.node_spacing / smooth.hydrodynamics.resolution
    assert layout.wall_spacing == pytest.approx(wanted, rel=0.01)
    assert layout.wall_spacing * layout.wall_nodes == pytest.approx(smooth.channel.length)


def test_progress_counts_every_step(aged):
    given = scenes.parameters(rheometer={"stress": 0.5}, time_stepping={"shear_time": 0.01})
    calls = []
    shear.shear(aged, given, lambda done, steps, time: calls.append((done, steps, time)))
    assert [call[:2] for call in calls] == [(done, 5) for done in range(1, 6)]
    assert calls[-1][2] == pytest.approx(0.01)


def test_imposed_rate_is_recorded_as_such(aged):
    given = scenes.parameters(
        rheometer={"mode": "rate", "stress": None, "shear_rate": 0.4},
        time_stepping={"shear_time": 0.02},
    )
    run = shear.shear(aged, given)
    assert run["shear_rate_wall"].values == pytest.approx(0.4, rel=1e-10)
    assert float(run["stress_deviation"].max()) < 1e-11
    assert np.ptp(run["stress"].values) > 0


def test_walls_move_apart_under_stress_and_rest_without(sheared, aged, smooth):
    assert (sheared["shear_rate_wall"].values > 0).all()
    assert float(aged["shear_rate_wall"]) < 0.1 * float(sheared["shear_rate_wall"][-1])
    areas = membrane_areas(
        aged["node_position"].values, np.append(0, np.cumsum(aged["nodes_per_particle"].values))
    )
    assert areas == pytest.approx(aged["reference_area"].values, rel=1e-3)
