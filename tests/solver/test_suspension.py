import numpy as np
import pytest
import scenes
import twins
from hypothesis import given, settings
from hypothesis import strategies as st

from softslip.simulation import assembly
from softslip.simulation.assembly import contact_law, mean_flow
from softslip.simulation.sample import wall_contour
from softslip.solver import contact_list, contacts, membrane, rheometer, steric
from softslip.solver.chains import lagrange_weights, refine
from softslip.solver.contacts import Contacts
from softslip.solver.geometry import LOWER, UPPER
from softslip.solver.membrane import wrap_particles
from softslip.solver.mobility import ewald
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility
from softslip.solver.neighbours import find_pairs
from softslip.solver.suspension import RIGIDITY_TOLERANCE
from softslip.studies.validation.solutions import CouetteFlow

OUTSIDE = ["still", "periodic"]
SYMBOLS = ["compact", "wide"]


def couette(resolution, symbol, outside, height=0.44, gap=0.56, stress=0.3, viscosity=1.3):
    exact = CouetteFlow(stress, viscosity, height, gap, outside)
    given = scenes.empty(
        solvent={"viscosity": viscosity},
        channel={"length": 1 / 16, "height": height, "outer_gap": gap, "outside": outside},
        hydrodynamics={"resolution": resolution, "symbol": symbol},
        rheometer={"stress": stress},
    )
    suspension, state = scenes.of_rings([], given, stress=stress)
    return exact, given, suspension, suspension.evaluate(state)


def field_speeds(given, suspension, evaluation, heights):
    """Fluid velocity along x in the two-dimensional scheme, averaged over a mesh row."""
    x = np.arange(8) / given.hydrodynamics.resolution
    return np.array(
        [
            suspension.velocities_at(np.column_stack((x, np.full(8, y))), evaluation)[:, 0].mean()
            for y in heights
        ]
    )


def profile_speeds(given, suspension, evaluation, heights):
    flow = mean_flow(given)
    density = flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0])
    return np.interp(heights, flow.heights, flow.velocity(density))


SOLVERS = {"field": field_speeds, "profile": profile_speeds}


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("symbol", SYMBOLS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_couette_profile_is_linear_in_every_solver(solver, symbol, outside):
    """Away from the walls' kernels the slope is exact; the walls' lag does not enter it.

    The wide symbol lets go of the modes that change sign from line to line, so that its profile
    zigzags by some 1e-4; interpolation to points smooths most of that away.
    """
    exact, *scene = couette(512, symbol, outside)
    heights = np.linspace(0.1, 0.34, 7)
    found = SOLVERS[solver](*scene, heights)
    wanted = exact.velocity(heights)
    error = np.abs(found - wanted).max() / exact.relative_speed
    limit = {"compact": 1e-10, "wide": 1e-3}[symbol]
    assert error <= limit, f"off by {error:.1e}"


@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("symbol", SYMBOLS)
def test_couette_wall_speed_is_within_a_hundredth_and_converges_at_first_order(symbol, outside):
    errors = []
    for resolution in (512, 1024, 2048):
        exact, _, _, evaluation = couette(resolution, symbol, outside)
        speed = evaluation.wall_velocity[UPPER] - evaluation.wall_velocity[LOWER]
        errors.append(abs(speed / exact.relative_speed - 1))
    assert errors[-1] < 0.01, f"off by {errors[-1]:.2%} at 1/2048"
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # The lag depends a little on where the walls lie between mesh lines.
    assert orders.min() > 0.9, f"orders {orders}"


@pytest.mark.parametrize("outside", OUTSIDE)
def test_couette_traction_is_that_of_both_solvents(outside):
    exact, _, _, evaluation = couette(512, "compact", outside)
    assert evaluation.traction == pytest.approx(exact.traction, rel=1e-12)
    assert evaluation.stress == pytest.approx(exact.stress, rel=1e-12)


def test_regularised_walls_lag_by_their_traction_times_a_mesh_size():
    """d/(σH/η) = 1 - c (dx/H) L_y/(L_y - H) when periodic, with one c for all gaps and meshes."""
    found = []
    for resolution, cells in ((512, 32), (1024, 40), (1024, 500), (512, 300)):
        height, gap = 224 / 512, cells / resolution
        exact, _, _, evaluation = couette(resolution, "compact", "periodic", height, gap)
        speed = evaluation.wall_velocity[UPPER] - evaluation.wall_velocity[LOWER]
        lag = 1 - speed / exact.relative_speed
        found.append(lag * resolution * height * gap / (height + gap))
    # E|ξ| of two summed kernel variables, 0.89, gives half of it at either wall.
    assert found == pytest.approx([found[0]] * len(found), rel=1e-6), found
    assert found[0] == pytest.approx(0.9, abs=0.25)


def test_a_still_outside_lags_as_if_the_outer_gap_were_infinite():
    lags = []
    for gap in (32 / 512, 300 / 512):
        exact, _, _, evaluation = couette(512, "compact", "still", 224 / 512, gap)
        speed = evaluation.wall_velocity[UPPER] - evaluation.wall_velocity[LOWER]
        lags.append((1 - speed / exact.relative_speed) * 224)
    assert lags[1] == pytest.approx(lags[0], rel=1e-9)
    assert 0.5 < lags[0] < 1.2, lags


def chord_circles(given, centres, radius=0.008, count=50):
    """Circles of nodes at exactly their rest distance, so that no force acts."""
    rings = [scenes.ellipse(centre, (radius, radius), count) for centre in centres]
    return rings, np.full(len(rings), 2 * radius * np.sin(np.pi / count))


def test_nothing_moves_at_rest_under_zero_stress():
    given = scenes.parameters()
    rings, spacing = chord_circles(given, [(0.02, 0.03), (0.05, 0.08)])
    suspension, state = scenes.of_rings(rings, given, spacing, stress=0.0)
    rate = suspension.rate(state)
    assert np.abs(rate).max() <= 1e-12, f"moves at {np.abs(rate).max():.1e}"


def contact_points(positions, layout, given):
    """Points of the contacts, their weights and their pairs, by quintics of the nodes."""
    factor, length = given.steric.refinement, given.channel.length
    jumps = np.append(np.zeros(layout.particles), [length, length])
    points = np.empty((factor * layout.nodes, 2))
    every, weights = np.ones(len(jumps), bool), lagrange_weights(factor)
    refine(positions, layout.chains, jumps, every, weights, factor * layout.chains, *points.T)
    body = np.repeat(layout.body, factor)
    starts, second = find_pairs(points, body, layout.particles, length, given.steric.length)
    pairs = np.repeat(np.arange(len(points)), np.diff(starts)), second
    return points, np.repeat(layout.weights, factor) / factor, pairs


def energy(suspension, given, state):
    """Energy of membranes, contacts and tethers, the last as springs of constant K_w."""
    layout, positions = suspension.layout, suspension.positions(state)
    steric = given.steric
    contacts = twins.contact_energy(
        *contact_points(positions, layout, given),
        given.channel.length,
        steric.length,
        steric.energy,
        steric.reading,
    )
    membranes = twins.membrane_energy(
        positions,
        layout.offsets,
        layout.spacing,
        given.membrane.elastic_constant,
        given.membrane.order,
    )
    tethers = layout.wall_spacing * np.sum(state.tether**2) / (2 * given.wall.stiffness)
    return membranes + contacts + tethers


@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_loaded_tethers_hold_the_walls_rigid(roughness):
    """To the stated part of what the walls' nodes would do without them, in the mean square."""
    given = scenes.parameters(wall={"roughness": roughness}, rheometer={"stress": 0.5})
    suspension, bare = scenes.of_foam(scenes.foam(given), given)
    loaded = suspension.load(bare)
    give = [np.linalg.norm(state.like(suspension.rate(state)).tether) for state in (bare, loaded)]
    left = give[1] / give[0]
    assert left <= 1.001 * RIGIDITY_TOLERANCE, f"walls still give way at {left:.1e}"
    mean = np.abs(loaded.tether[:, :, 0].mean(axis=1)).max() / np.abs(loaded.tether).max()
    assert mean <= 1e-12, f"mean tether {mean:.1e}"
    assert not bare.tether.any(), "loading changed the state it was given"


@pytest.mark.parametrize(("order", "refinement"), [(2, 1), (6, 2)])
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_energy_falls_all_the_time_at_zero_stress(roughness, order, refinement):
    """Stokes flow only dissipates: nothing may grow while nothing drives."""
    given = scenes.parameters(
        wall={"roughness": roughness},
        hydrodynamics={"resolution": 4096},
        membrane={"order": order},
        steric={"refinement": refinement},
    )
    suspension, state = scenes.of_foam(scenes.foam(given), given, stress=0.0)
    state = suspension.load(state)
    energies = [energy(suspension, given, state)]
    for _ in range(16):
        state = scenes.stepped(suspension, state, 10, 0.001)
        energies.append(energy(suspension, given, state))
    rises = np.diff(energies) / energies[0]
    assert rises.max() < 0, f"rises by {rises.max():.1e} of it in block {rises.argmax()}"


def reflected(vectors, axes):
    return vectors * np.where(np.isin([0, 1], axes), -1.0, 1.0)


@pytest.mark.parametrize(
    ("stress", "axes"), [(0.0, [1]), (0.0, [0]), (0.5, [0, 1])], ids=["across", "along", "both"]
)
def test_symmetric_configurations_move_symmetrically(stress, axes):
    """Mirrored across at rest, mirrored along at rest, turned by 180° under shear."""
    given = scenes.parameters(rheometer={"stress": stress})
    middle = 0.5 * np.array([given.channel.length, given.channel.height])
    one = [
        scenes.ellipse(middle + np.array([0.004, 0.02]), (0.011, 0.007), 52, 0.5),
        scenes.ellipse(middle + np.array([-0.013, 0.043]), (0.009, 0.006), 46, -0.3),
    ]
    # An odd number of reflections turns the order of the nodes round.
    order = slice(None, None, -1 if len(axes) == 1 else 1)
    other = [(middle + reflected(ring - middle, axes))[order] for ring in one]
    suspension, state = scenes.of_rings(one + other, given, stress=stress)
    rate = state.like(suspension.rate(state)).node_position
    sizes = np.cumsum([len(ring) for ring in one])
    half = sizes[-1]
    for first, end in zip((0, sizes[0]), sizes, strict=True):
        moved = rate[first:end]
        mirrored = reflected(rate[half + first : half + end][order], axes)
        error = np.abs(mirrored - moved).max() / np.abs(rate).max()
        assert error <= 1e-10, f"off by {error:.1e}"


def test_shifting_every_membrane_by_a_period_changes_nothing(aged, smooth):
    suspension, state = scenes.of_foam(aged, smooth)
    here = suspension.evaluate(state)
    there = state.replace(state.vector.copy(), 0.0, 0)
    there.node_position[:, 0] += smooth.channel.length
    # 1e-16 of a period, times the stiffness of a contact, K ~ 100 forces per contact range.
    error = np.abs(suspension.rate(there) - here.rate).max() / np.abs(here.rate).max()
    assert error <= 1e-10, f"off by {error:.1e}"


@pytest.mark.parametrize("cells", [1, 17])
def test_shifting_everything_along_the_flow_changes_nothing(aged, smooth, cells):
    suspension, state = scenes.of_foam(aged, smooth)
    here = suspension.rate(state)
    shift = cells / smooth.hydrodynamics.resolution
    there = state.replace(state.vector.copy(), 0.0, 0)
    there.node_position[:, 0] += shift
    there.wall_displacement[:] += shift
    error = np.abs(suspension.rate(there) - here).max() / np.abs(here).max()
    assert error <= 1e-10, f"off by {error:.1e}"


@pytest.fixture(scope="module", params=["standard", "paper"])
def level_scene(request):
    """A foam at a level of fidelity, with loaded walls, and its rate."""
    given = scenes.parameters(
        fidelity=request.param,
        hydrodynamics={"resolution": 8192},
        rheometer={"stress": 0.5},
        time_stepping={"step": 0.01},
    )
    suspension, state = scenes.of_foam(scenes.foam(given), given)
    state = suspension.load(state)
    return suspension, state, suspension.rate(state)


@settings(max_examples=10)
@given(shift=st.floats(-0.2, 0.2))
def test_shifting_everything_by_any_distance_changes_little_at_a_level(level_scene, shift):
    suspension, state, rate = level_scene
    there = state.replace(state.vector.copy(), 0.0, 0)
    there.node_position[:, 0] += shift
    there.wall_displacement[:] += shift
    here, moved = (state.like(each) for each in (rate, suspension.rate(there)))
    apart = moved.node_position - here.node_position
    error = np.sqrt(np.mean(apart**2) / np.mean(here.node_position**2))
    # What the far mesh leaves out of forces along membranes, in both.
    assert error <= 2e-4, f"velocities differ by {error:.1e}"
    walls = here.wall_displacement[UPPER] - here.wall_displacement[LOWER]
    moved_walls = moved.wall_displacement[UPPER] - moved.wall_displacement[LOWER]
    assert moved_walls == pytest.approx(walls, rel=2e-4)


def test_rate_is_a_function_of_the_state_alone(aged, smooth):
    suspension, state = scenes.of_foam(aged, smooth)
    first = suspension.rate(state)
    for seed in range(3):
        kick = 1e-4 * scenes.generator(seed).standard_normal(state.vector.size)
        suspension.rate(state.replace(state.vector + kick, 1.0, 5))
    assert suspension.rate(state).tobytes() == first.tobytes()
    fresh, _ = scenes.of_foam(aged, smooth)
    assert fresh.rate(state).tobytes() == first.tobytes()


def test_evaluation_leaves_the_state_as_it_was(aged, smooth):
    suspension, state = scenes.of_foam(aged, smooth)
    before = state.vector.copy()
    suspension.evaluate(state)
    assert np.array_equal(state.vector, before)


def test_membranes_and_contacts_exert_no_net_force(aged, smooth):
    suspension, state = scenes.of_foam(aged, smooth)
    forces = suspension.evaluate(state).body_forces
    total = np.abs(forces.sum(axis=0)).max() / np.abs(forces).sum()
    assert total <= 1e-12, f"net force {total:.1e}"


def test_body_forces_are_their_numpy_twins(aged, smooth):
    suspension, state = scenes.of_foam(aged, smooth)
    layout, positions = suspension.layout, suspension.positions(state)
    start, end, pull = twins.links(positions, layout.offsets, layout.spacing, 1.0)
    steric, length = smooth.steric, smooth.channel.length
    pairs = twins.close_pairs(positions, layout.body, layout.particles, length, steric.length)
    twin = twins.contact_forces(
        positions, layout.weights, pairs, length, steric.length, steric.energy, steric.reading
    )
    np.add.at(twin, start, pull)
    np.add.at(twin, end, -pull)
    forces, _ = suspension.body_forces(positions)
    assert forces == pytest.approx(twin, abs=1e-11 * np.abs(twin).max())


def test_positions_wrap_whole_membranes_and_keep_those_that_need_none(aged, smooth):
    suspension, state = scenes.of_foam(aged, smooth)
    length, first = smooth.channel.length, suspension.layout.offsets[:-1]
    count = suspension.layout.particle_nodes
    # Ageing has wrapped them.
    assert suspension.positions(state)[:count].tobytes() == state.node_position.tobytes()
    there = state.replace(state.vector.copy(), 0.0, 0)
    periods = np.array([-3, -1, 0, 1, 2])[np.arange(suspension.layout.particles) % 5]
    shifts = np.repeat(periods, np.diff(suspension.layout.offsets)) * length
    there.node_position[:, 0] += shifts
    before = there.vector.copy()
    found = suspension.positions(there)[:count]
    assert np.array_equal(there.vector, before), "the state has changed"
    # Three periods round by 1e-16 of them.
    assert found == pytest.approx(state.node_position, abs=1e-15 * length * 10)
    assert np.all((found[first, 0] >= 0) & (found[first, 0] < length))


def test_positions_that_were_wrapped_evaluate_to_the_same_bits(aged, smooth):
    """Of a state that has left the period and of the same state put back into it."""
    suspension, state = scenes.of_foam(aged, smooth)
    gone = state.replace(state.vector.copy(), 0.0, 0)
    gone.node_position[:, 0] += 0.7 * smooth.channel.length
    back = gone.replace(gone.vector.copy(), 0.0, 0)
    wrap_particles(back.node_position, suspension.layout.offsets, smooth.channel.length)
    assert not np.array_equal(back.vector, gone.vector)
    assert suspension.rate(back).tobytes() == suspension.rate(gone).tobytes()


def test_errors_of_positions_count_in_contact_ranges_and_tethers_as_displacements(aged):
    given = scenes.parameters(wall={"stiffness": 300.0}, steric={"length": 0.001})
    suspension, state = scenes.of_foam(aged, given)
    scale = state.like(suspension.error_scale(state))
    assert scale.vector.shape == state.vector.shape
    assert np.all(scale.node_position == 0.001)
    assert np.all(scale.wall_displacement == 0.001)
    assert scale.tether == pytest.approx(np.full(state.tether.shape, 0.3), rel=1e-15)
    # A tether grows as K_w times how far the fluid passes its node: counted as that.
    walls = suspension.layout.particle_nodes
    evaluation = suspension.evaluate(state)
    flow = suspension._mobility.velocities(evaluation.positions, evaluation.forces)[walls:]
    slip = flow.reshape(2, -1, 2)
    slip[:, :, 0] -= evaluation.wall_velocity[:, None]
    rates = state.like(evaluation.rate)
    counted = np.abs(rates.tether / scale.tether)
    assert counted == pytest.approx(np.abs(slip) / 0.001, abs=1e-9 * counted.max())


@pytest.mark.parametrize("refinement", [1, 2])
def test_closing_rate_is_that_of_all_films_and_of_the_walls(aged, refinement):
    """Particles move with their nodes, a wall with its mean velocity along x and not across."""
    given = scenes.parameters(rheometer={"stress": 0.5}, steric={"refinement": refinement})
    suspension, state = scenes.of_foam(aged, given)
    evaluation = suspension.evaluate(state)
    layout, length = suspension.layout, given.channel.length
    thickness, step = [], 1e-6
    _, _, pairs = contact_points(evaluation.positions, layout, given)
    for sign in (-1, 1):
        later = state.replace(state.vector + sign * step * evaluation.rate, 0.0, 0)
        points, _, _ = contact_points(suspension.positions(later), layout, given)
        arm = points[pairs[1]] - points[pairs[0]]
        thickness.append(np.log(np.hypot(twins.minimum_image(arm[:, 0], length), arm[:, 1])))
    rates = (thickness[0] - thickness[1]) / (2 * step)
    bodies = np.repeat(layout.body, refinement)
    at_wall = bodies[pairs[1]] >= layout.particles
    assert 0 < np.count_nonzero(at_wall) < len(at_wall)
    assert rates.max() > 0
    # Positions round by 1e-17, which is 1e-14 of a film, over a step of 1e-6.
    assert suspension.closing_rate(evaluation) == pytest.approx(rates.max(), abs=5e-8)


def outer_gap_run(foam, gap, steps=60):
    given = scenes.parameters(channel={"outer_gap": gap}, rheometer={"stress": 0.5})
    suspension, state = scenes.of_foam(foam, given)
    state = scenes.stepped(suspension, state, steps, 0.002)
    evaluation = suspension.evaluate(state)
    flow = mean_flow(given)
    density = flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0])
    velocity, height = flow.velocity(density), given.channel.height
    bulk = (flow.heights > 0.4 * height) & (flow.heights < 0.6 * height)
    slope, intercept = np.polyfit(flow.heights[bulk], velocity[bulk], 1)
    lower, upper = evaluation.wall_velocity
    slip = 0.5 * (intercept - lower + upper - intercept - slope * height)
    return np.array([(upper - lower) / height, slope, slip / height])


def test_results_do_not_depend_on_the_outer_gap_when_it_is_still(foam):
    """What is left dies out as exp(-2π gap/L_x) and with the tethers' response."""
    narrow, wide = (outer_gap_run(foam, gap) for gap in (0.03125, 0.09375))
    error = np.abs(wide - narrow).max() / np.abs(narrow).max()
    assert error < 2e-3, f"γ̇_wall, γ̇_bulk, V_s/H: {narrow} and {wide}, off by {error:.1e}"


EWALD = {"mobility": "ewald", "regularisation": 0.7, "node_spacing": 1.0}
MESHES = {"grid": {}, "ewald": EWALD, "corrected": {**EWALD, "quadrature": "corrected"}}


def channel(mesh, roughness=0.0, outside="still", **drive):
    """A channel without particles, and its walls at some displacement."""
    given = scenes.empty(
        hydrodynamics=MESHES[mesh],
        wall={"roughness": roughness},
        channel={"outside": outside, "outer_gap": 0.03125},
    )
    suspension, state = scenes.of_rings([], given, **drive)
    state.wall_displacement[:] = (-0.013, 0.4)
    return given, suspension, state


class Count:
    """A function that counts its calls."""

    def __init__(self, function):
        self.function, self.calls = function, 0

    def __call__(self, *given, **named):
        self.calls += 1
        return self.function(*given, **named)


@pytest.fixture
def counted(monkeypatch):
    """Return a function that counts the calls of another wherever some modules look it up."""

    def count(name, *places):
        spy = Count(getattr(places[0], name))
        for place in places:
            monkeypatch.setattr(place, name, spy)
        return spy

    return count


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_without_particles_no_contact_is_searched_for(mesh, roughness, counted):
    searches = counted("find_pairs", contact_list)
    forces = counted("_add_contacts", steric)
    refined = counted("refine", contacts)
    given, suspension, state = channel(mesh, roughness, stress=0.5)
    evaluation = suspension.evaluate(state)
    assert suspension.closing_rate(evaluation) == 0.0
    assert evaluation.film_thickness == np.inf
    assert not evaluation.body_forces.any()
    assert (searches.calls, forces.calls, refined.calls) == (0, 0, 0)
    # Searching all the same finds nothing, and the rate of change is the same to the last bit.
    suspension._contacts = Contacts(contact_law(given), given.channel.length, suspension.layout)
    searched = suspension.evaluate(state)
    assert suspension.closing_rate(searched) == 0.0
    assert searches.calls > 0
    assert searched.rate.tobytes() == evaluation.rate.tobytes()
    assert searched.rate.any()


def test_without_particles_near_pairs_are_those_of_the_walls_alone(counted, monkeypatch):
    """They are rigid, so that nothing is listed; a list of its own would hold nothing either."""
    _, suspension, state = channel("corrected", 0.59, stress=0.5)
    kept = counted("pairs", ewald.VerletList)
    first = suspension.rate(state)
    assert kept.calls == 0

    def listed(solver, positions):
        count = len(positions)
        return solver._list.pairs(positions, np.arange(count), count - solver._rigid.nodes)

    monkeypatch.undo()
    monkeypatch.setattr(ewald.EwaldMobility, "near_pairs", listed)
    _, suspension, state = channel("corrected", 0.59, stress=0.5)
    assert suspension.rate(state).tobytes() == first.tobytes()


def solutions(monkeypatch):
    """Count the flow solutions of either solver."""
    counts = []
    for kind in (GridMobility, EwaldMobility):
        for name in ("velocities", "velocities_at"):
            solve = getattr(kind, name)

            def spy(self, *given, solve=solve):
                counts.append(len(given))
                return solve(self, *given)

            monkeypatch.setattr(kind, name, spy)
    return counts


@pytest.mark.parametrize("mesh", MESHES)
@pytest.mark.parametrize("outside", OUTSIDE)
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_no_flow_is_solved_for_where_nothing_pushes(mesh, outside, roughness, monkeypatch):
    solved = solutions(monkeypatch)
    _, suspension, state = channel(mesh, roughness, outside, stress=0.0)
    state = suspension.load(state)
    evaluation = suspension.evaluate(state)
    field = suspension.velocities_at(np.array([[0.01, 0.05], [0.02, 0.1]]), evaluation)
    assert not solved
    assert not any(values.any() for values in (field, evaluation.rate, evaluation.forces))
    assert (evaluation.traction, evaluation.stress) == (0.0, 0.0)
    # The solver finds the same rest; a stress, the smallest even, is solved for.
    bare = suspension._mobility._mobility
    assert not bare.velocities(evaluation.positions, evaluation.forces).any()
    _, pushed, state = channel(mesh, roughness, outside, stress=1e-300)
    before = len(solved)
    pushed.evaluate(state)
    assert len(solved) > before


@pytest.mark.parametrize("drive", [{"stress": 0.3}, {"shear_rate": 0.3}, {"stress": 0.0}])
@pytest.mark.parametrize(("level", "cells"), [("preview", 3), ("preview", 4), ("standard", 3)])
def test_flat_walls_without_particles_are_rigid_as_they_are(level, cells, drive):
    """The sums let them deform by 1e-5 of their speed, or by rounding, which nothing can hold."""
    sides = {"length": cells / 32, "height": 0.1, "outer_gap": 0.05625}
    given = scenes.empty(fidelity=level, hydrodynamics={"resolution": 8192}, channel=sides)
    suspension, bare = scenes.of_rings([], given, **drive)
    loaded, left = suspension.load(bare), {}
    for name, state in (("bare", bare), ("loaded", loaded)):
        evaluation = suspension.evaluate(state)
        left[name] = np.abs(state.like(evaluation.rate).tether).max()
    speed = given.wall.stiffness * np.abs(evaluation.wall_velocity).max()
    assert left["loaded"] <= left["bare"] <= 1e-5 * speed
    if drive == {"stress": 0.0} or (level, cells) == ("preview", 3):
        # Nodes that lie alike to all mesh lines.
        assert left["bare"] <= 1e-15 * speed
        assert not loaded.tether.any()


def test_an_imposed_rate_solves_for_the_walls_alone_where_nothing_else_pushes(monkeypatch):
    """Of the flows under all other forces, under unit traction and under all, the first is rest."""
    _, suspension, state = channel("ewald", shear_rate=0.7)
    solved = solutions(monkeypatch)
    evaluation = suspension.evaluate(state)
    assert len(solved) == 2
    speed = evaluation.wall_velocity[UPPER] - evaluation.wall_velocity[LOWER]
    assert speed / suspension.box.height == pytest.approx(0.7, rel=1e-12)


def test_at_zero_stress_no_traction_acts_but_what_cancels_the_packing(aged, counted):
    """Still solvent outside needs none; in the periodic box the packing's own stress is balanced.

    Only there is the moment of the forces asked for.
    """
    moments = counted("moment", rheometer)
    found = {}
    for outside in OUTSIDE:
        given = scenes.parameters(channel={"outside": outside})
        suspension, state = scenes.of_foam(aged, given, stress=0.0)
        evaluation = suspension.evaluate(state)
        walls = evaluation.forces[suspension.layout.particle_nodes :]
        body = evaluation.body_forces[suspension.layout.particle_nodes :]
        found[outside] = evaluation.traction, np.abs(walls - body).max(), moments.calls
        assert evaluation.stress == pytest.approx(0.0, abs=1e-15)
    assert found["still"] == (0.0, 0.0, 0)
    traction, drive, calls = found["periodic"]
    assert traction != 0.0
    assert drive == pytest.approx(abs(traction) * suspension._control.unit.max(), rel=1e-9)
    assert calls == 1


def test_flat_walls_have_no_nodes_but_those_of_a_line():
    given = scenes.parameters()
    flat, bumpy = (
        wall_contour(scenes.parameters(wall={"roughness": beta})) for beta in (0.0, 0.59)
    )
    spacing = given.hydrodynamics.node_spacing / given.hydrodynamics.resolution
    walls = assembly.wall_positions(flat, given.channel.height, spacing)
    assert walls.shape[1] == round(given.channel.length / spacing)
    assert set(walls[LOWER, :, 1]) == {0.0}
    assert set(walls[UPPER, :, 1]) == {given.channel.height}
    more = assembly.wall_positions(bumpy, given.channel.height, spacing).shape[1]
    # π/2 of each bump's base, of which there are so many.
    arcs = bumpy.bumps * (np.pi - 2) * bumpy.bump_radius / spacing
    assert more - walls.shape[1] == pytest.approx(arcs, abs=1)


def test_without_membranes_their_loops_are_empty():
    """Forces, velocities and positions of walls are left as they are."""
    none = np.zeros(1, np.int64)
    walls = scenes.generator(3).standard_normal((40, 2))
    for change in (
        lambda values: membrane.add_tension(values, none, np.empty(0), 1.0, 6, values),
        lambda values: membrane.remove_flux(values, none, 6, 1.0, np.empty(0), values),
        lambda values: membrane.wrap_particles(values, none, 0.1),
    ):
        kept = walls.copy()
        change(kept)
        assert kept.tobytes() == walls.tobytes()
    assert membrane.membrane_areas(walls, none, 6).shape == (0,)
