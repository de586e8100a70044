import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip import shear
from softslip.geometry import LOWER, UPPER
from softslip.record import Observer, Recorder, interval_edges
from softslip.shear import mean_flow


@given(st.integers(0, 20000), st.integers(1, 200), st.integers(1, 5000))
def test_interval_ends_rise_from_zero_to_the_last_step(steps, per_decade, longest):
    edges = interval_edges(steps, per_decade, longest)
    assert edges[0] == 0
    assert edges[-1] == steps
    assert np.all(np.diff(edges) >= 1)
    assert np.diff(edges).max(initial=0) <= longest


@given(st.integers(1, 60))
def test_intervals_grow_geometrically_until_the_longest(per_decade):
    edges = interval_edges(10**6, per_decade, 10**6)
    late = edges[(edges > 10**3) & (edges < 10**6)]
    per = (len(late) - 1) / np.log10(late[-1] / late[0]) if len(late) > 3 else per_decade
    # Ends are whole steps, rounded up.
    assert per == pytest.approx(per_decade, rel=0.05)


class Scripted:
    """An observer whose values are known functions of the step."""

    def __init__(self):
        self.heights = np.linspace(0, 1, 4)
        self.seen = []

    def measure(self, state, evaluation):
        self.seen.append(state.step)
        return values_at(state.step)


def values_at(step):
    return {
        "stress": np.asarray(np.cos(step)),
        "wall_velocity": np.array([step, -(step**2)], float),
        "velocity_profile": np.full(4, np.sin(step)),
    }


class Counter:
    """A state of which only the step and the time matter."""

    def __init__(self, step, time_step):
        self.step, self.time = step, step * time_step


def recorded(steps, stride=1, profiles=20, per_decade=30, longest=1.0):
    given = scenes.parameters(
        recording={
            "stride": stride,
            "profiles": profiles,
            "samples_per_decade": per_decade,
            "longest_interval": longest,
        }
    )
    observer = Scripted()
    recorder = Recorder(given, steps, None, observer)
    for step in range(steps):
        recorder.visit(Counter(step, given.time_stepping.step), None)
    return recorder.dataset(), observer, given.time_stepping.step


@given(st.integers(1, 300), st.integers(1, 40), st.floats(0.002, 0.4))
def test_records_are_the_means_of_their_intervals(steps, per_decade, longest):
    dataset, _, time_step = recorded(steps, per_decade=per_decade, longest=longest)
    ends = np.round(dataset["time"].values / time_step).astype(int)
    starts = np.append(0, ends[:-1])
    assert ends[-1] == steps
    assert dataset["interval"].values == pytest.approx((ends - starts) * time_step, rel=1e-9)
    for record, (start, end) in enumerate(zip(starts, ends, strict=True)):
        inside = [values_at(step) for step in range(start, end)]
        for name in ("stress", "wall_velocity"):
            wanted = np.mean([values[name] for values in inside], axis=0)
            assert dataset[name].values[record] == pytest.approx(wanted, rel=1e-12, abs=1e-14)


@given(st.integers(1, 200), st.integers(1, 60))
def test_profiles_are_the_means_of_equal_shares(steps, profiles):
    dataset, _, time_step = recorded(steps, profiles=profiles)
    ends = np.round(dataset["profile_time"].values / time_step).astype(int)
    starts = np.append(0, ends[:-1])
    assert len(ends) == min(profiles, steps)
    assert ends[-1] == steps
    assert np.ptp(ends - starts) <= 1
    for share, (start, end) in enumerate(zip(starts, ends, strict=True)):
        wanted = np.mean(np.sin(np.arange(start, end)))
        assert dataset["velocity_profile"].values[share] == pytest.approx(wanted, abs=1e-13)


@given(st.integers(1, 300), st.integers(1, 50), st.integers(1, 30))
def test_every_record_and_profile_has_a_sample_at_any_stride(steps, stride, profiles):
    dataset, observer, _ = recorded(steps, stride=stride, profiles=profiles)
    assert np.isfinite(dataset["stress"].values).all()
    assert np.isfinite(dataset["velocity_profile"].values).all()
    records = dataset.sizes["time"]
    assert len(observer.seen) <= steps // stride + 2 * records + profiles + 1


def test_wall_rate_is_bulk_rate_and_slip(sheared, smooth):
    """γ̇_wall = γ̇_bulk + 2 V_s/H (Eq. A1)."""
    slip = 2 * sheared["slip_velocity"] / smooth.channel.height
    found = (sheared["shear_rate_bulk"] + slip).values
    wall = sheared["shear_rate_wall"].values
    assert found == pytest.approx(wall, rel=1e-11)
    both = sheared["slip_velocity_wall"].mean("wall").values
    assert sheared["slip_velocity"].values == pytest.approx(both, rel=1e-12)


def test_wall_rate_is_the_speed_difference_over_the_height(sheared, smooth):
    speeds = sheared["wall_velocity"].values
    rate = (speeds[:, UPPER] - speeds[:, LOWER]) / smooth.channel.height
    assert sheared["shear_rate_wall"].values == pytest.approx(rate, rel=1e-12)


def test_bulk_rate_is_the_slope_of_a_linear_profile():
    """Pure solvent under stress: the bulk shears at σ/η, whatever the walls do."""
    given = scenes.empty(rheometer={"stress": 0.3}, recording={"bulk_margin": 3.0})
    suspension, state = scenes.of_rings([], given)
    observer = Observer(given, suspension.layout, mean_flow(given), np.empty(0))
    values = observer.measure(state, suspension.evaluate(state))
    assert values["shear_rate_bulk"] == pytest.approx(0.3, rel=1e-10)
    assert values["stress_deviation"] <= 1e-13
    # The regularised walls lag, which counts as a negative slip of 0.9 mesh sizes at most.
    assert abs(values["slip_velocity"]) <= 0.3 / given.hydrodynamics.resolution


def test_no_bulk_observables_where_none_are_asked_for(foam):
    given = scenes.parameters(recording={"bulk_margin": None})
    suspension, state = scenes.of_foam(foam, given)
    observer = Observer(given, suspension.layout, mean_flow(given), foam["area"].values)
    values = observer.measure(state, suspension.evaluate(state))
    assert not {"shear_rate_bulk", "slip_velocity", "slip_velocity_wall"} & set(values)


def test_strain_is_the_wall_displacement_over_the_height(sheared, smooth):
    """Means over intervals of one step are the values themselves."""
    short = sheared.isel(time=slice(0, 8))
    step = smooth.time_stepping.step
    assert short["interval"].values == pytest.approx(np.full(8, step), rel=1e-9)
    steps = short["shear_rate_wall"].values * step
    assert np.diff(short["strain"].values) == pytest.approx(steps[:-1], rel=1e-9)


def test_every_variable_has_units_and_a_long_name(sheared, aged):
    labels = {"wall", "axis"}
    for dataset in (sheared, aged):
        for name, variable in dataset.variables.items():
            if name in labels:
                continue
            assert variable.attrs.get("units"), f"{name} has no units"
            assert variable.attrs.get("long_name"), f"{name} has no long name"


def test_snapshots_are_taken_at_the_times_asked_for(aged):
    times = [0.0, 0.03, 0.2]
    given = scenes.parameters(rheometer={"stress": 0.5}, recording={"snapshots": times})
    dataset = shear.shear(aged, given)
    step = given.time_stepping.step
    # The end of the run is not a step any more: the last one stands for it.
    wanted = [0.0, 0.03, 0.2 - step]
    assert dataset["snapshot_time"].values == pytest.approx(wanted, abs=1e-12)
    nodes = dataset["node_position"].values
    count = aged.sizes["node"]
    assert nodes.shape == (3, count + 2 * dataset.attrs["wall_nodes"], 2)
    assert np.array_equal(nodes[0, :count], aged["node_position"].values)
    assert np.abs(nodes[1] - nodes[0]).max() > 1e-6
    assert dataset["velocity"].dims == ("snapshot", "field_y", "field_x", "axis")


def test_snapshot_velocity_is_the_fluid_velocity_at_its_points(aged):
    given = scenes.parameters(rheometer={"stress": 0.5}, recording={"snapshots": [0.0]})
    dataset = shear.shear(aged, given)
    suspension, state = scenes.of_foam(aged, given)
    state.tether[:] = aged["tether"].values
    state.wall_displacement[:] = aged["wall_displacement"].values
    evaluation = suspension.evaluate(suspension.load(state))
    for row, column in ((0, 0), (5, 9), (-1, -1)):
        point = np.array([[dataset["field_x"].values[column], dataset["field_y"].values[row]]])
        wanted = suspension.velocities_at(point, evaluation)[0]
        found = dataset["velocity"].values[0, row, column]
        assert found == pytest.approx(wanted, abs=1e-13)


def test_recorded_stress_is_the_imposed_one_and_the_same_at_every_height(sheared):
    assert sheared["stress"].values == pytest.approx(0.5, rel=1e-12)
    worst = float(sheared["stress_deviation"].max())
    assert worst <= 1e-12 * 0.5 * 256, f"deviates by {worst:.1e}"
