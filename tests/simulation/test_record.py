import numpy as np
import pytest
import scenes
from hypothesis import given
from hypothesis import strategies as st

from softslip.simulation import hydrodynamics
from softslip.simulation.observer import Observer
from softslip.simulation.record import Recorder, interval_edges
from softslip.solver.geometry import LOWER, UPPER
from softslip.solver.suspension import Suspension


@given(st.integers(0, 20000), st.integers(1, 200), st.integers(1, 5000))
def test_interval_ends_rise_from_zero_up_to_the_last_step(steps, per_decade, longest):
    edges = interval_edges(steps, per_decade, longest)
    assert edges[0] == 0
    assert steps - longest < edges[-1] <= steps
    assert np.all(np.diff(edges) >= 1)
    assert np.diff(edges).max(initial=0) <= longest


@given(st.integers(0, 2000), st.integers(0, 2000), st.integers(1, 200), st.integers(1, 500))
def test_interval_ends_do_not_depend_on_how_long_the_stage_is(steps, more, per_decade, longest):
    edges = interval_edges(steps, per_decade, longest)
    longer = interval_edges(steps + more, per_decade, longest)
    assert edges.tolist() == longer[longer <= steps].tolist()


@given(st.integers(1, 60), st.integers(1, 500), st.integers(1, 40))
def test_ends_at_multiples_of_the_longest_interval_end_a_record(per_decade, longest, count):
    """Once intervals have grown to it; a run of round length can then be prolonged."""
    edges = interval_edges(count * longest, per_decade, longest)
    full = np.flatnonzero(np.diff(edges) == longest)
    if len(full):
        assert not np.any(edges[full[0] :] % longest)
        assert edges[-1] == count * longest


@given(st.integers(1, 60))
def test_intervals_grow_geometrically_until_the_longest(per_decade):
    edges = interval_edges(10**6, per_decade, 10**6)
    late = edges[(edges > 10**3) & (edges < 10**6)]
    per = (len(late) - 1) / np.log10(late[-1] / late[0]) if len(late) > 3 else per_decade
    # Ends are whole steps, rounded up.
    assert per == pytest.approx(per_decade, rel=0.05)


class Scripted:
    """An observer whose values are known functions of the time, seen at known times."""

    def __init__(self, signal):
        self.heights = np.linspace(0, 1, 4)
        self.signal = signal
        self.seen = []

    def measure(self, state, evaluation):
        self.seen.append(state.time)
        return self.signal(state.time)

    def mean(self, name, start, end):
        """Integral of the broken line through the samples seen, over the interval."""
        inside = [time for time in self.seen if start <= time <= end]
        assert (inside[0], inside[-1]) == (start, end), "no sample at an end of the interval"
        values = np.array([self.signal(time)[name] for time in inside])
        return np.trapezoid(values, inside, axis=0) / (end - start)


def wavy(time):
    return {
        "stress": np.asarray(np.cos(500 * time)),
        "wall_velocity": np.array([time, -(time**2)]),
        "velocity_profile": np.full(4, np.sin(500 * time)),
    }


def linear(time):
    return {
        "stress": np.asarray(0.3 - 2 * time),
        "wall_velocity": np.array([time, 5.0]),
        "velocity_profile": np.array([1.0, time, -time, 1 + 3 * time]),
    }


class Instant:
    """A state of which only the step and the time matter."""

    def __init__(self, step, time):
        self.step, self.time = step, time


def recorder_of(signal, steps, stride=1, share=20, per_decade=30, longest=1.0):
    """A recorder whose profiles are means over ``share`` steps."""
    given = scenes.parameters(
        recording={
            "stride": stride,
            "profile_interval": share * scenes.parameters().time_stepping.step,
            "samples_per_decade": per_decade,
            "longest_interval": longest,
        }
    )
    observer = Scripted(signal)
    return Recorder(given, steps, None, observer), observer, given.time_stepping.step


def recorded(steps, **recording):
    """A run of equal steps, as the explicit scheme takes them."""
    recorder, observer, time_step = recorder_of(wavy, steps, **recording)
    for step in range(steps + 1):
        recorder.visit(Instant(step, step * time_step), None)
    return recorder.dataset(), observer, time_step


def uneven(recorder, seed):
    """Times of a run whose steps are of any length but end at every stop."""
    random = scenes.generator(seed)
    times = [0.0]
    for stop in recorder.stops:
        between = np.sort(random.uniform(times[-1], stop, random.integers(0, 4)))
        times += [time for time in between if times[-1] < time < stop]
        times.append(float(stop))
    return times


def ended(edges, steps):
    """Edges of intervals with the last one cut off at the end of the stage."""
    return np.union1d(edges, [steps])


def intervals(dataset, name="time"):
    ends = dataset[name].values
    return list(zip(np.append(0.0, ends[:-1]), ends, strict=True))


@given(st.integers(1, 300), st.integers(1, 40), st.floats(0.002, 0.4), st.integers(1, 50))
def test_records_are_the_means_of_their_intervals(steps, per_decade, longest, stride):
    dataset, observer, time_step = recorded(
        steps, per_decade=per_decade, longest=longest, stride=stride
    )
    edges = ended(interval_edges(steps, per_decade, max(round(longest / time_step), 1)), steps)
    assert dataset["time"].values.tolist() == (edges[1:] * time_step).tolist()
    assert dataset["interval"].values == pytest.approx(np.diff(edges) * time_step, rel=1e-9)
    for record, (start, end) in enumerate(intervals(dataset)):
        for name in ("stress", "wall_velocity"):
            wanted = observer.mean(name, start, end)
            assert dataset[name].values[record] == pytest.approx(wanted, rel=1e-11, abs=1e-13)


@given(st.integers(1, 200), st.integers(1, 300), st.integers(1, 50))
def test_profiles_are_the_means_of_equal_shares(steps, share, stride):
    dataset, observer, time_step = recorded(steps, share=share, stride=stride)
    edges = ended(np.arange(0, steps + 1, share), steps)
    assert dataset["profile_time"].values.tolist() == (edges[1:] * time_step).tolist()
    for index, (start, end) in enumerate(intervals(dataset, "profile_time")):
        wanted = observer.mean("velocity_profile", start, end)
        assert dataset["velocity_profile"].values[index] == pytest.approx(wanted, abs=1e-12)


@given(st.integers(1, 300), st.integers(1, 50), st.integers(1, 300))
def test_a_stride_leaves_out_samples_but_no_end_of_an_interval(steps, stride, share):
    dataset, observer, time_step = recorded(steps, stride=stride, share=share)
    ends = np.union1d(dataset["time"].values, dataset["profile_time"].values)
    wanted = np.union1d(ends, np.arange(0, steps + 1, stride) * time_step)
    assert observer.seen == wanted.tolist()


@given(st.integers(1, 200), st.integers(1, 200), st.integers(1, 9), st.integers(0, 2**31))
def test_means_of_linear_signals_are_exact_whatever_the_steps(steps, share, stride, seed):
    recorder, _, _ = recorder_of(linear, steps, share=share, stride=stride)
    for step, time in enumerate(uneven(recorder, seed)):
        recorder.visit(Instant(step, time), None)
    dataset = recorder.dataset()
    for name, axis in (
        ("stress", "time"),
        ("wall_velocity", "time"),
        ("velocity_profile", "profile_time"),
    ):
        for found, (start, end) in zip(dataset[name].values, intervals(dataset, axis), strict=True):
            wanted = linear(0.5 * (start + end))[name]
            # Intervals of one step of 0.002 late in the run cancel two digits of the times.
            assert found == pytest.approx(wanted, rel=1e-10, abs=1e-12)


@given(st.integers(2, 100), st.integers(0, 2**31))
def test_the_last_state_counts_with_half_its_step(steps, seed):
    recorder, _, _ = recorder_of(wavy, steps, share=steps)
    times = uneven(recorder, seed)

    def pulse(time):
        return {"stress": np.asarray(float(time == times[-1])), "velocity_profile": np.zeros(4)}

    recorder._observer.signal = pulse
    for step, time in enumerate(times):
        recorder.visit(Instant(step, time), None)
    dataset = recorder.dataset()
    last = dataset.isel(time=-1)
    wanted = 0.5 * (times[-1] - times[-2]) / float(last["interval"])
    assert float(last["stress"]) == pytest.approx(wanted, rel=1e-12)
    assert not dataset["stress"].values[:-1].any()


@given(st.integers(1, 300), st.floats(0.02, 0.6), st.floats(0.002, 0.4))
def test_stops_are_the_ends_of_all_intervals_and_the_snapshots(steps, share, longest):
    given = scenes.parameters(recording={"profile_interval": share, "longest_interval": longest})
    step = given.time_stepping.step
    snapshots = [0.0, 0.4 * steps * step, steps * step]
    recorder = Recorder(given, steps, None, Scripted(wavy), snapshots)
    assert np.all(np.diff(recorder.stops, prepend=0.0) > 0)
    assert recorder.stops[-1] == steps * step
    units = np.round(recorder.stops / step).astype(int)
    assert recorder.stops.tolist() == (units * step).tolist(), "not a multiple to the last bit"
    edges = interval_edges(steps, 30, max(round(longest / step), 1))
    assert set(edges[1:]) <= set(units)
    assert round(0.4 * steps) in {0, *units}
    assert len(units) <= len(edges) - 1 + steps // round(share / step) + 2


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


def test_strain_is_the_wall_displacement_over_the_height(sheared, smooth):
    """Over one explicit step it grows by the rate at its start: so do the means of both ends."""
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
    dataset = hydrodynamics.shear(aged, given)
    assert dataset["snapshot_time"].values == pytest.approx(times, abs=1e-12)
    nodes = dataset["node_position"].values
    count = aged.sizes["node"]
    assert nodes.shape == (3, count + 2 * dataset.attrs["wall_nodes"], 2)
    assert np.array_equal(nodes[0, :count], aged["node_position"].values)
    assert np.abs(nodes[1] - nodes[0]).max() > 1e-6
    assert dataset["velocity"].dims == ("snapshot", "field_y", "field_x", "axis")


def test_snapshot_velocity_is_the_fluid_velocity_at_its_points(aged):
    given = scenes.parameters(rheometer={"stress": 0.5}, recording={"snapshots": [0.0]})
    dataset = hydrodynamics.shear(aged, given)
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


def forbid(monkeypatch, *places):
    """Make functions fail where they are called."""
    for place, name in places:

        def fail(*given, name=name, **named):
            raise AssertionError(f"{name} was called")

        monkeypatch.setattr(place, name, fail)


def test_a_run_without_snapshots_or_a_bulk_works_out_no_field_and_fits_no_line(aged, monkeypatch):
    """What is recorded besides is the same, to the last bit."""
    drive = {"rheometer": {"stress": 0.5}}
    full = scenes.parameters(**drive, recording={"snapshots": [0.0, 0.1], "bulk_margin": 3.0})
    bare = scenes.parameters(**drive, recording={"bulk_margin": None})
    recorded = hydrodynamics.shear(aged, full)
    forbid(monkeypatch, (Suspension, "velocities_at"), (Recorder, "_snapshot"), (np, "polyfit"))
    fields = scenes.parameters(**drive, recording={"snapshots": [0.0], "bulk_margin": None})
    for asked, work in ((full, "polyfit"), (fields, "_snapshot")):
        with pytest.raises(AssertionError, match=f"{work} was called"):
            hydrodynamics.shear(aged, asked)
    without = hydrodynamics.shear(aged, bare)
    shots = {"velocity", "node_position", "snapshot_time"}
    bulk = {"shear_rate_bulk", "slip_velocity", "slip_velocity_wall"}
    assert set(recorded.data_vars) - set(without.data_vars) == shots | bulk
    for name in without.data_vars:
        assert without[name].values.tobytes() == recorded[name].values.tobytes(), name


def test_ageing_measures_nothing_but_its_end(foam, monkeypatch):
    seen = []
    measure = Observer.measure

    def spy(self, state, evaluation):
        seen.append(state.time)
        return measure(self, state, evaluation)

    monkeypatch.setattr(Observer, "measure", spy)
    given = scenes.parameters(time_stepping={"ageing_time": 0.02})
    hydrodynamics.age(foam, given)
    assert seen == pytest.approx([0.02])
