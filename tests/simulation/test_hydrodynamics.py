import numpy as np
import pytest
import scenes
import twins

from softslip.errors import NumericalError
from softslip.simulation import assembly, hydrodynamics, trajectory
from softslip.simulation.assembly import mean_flow, regularisation_of
from softslip.simulation.sample import wall_contour
from softslip.simulation.trajectory import Callbacks
from softslip.solver.integrators import spectral
from softslip.solver.membrane import ORDERS, membrane_areas, wrap_particles
from softslip.solver.mobility.ewald import EwaldMobility
from softslip.solver.mobility.grid import GridMobility, regularisation_length
from softslip.solver.mobility.quadrature import CorrectedQuadrature
from softslip.solver.state import State
from softslip.solver.step_limits import CAUSES

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


def mean_velocity(suspension, given, evaluation, heights):
    """x-averages of the velocity along x: of the mesh by its own equation, of a sum by points."""
    if given.hydrodynamics.mobility == "grid":
        flow = mean_flow(given)
        density = flow.force_density(evaluation.positions[:, 1], evaluation.forces[:, 0])
        return np.interp(heights, flow.heights, flow.velocity(density))
    x = np.arange(256) * given.channel.length / 256  # As far apart as mesh lines.
    points = np.stack(np.meshgrid(x, heights), axis=-1).reshape(-1, 2)
    velocities = suspension.velocities_at(points, evaluation)[:, 0]
    return velocities.reshape(len(heights), -1).mean(axis=1)


@pytest.mark.parametrize("mobility", ["grid", "ewald"])
@pytest.mark.parametrize("outside", ["still", "periodic"])
@pytest.mark.parametrize("roughness", [0.0, 0.59])
def test_shear_stress_is_the_imposed_one_at_every_height(roughness, outside, mobility):
    """Viscous stress of the fluid plus elastic stress by the method of planes, within 2 %.

    Means over windows of 12 mesh lines, a third of a particle's radius: the fluid feels each
    force smeared over 5 lines, which blurs the ends of a window, but averages out.
    """
    given = scenes.parameters(
        wall={"roughness": roughness},
        channel={"outside": outside},
        hydrodynamics={"resolution": 4096, "mobility": mobility},
        rheometer={"stress": 0.5},
    )
    suspension, state = scenes.of_foam(scenes.foam(given), given)
    state = scenes.stepped(suspension, suspension.load(state), 50, 0.002)
    evaluation = suspension.evaluate(state)
    flow, window, fine = mean_flow(given), 12, 8
    mesh = flow.mesh_size
    clear = wall_contour(given).bump_radius + CLEARANCE * mesh
    lines = np.flatnonzero((flow.heights > clear) & (flow.heights < given.channel.height - clear))
    edges = np.arange(lines[0], lines[-1], window)
    velocity = mean_velocity(suspension, given, evaluation, edges * mesh)
    viscous = np.diff(velocity) / (window * mesh) * given.solvent.viscosity
    planes = (edges[0] + (np.arange((len(edges) - 1) * window * fine) + 0.5) / fine) * mesh
    carried = carried_by_planes(suspension, given, evaluation.positions, planes)
    elastic = carried.reshape(len(edges) - 1, -1).mean(axis=1)
    assert np.ptp(elastic) > 0.1 * 0.5, "the packing carries too little for this to be a test"
    error = (viscous + elastic) / 0.5 - 1
    assert np.abs(error).max() <= 0.02, f"off by up to {np.abs(error).max():.1%}"
    assert abs(error.mean()) <= 1e-3, f"off by {error.mean():.1e} on average"


@pytest.mark.parametrize("integrator", ["euler", "rkc2"])
@pytest.mark.parametrize("stage", ["age", "shear"])
def test_same_input_gives_the_same_bytes(foam, aged, stage, integrator):
    given = scenes.parameters(
        rheometer={"stress": 0.5},
        recording={"snapshots": [0.02]},
        time_stepping={"integrator": integrator, "ageing_time": 0.06, "shear_time": 0.06},
    )
    once, again = (
        hydrodynamics.age(foam, given) if stage == "age" else hydrodynamics.shear(aged, given)
        for _ in range(2)
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
    hydrodynamics.age(foam, given)
    hydrodynamics.shear(aged, given)
    assert foam.identical(copies[0])
    assert aged.identical(copies[1])


def test_areas_drift_by_less_than_a_thousandth(sheared, aged):
    """The paper's own figure, over a short run of the least resolved mesh."""
    assert float(aged["area_deviation"]) < 1e-3
    assert float(sheared["area_deviation"].max()) < 1e-3


def test_bare_velocities_leak_more(foam, aged, sheared):
    given = scenes.parameters(membrane={"area_correction": "none"}, rheometer={"stress": 0.5})
    leaky = hydrodynamics.shear(aged, given)["area_deviation"]
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
    aged = hydrodynamics.age(foam, given)
    assert np.array_equal(aged["node_position"].values, foam["node_position"].values)
    assert np.isfinite(aged["tether"].values).all()


def test_rest_distances_are_those_of_the_equal_area_circle(aged, smooth):
    layout = assembly.layout_of(aged, smooth)
    radius = np.sqrt(aged["reference_area"].values / np.pi)
    wanted = 2 * np.pi * radius / aged["nodes_per_particle"].values
    assert layout.spacing == pytest.approx(wanted, rel=1e-13)


def test_layout_keeps_the_books(aged, smooth):
    layout = assembly.layout_of(aged, smooth)
    assert layout.particles == aged.sizes["particle"]
    assert layout.nodes == layout.particle_nodes + 2 * layout.wall_nodes
    assert layout.weights.shape == layout.body.shape == (layout.nodes,)
    wanted = smooth.hydrodynamics.node_spacing / smooth.hydrodynamics.resolution
    assert layout.wall_spacing == pytest.approx(wanted, rel=0.01)
    assert layout.wall_spacing * layout.wall_nodes == pytest.approx(smooth.channel.length)


def test_progress_counts_every_step(aged):
    given = scenes.parameters(rheometer={"stress": 0.5}, time_stepping={"shear_time": 0.01})
    calls = []
    hydrodynamics.shear(aged, given, lambda done, steps, time: calls.append((done, steps, time)))
    assert [call[:2] for call in calls] == [(done, 5) for done in range(1, 6)]
    assert calls[-1][2] == pytest.approx(0.01)


def test_imposed_rate_is_recorded_as_such(aged):
    given = scenes.parameters(
        rheometer={"mode": "rate", "stress": None, "shear_rate": 0.4},
        time_stepping={"shear_time": 0.02},
    )
    run = hydrodynamics.shear(aged, given)
    assert run["shear_rate_wall"].values == pytest.approx(0.4, rel=1e-10)
    assert float(run["stress_deviation"].max()) < 1e-11
    assert np.ptp(run["stress"].values) > 0


def test_walls_move_apart_under_stress_and_rest_without(sheared, aged, smooth):
    assert (sheared["shear_rate_wall"].values > 0).all()
    assert float(aged["shear_rate_wall"]) < 0.1 * float(sheared["shear_rate_wall"][-1])
    areas = membrane_areas(
        aged["node_position"].values,
        np.append(0, np.cumsum(aged["nodes_per_particle"].values)),
        smooth.membrane.order,
    )
    assert areas == pytest.approx(aged["reference_area"].values, rel=1e-3)


RKC2 = {
    "integrator": "rkc2",
    "step": 0.01,
    "tolerance": 2e-3,
    "longest_step": 0.2,
    "ageing_time": 1.0,
    "shear_time": 1.0,
}


def with_steps(**stepping):
    return scenes.parameters(rheometer={"stress": 0.5}, time_stepping={**RKC2, **stepping})


def handed_over(aged, given, shift=0.0):
    """Suspension and state of the aged foam, moved along the flow."""
    suspension, state = scenes.of_foam(aged, given)
    state.tether[:] = aged["tether"].values
    state.wall_displacement[:] = aged["wall_displacement"].values + shift
    state.node_position[:, 0] += shift
    wrap_particles(state.node_position, suspension.layout.offsets, given.channel.length)
    return suspension, state


def crossing_shift(aged, time, before):
    """Shift at which the first node of the fastest particle crosses x = L_x at about a time."""
    given, seen = with_steps(), Seen()
    suspension, state = handed_over(aged, given)
    trajectory.advance(suspension, state, np.array([before, time]), given, Callbacks(seen))
    start, end = (seen.states[seen.times.index(each)] for each in (before, time))
    first, length = suspension.layout.offsets[:-1], given.channel.length
    moved = twins.minimum_image(end.node_position[first, 0] - start.node_position[first, 0], length)
    fastest = first[np.argmax(moved)]
    return length - end.node_position[fastest, 0]


class Watch:
    """A suspension that counts its evaluations and fails at chosen ones."""

    def __init__(self, suspension, failing=()):
        self._suspension = suspension
        self._failing = set(failing)
        self.evaluations = 0

    def __getattr__(self, name):
        return getattr(self._suspension, name)

    def evaluate(self, state):
        self.evaluations += 1
        evaluation = self._suspension.evaluate(state)
        if self.evaluations in self._failing:
            evaluation.rate[:] = np.nan
        return evaluation


class Seen:
    """The states that a run shows."""

    def __init__(self):
        self.states, self.rates = [], []

    def __call__(self, state, evaluation):
        self.states.append(state)
        self.rates.append(evaluation.rate.copy())

    @property
    def times(self):
        return [state.time for state in self.states]


def test_adaptive_steps_end_at_every_stop(aged):
    given, seen = with_steps(), Seen()
    stops = np.array([0.013, 0.1, 0.1001, 0.3])
    suspension, state = handed_over(aged, given)
    advanced = trajectory.advance(suspension, state, stops, given, Callbacks(seen))
    assert set(stops) <= set(seen.times)
    assert (seen.times[0], seen.times[-1]) == (0.0, 0.3)
    assert np.all(np.diff(seen.times) > 0)
    assert [each.step for each in seen.states] == list(range(len(seen.states)))
    assert advanced.state is seen.states[-1]
    assert np.diff(seen.times).max() > 3 * np.diff(seen.times).min(), "the steps hardly adapt"
    assert np.diff(seen.times).max() <= given.time_stepping.longest_step


def test_the_longest_step_is_kept(aged):
    given, seen = with_steps(longest_step=0.003, tolerance=0.1), Seen()
    trajectory.advance(*handed_over(aged, given), np.array([0.05]), given, Callbacks(seen))
    # Even steps, as long as allowed, up to the rounding of their times.
    assert np.diff(seen.times) == pytest.approx(np.full(17, 0.05 / 17), rel=1e-9)


def test_without_stops_the_first_state_is_the_last(aged):
    given, seen = with_steps(), Seen()
    suspension, state = handed_over(aged, given)
    advanced = trajectory.advance(suspension, state, np.array([]), given, Callbacks(seen))
    assert len(seen.states) == 1
    assert np.array_equal(advanced.state.vector, state.vector)
    assert advanced.counts == {"steps": 0, "evaluations": 1, "rejections": 0} | dict.fromkeys(
        SET_BY, 0
    )


SET_BY = [f"steps_set_by_{cause}" for cause in CAUSES]

REMEMBERED = ("time", "step", "step_size", "spectral_radius", "radius_age", "direction")


@pytest.mark.parametrize("integrator", ["rkc2", "euler"])
@pytest.mark.parametrize("pause", [0.1, 0.3])
def test_a_run_that_is_taken_up_again_is_the_same_run(aged, integrator, pause):
    """Byte for byte, though a particle crosses the period before or after the pause."""
    step = {"rkc2": 0.01, "euler": 0.002}[integrator]
    given = with_steps(integrator=integrator, step=step)
    stops = np.array([0.1, 0.3, 0.4])
    shift = crossing_shift(aged, 0.2, 0.1)
    whole, first, second = Seen(), Seen(), Seen()
    once = trajectory.advance(*handed_over(aged, given, shift), stops, given, Callbacks(whole))
    leap = np.abs(np.diff([each.node_position[:, 0] for each in whole.states], axis=0)).max(axis=1)
    crossed = np.array(whole.times[1:])[leap > 0.5 * given.channel.length]
    assert 0.1 < crossed.min() < 0.3, f"particles cross at {crossed}"
    until = stops[stops <= pause]
    paused = trajectory.advance(*handed_over(aged, given, shift), until, given, Callbacks(first))
    suspension, _ = handed_over(aged, given)
    again = trajectory.advance(suspension, paused.state, stops, given, Callbacks(second))
    assert first.times + second.times[1:] == whole.times
    for name in REMEMBERED:
        assert again.state.parts[name].tobytes() == once.state.parts[name].tobytes(), name
    assert again.state.vector.tobytes() == once.state.vector.tobytes()
    assert again.evaluation.rate.tobytes() == once.evaluation.rate.tobytes()
    # The state at the pause is evaluated again.
    assert paused.evaluations + again.evaluations == once.evaluations + 1
    if integrator == "rkc2":
        assert once.state.memory.spectral_radius > 0
        assert once.state.memory.direction.shape == once.state.vector.shape


def test_what_is_shown_belongs_to_its_state(aged):
    """Also where a particle has just been put back into the period."""
    given, seen = with_steps(), Seen()
    shift = crossing_shift(aged, 0.1, 0.05)
    suspension, state = handed_over(aged, given, shift)
    trajectory.advance(suspension, state, np.array([0.25]), given, Callbacks(seen))
    for state, rate in zip(seen.states, seen.rates, strict=True):
        assert rate.tobytes() == suspension.rate(state).tobytes(), f"not so at {state.time}"


def errors_at(aged, reference, runs, until=0.06):
    """Largest difference of node positions from a reference, over σ_LJ."""
    found = []
    for stepping in (reference, *runs):
        given = with_steps(**stepping)
        suspension, state = handed_over(aged, given)
        advanced = trajectory.advance(suspension, state, np.array([until]), given)
        found.append(advanced.state.node_position / given.steric.length)
    return [np.abs(each - found[0]).max() for each in found[1:]]


def test_euler_steps_approach_the_adaptive_solution_at_first_order(aged):
    """A quarter of the step leaves a quarter of the difference."""
    euler = [{"integrator": "euler", "step": step} for step in (0.002, 0.0005)]
    coarse, fine = errors_at(aged, {"tolerance": 1e-7}, euler)
    assert coarse / fine == pytest.approx(4, rel=0.1), f"{coarse:.1e} and {fine:.1e}"


def test_adaptive_steps_are_of_second_order(aged):
    """Steps held at a length by their limit: half of it leaves a quarter of the error."""
    fixed = [{"longest_step": step, "step": step, "tolerance": 0.1} for step in (0.004, 0.002)]
    coarse, fine = errors_at(aged, {"tolerance": 1e-7}, fixed)
    assert coarse / fine == pytest.approx(4, rel=0.25), f"{coarse:.1e} and {fine:.1e}"


def test_a_tolerance_keeps_its_promise(aged):
    """The errors of some tens of steps add up, but each is at most the tolerance."""
    tolerances = (2e-3, 2e-4)
    runs = [{"tolerance": tolerance} for tolerance in tolerances]
    loose, tight = errors_at(aged, {"tolerance": 1e-7}, runs, until=0.1)
    assert loose <= 20 * tolerances[0]
    assert tight <= 20 * tolerances[1]
    assert tight < 0.5 * loose


def test_a_step_that_is_too_long_is_not_shown(aged):
    """A first step of half a time unit: refused until it is short enough."""
    given, seen = with_steps(step=0.5, longest_step=0.5), Seen()
    suspension, state = handed_over(aged, given)
    advanced = trajectory.advance(suspension, state, np.array([0.5]), given, Callbacks(seen))
    assert advanced.rejections > 0
    assert seen.times[1] < 0.1
    assert len(seen.times) == advanced.state.step + 1
    areas = [
        membrane_areas(each.node_position, suspension.layout.offsets, 2) for each in seen.states
    ]
    drift = np.abs(np.array(areas) / suspension.layout.reference_area - 1).max()
    assert drift < 1e-2, f"areas are off by {drift:.1e} on the way"


@pytest.mark.parametrize("failing", [[30], [20, 45]])
def test_a_trial_that_leaves_the_numbers_is_repeated_and_not_shown(aged, failing):
    given, seen = with_steps(), Seen()
    suspension, state = handed_over(aged, given)
    stops = np.array([0.2])
    clean = trajectory.advance(suspension, state, stops, given)
    watch = Watch(suspension, failing)
    advanced = trajectory.advance(watch, state, stops, given, Callbacks(seen))
    assert advanced.rejections > clean.rejections, "no evaluation has failed"
    assert advanced.state.time == 0.2
    assert np.isfinite([each.vector for each in seen.states]).all()
    assert np.isfinite(seen.rates).all()
    assert np.all(np.diff(seen.times) > 0)
    error = np.abs(advanced.state.node_position - clean.state.node_position).max()
    assert error <= 20 * given.time_stepping.tolerance * given.steric.length


def test_a_run_whose_rate_is_lost_for_good_ends_at_its_step_and_shows_no_more(aged):
    given, seen = with_steps(), Seen()
    suspension, state = handed_over(aged, given)
    watch = Watch(suspension, range(30, 10_000))
    with pytest.raises(NumericalError) as caught:
        trajectory.advance(watch, state, np.array([0.2]), given, Callbacks(seen))
    assert caught.value.step == seen.states[-1].step > 0
    assert np.isfinite(seen.rates).all()


@pytest.mark.parametrize("integrator", ["rkc2", "euler"])
def test_evaluations_are_counted(aged, integrator):
    given = with_steps(integrator=integrator, step={"rkc2": 0.5, "euler": 0.002}[integrator])
    suspension, state = handed_over(aged, given)
    watch = Watch(suspension)
    advanced = trajectory.advance(watch, state, np.array([0.1]), given)
    assert advanced.evaluations == watch.evaluations
    steps = advanced.state.step
    counts = advanced.counts
    assert [counts[name] for name in ("steps", "evaluations", "rejections")] == [
        steps,
        watch.evaluations,
        advanced.rejections,
    ]
    assert sum(counts[name] for name in SET_BY) == steps
    if integrator == "euler":
        assert (steps, advanced.rejections) == (50, 0)
        # One for each state, and those of one power iteration.
        assert 51 < advanced.evaluations <= 51 + spectral.MOST_ITERATIONS


def test_a_run_of_adaptive_steps_ends_its_records_where_euler_does(aged):
    recording = {"snapshots": [0.03, 0.2], "samples_per_decade": 5}
    runs = {}
    for name, stepping in {
        "rkc2": {**RKC2, "step": 0.002, "shear_time": 0.2},
        "euler": {"step": 0.002},
    }.items():
        given = scenes.parameters(
            rheometer={"stress": 0.5}, recording=recording, time_stepping=stepping
        )
        runs[name] = hydrodynamics.shear(aged, given)
    for axis in ("time", "interval", "profile_time", "snapshot_time"):
        assert runs["rkc2"][axis].values.tolist() == runs["euler"][axis].values.tolist(), axis
    assert runs["rkc2"].attrs["steps"] < runs["euler"].attrs["steps"] == 100
    assert 101 < runs["euler"].attrs["evaluations"] <= 101 + spectral.MOST_ITERATIONS
    assert runs["rkc2"]["stress"].values == pytest.approx(0.5, rel=1e-12)
    # Euler's own error is half a step times how fast the rate changes, by a third in 0.03.
    for name in ("shear_rate_wall", "strain"):
        euler = runs["euler"][name].values
        largest = np.abs(euler).max()
        assert runs["rkc2"][name].values == pytest.approx(euler, rel=0.05, abs=0.005 * largest)


@pytest.mark.parametrize("order", ORDERS)
def test_areas_return_to_the_reference_at_the_restoring_rate(order):
    """A - A₀ = (A - A₀)(0) e^{-κt}, each membrane its own, whatever else the flow does."""
    rate, until = 6.0, 0.3
    given = scenes.parameters(
        rheometer={"stress": 0.5},
        membrane={"order": order, "area_restoring": rate},
        time_stepping={**RKC2, "tolerance": 1e-4},
    )
    rings = [
        scenes.ellipse((0.02, 0.03), (0.011, 0.007), 60, 0.4),
        scenes.ellipse((0.03, 0.07), (0.009, 0.012), 66),
    ]
    offsets = np.array([0, 60, 126])
    areas = membrane_areas(np.concatenate(rings), offsets, order)
    wanted = areas * (0.98, 1.03)
    spacing = 2 * np.sqrt(np.pi * wanted) / np.diff(offsets)
    suspension, state = scenes.of_rings(rings, given, spacing)
    seen = Seen()
    trajectory.advance(suspension, state, np.linspace(0.1, 1, 10) * until, given, Callbacks(seen))
    moved = np.abs(seen.states[-1].node_position - seen.states[0].node_position).max()
    assert moved > 0.1 * 0.007, "the membranes hardly change"
    for each in seen.states:
        excess = membrane_areas(each.node_position, offsets, order) - wanted
        decayed = (areas - wanted) * np.exp(-rate * each.time)
        # A step may leave errors of the tolerance along the whole perimeter: 1e-4 σ_LJ times
        # 2π 0.01 is 2e-5 of an area, a thousandth of the excess, and they decay as well.
        assert excess == pytest.approx(decayed, abs=3e-5 * areas.max()), f"at {each.time}"


@pytest.mark.parametrize("symbol", ["compact", "wide"])
def test_the_regularisation_is_that_of_the_mesh_or_what_is_given(symbol):
    tree = {"resolution": 4096, "symbol": symbol}
    mesh = scenes.parameters(hydrodynamics=tree)
    assert regularisation_of(mesh) == regularisation_length(1 / 4096, symbol)
    told = scenes.parameters(
        hydrodynamics={**tree, "mobility": "ewald", "regularisation": 0.7, "node_spacing": 1.0}
    )
    assert regularisation_of(told) == pytest.approx(0.7 / 4096, rel=1e-15)


@pytest.mark.parametrize(
    ("hydrodynamics", "kind"),
    [
        ({"mobility": "grid"}, GridMobility),
        ({"mobility": "ewald"}, EwaldMobility),
        ({"mobility": "ewald", "quadrature": "corrected"}, CorrectedQuadrature),
    ],
)
def test_the_mobility_is_the_one_that_is_asked_for(hydrodynamics, kind):
    given = scenes.empty(hydrodynamics=hydrodynamics)
    layout = scenes.layout_of_rings([], given)
    assert type(assembly.mobility_of(given, layout)) is kind


def test_a_level_of_fidelity_carries_through_ageing_and_shear():
    """The coarsest one: what the control and the guards promise holds there too."""
    given = scenes.parameters(
        fidelity="preview",
        hydrodynamics={"resolution": 8192},
        rheometer={"stress": 0.5},
        time_stepping={"step": 0.01, "ageing_time": 0.5, "shear_time": 0.5},
    )
    aged = hydrodynamics.age(scenes.foam(given), given)
    run = hydrodynamics.shear(aged, given)
    assert run["stress"].values == pytest.approx(0.5, rel=1e-12)
    assert (run["shear_rate_wall"].values[-5:] > 0).all()
    # Membranes start with the areas of polygons of some 60 nodes, up to a few thousandths less
    # than their areas at order 6; the difference decays at the restoring rate of 1.
    first, last = run["area_deviation"].values[[0, -1]]
    assert first < 0.005
    assert last == pytest.approx(first * np.exp(-0.5), rel=0.2)


@pytest.mark.parametrize("level", ["standard", "paper"])
def test_a_level_taken_up_again_on_two_threads_is_the_same_run(level):
    """Byte for byte, with lists of pairs that are as old as they happen to be."""
    given = scenes.parameters(
        fidelity=level,
        hydrodynamics={"resolution": 8192},
        rheometer={"stress": 0.5},
        time_stepping={"step": 0.01},
    )
    packing = scenes.foam(given).rename(area="reference_area")
    layout = assembly.layout_of(packing, given)
    start = State.at_rest(packing["node_position"].values, layout)
    stops = np.array([0.2, 0.7])

    def advanced(state, stops, threads):
        suspension = assembly.assemble(given, layout, stress=0.5, threads=threads)
        return trajectory.advance(suspension, state, stops, given).state

    whole = advanced(start, stops, 1)
    pause = advanced(start, stops[:1], 1)
    for threads in (1, 2):
        again = advanced(pause, stops, threads)
        assert again.vector.tobytes() == whole.vector.tobytes(), f"{threads} threads"
        assert again.memory.direction.tobytes() == whole.memory.direction.tobytes()
    assert whole.step > pause.step > 3
