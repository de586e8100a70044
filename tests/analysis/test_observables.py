import json
import math

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import (
    HEIGHT,
    bulk_rate,
    generator,
    parameters,
    profile,
    record_ends,
    red_noise,
    series,
    shear_run,
    slip_rate,
    steady_rate,
    sweep,
)

from softslip.analysis.observables import (
    collect,
    heterogeneity,
    mean_over_seeds,
    mean_profile,
    non_affine_velocity,
    slip_lengths,
    slip_time,
    steady_state,
    yielding_time,
)
from softslip.analysis.observables.correlation import MeanEstimate
from softslip.analysis.observables.series import interval_means, record_edges
from softslip.analysis.observables.smoothed_series import NoisySeries, sharp
from softslip.analysis.observables.tables import creep, flow_curve, profiles
from softslip.errors import DatasetError


def run_of(rate, slip=None, longest=1.0):
    """A run with the given bulk rate as a function of time, sampled at the middle of records."""
    ends = record_ends(400.0, longest=longest)
    interval = np.diff(np.concatenate(([0.0], ends)))
    middle = ends - 0.5 * interval
    values = rate(middle)
    run = series(ends, interval, values, np.zeros_like(ends) if slip is None else slip(middle), 0.1)
    run["stress"] = "time", np.full_like(ends, 0.3), {"units": "stress unit"}
    given_parameters = parameters(height=0.125).model_dump_json()
    return run.assign_attrs(run="made up", stage="shear", parameters=given_parameters)


def share_steady(shape, noise, memory, repeats=60):
    def rate(number):
        random = generator(number, round(100 * noise), memory)
        return lambda time: shape(time) * (1 + noise * red_noise(len(time), memory, random))

    flags = [bool(steady_state(run_of(rate(n)))["steady_bulk"]) for n in range(repeats)]
    return float(np.mean(flags))


def test_stationary_noise_is_called_steady():
    found = share_steady(np.ones_like, 0.1, 3)
    assert found >= 0.85, f"only {found:.0%} of stationary series are called steady, 94 % expected"


@pytest.mark.parametrize(
    ("name", "shape", "limit"),
    [
        ("power-law creep", lambda t: (t + 0.1) ** -0.5, 0.02),
        ("relaxation over half the run", lambda t: 1 + np.exp(-t / 200), 0.15),
        ("relaxation over the run", lambda t: 1 + np.exp(-t / 400), 0.15),
    ],
)
def test_unfinished_transients_are_not_called_steady(name, shape, limit):
    found = share_steady(shape, 0.1, 3)
    assert found <= limit, f"{found:.0%} of series of {name} are called steady, limit {limit:.0%}"


def test_finished_transient_is_cut_off():
    random = generator(1)
    run = run_of(lambda t: (1 + 3 * np.exp(-t / 15)) * (1 + 0.05 * red_noise(len(t), 2, random)))
    found = steady_state(run)
    mean, error = float(found["shear_rate_bulk"]), float(found["shear_rate_bulk_error"])
    assert bool(found["steady_bulk"])
    assert abs(mean - 1) < 4 * error, f"mean {mean:.4f} is {abs(mean - 1) / error:.1f} errors off"
    assert 15 < float(found["steady_from"]) < 200


def test_error_of_the_mean_covers_correlated_noise():
    deviations = []
    for number in range(150):
        random = generator(number, 5)
        run = run_of(lambda t, r=random: 1 + 0.1 * red_noise(len(t), 5, r))
        found = steady_state(run)
        deviations.append(float((found["shear_rate_bulk"] - 1) / found["shear_rate_bulk_error"]))
    covered = np.mean(np.abs(deviations) < 1)
    assert 0.50 < covered < 0.80, f"one standard error covers {covered:.0%} of means, not 68 %"


def test_too_short_a_window_is_not_steady():
    assert not bool(steady_state(run_of(np.ones_like, longest=30.0))["steady"])
    assert bool(steady_state(run_of(np.ones_like, longest=5.0))["steady"])


def test_unsteady_error_spans_the_drift_of_the_last_half():
    found = steady_state(run_of(lambda t: 2 - t / 400))
    assert not bool(found["steady_bulk"])
    assert float(found["shear_rate_bulk"]) == pytest.approx(1.25, rel=5e-3)
    assert float(found["shear_rate_bulk_error"]) == pytest.approx(0.25, rel=0.02)
    assert float(found["shear_rate_bulk_drift"]) == pytest.approx(-0.4, rel=0.02)


def test_apparent_rate_is_bulk_rate_plus_slip():
    found = steady_state(shear_run(0.5, 0.0, duration=400.0))
    assert bool(found["steady"])
    expected = found["shear_rate_bulk"] + 2 * found["slip_velocity"] / HEIGHT
    off = float(abs(found["shear_rate_wall"] / expected - 1))
    assert off < 1e-12, f"Eq. A1 is off by {off:.1e}"


def test_run_without_bulk_is_judged_by_its_walls():
    run = shear_run(0.5, 0.0, duration=200.0).drop_vars(["shear_rate_bulk", "slip_velocity"])
    found = steady_state(run)
    assert bool(found["steady"])
    assert bool(found["steady_wall"])
    assert not bool(found["steady_bulk"])
    assert math.isnan(float(found["shear_rate_bulk"]))
    assert not bool(yielding_time(run)["yielded"])
    assert math.isnan(float(slip_time(run)["slip_time"]))


def test_slip_below_yield_is_steady_though_the_bulk_creeps():
    found = steady_state(shear_run(0.05, 0.0, duration=600.0, noise=0.03))
    flags = {name: bool(found[f"steady_{name}"]) for name in ("wall", "bulk", "slip")}
    assert flags == {"wall": True, "bulk": False, "slip": True}
    assert not bool(found["steady"])


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0.01, 399.9), min_size=2, max_size=12, unique=True))
def test_rebinning_conserves_the_integral(edges):
    run = run_of(lambda t: 1 + np.sin(t))
    grid = np.array([0.0, *sorted(edges), 400.0])
    total = float(np.sum(interval_means(run, "shear_rate_bulk", grid) * np.diff(grid)))
    exact = float((run["shear_rate_bulk"] * run["interval"]).sum())
    assert total == pytest.approx(exact, rel=1e-9)


def test_rebinning_beyond_the_run_is_unknown():
    run = run_of(np.ones_like)
    means = interval_means(run, "wall_velocity", np.array([0.0, 200.0, 400.0, 500.0]))
    assert means.shape == (3, 2)
    assert np.isfinite(means[:2]).all()
    assert np.isnan(means[2]).all()
    assert record_edges(run)[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("stress", [0.15, 0.3, 0.5])
def test_yielding_time_is_that_of_the_least_bulk_rate(stress):
    time = np.geomspace(0.1, 400, 20000)
    exact = time[np.argmin(bulk_rate(stress, time))]
    found = yielding_time(shear_run(stress, duration=600.0))
    off = abs(float(found["yielding_time"]) - exact)
    error = float(found["yielding_time_error"])
    assert bool(found["yielded"])
    assert off < max(2 * error, 0.1 * exact), f"{off:.2f} off {exact:.2f}, with error {error:.2f}"


def test_the_window_displaces_the_time_of_yielding_by_less_than_a_gaussian_one():
    ends = record_ends(400.0, longest=0.1)
    edges = np.concatenate(([0.0], ends))
    middle = 0.5 * (edges[1:] + edges[:-1])
    flowing = 1 / (1 + (middle / 40) ** -4)
    rate = 0.2 * (middle / 40) ** -0.7 * (1 - flowing) + flowing
    made_up = NoisySeries(edges, rate, MeanEstimate(1.0, 0.01, 50.0), np.zeros((len(rate), 1)))
    exact, sharper, smooth = (
        float(middle[np.argmin(each)])
        for each in (rate, made_up.smoothed(0.1, sharp), made_up.smoothed(0.1))
    )
    assert exact - smooth > 0.04 * exact
    assert abs(sharper - exact) < 0.8 * (exact - smooth)


def test_times_are_told_with_their_sensitivity_to_smoothing():
    run = shear_run(0.3, duration=600.0, noise=0.05)
    for name, function in (("yielding_time", yielding_time), ("slip_time", slip_time)):
        found = function(run)
        time, change = float(found[name]), float(found[f"{name}_smoothing"])
        assert found[f"{name}_smoothing"].attrs["units"] == "time unit"
        assert 0 < change < 0.5 * time, f"{name} {time:.3g} changes by {change:.3g}"
    never = yielding_time(shear_run(0.05, 0.59, 1, duration=600.0))
    assert math.isnan(float(never["yielding_time_smoothing"]))


@pytest.mark.parametrize("seed", range(8))
def test_creep_has_no_yielding_time(seed):
    found = yielding_time(shear_run(0.05, 0.59, seed, duration=600.0))
    assert not bool(found["yielded"]), f"yields at {float(found['yielding_time']):.3g}"
    assert math.isnan(float(found["yielding_time"]))


def test_slip_time_is_that_of_half_the_steady_slip():
    time = np.geomspace(0.1, 400, 20000)
    slip = slip_rate(0.3, 0.0, time)
    exact = float(time[np.argmax(slip >= 0.5 * slip[-1])])
    found = [slip_time(shear_run(0.3, 0.0, n, duration=600.0, profiles=2)) for n in range(10)]
    times = np.array([float(each["slip_time"]) for each in found])
    errors = np.array([float(each["slip_time_error"]) for each in found])
    off = np.abs(times - exact)
    assert off.max() < 0.35 * exact, f"up to {off.max():.2f} off {exact:.2f}"
    covered = np.mean(off < errors)
    assert covered >= 0.4, f"the error covers {covered:.0%} of slip times"


@pytest.mark.parametrize("highest", [0.4, 0.8, 1.5])
def test_an_elastic_jump_is_not_the_onset_of_slip(highest):
    run = shear_run(0.3, 0.0, 1, duration=600.0, profiles=2, noise=0.02)
    slip = run["slip_velocity"]
    since = run["time"] / 0.1
    jump = highest * slip[-1] * since * np.exp(1 - since)
    before, after = (
        float(slip_time(each)["slip_time"]) for each in (run, run.assign(slip_velocity=slip + jump))
    )
    assert after == pytest.approx(before, rel=0.05)


def test_a_lull_of_steady_slip_is_not_its_onset():
    run = shear_run(0.3, 0.0, 1, duration=600.0, profiles=2, noise=0.02)
    lull = (run["time"] > 250) & (run["time"] < 300)
    calm = run.assign(slip_velocity=run["slip_velocity"] * np.where(lull, 0.1, 1.0))
    before, after = (float(slip_time(each)["slip_time"]) for each in (run, calm))
    assert after == pytest.approx(before, rel=0.1)


def test_profile_is_normalised_by_the_wall_speeds():
    run = shear_run(0.5, 0.0, duration=200.0, noise=0.02)
    found = mean_profile(run)
    y = found["wall_distance"].values
    rate, slip = steady_rate(0.5), slip_rate(0.5, 0.0, 200.0)
    speed = rate * HEIGHT + 2 * slip
    expected = profile(y, rate, slip, HEIGHT) / speed + 0.5
    off = float(np.abs(found["normalised_velocity"].values - expected).max())
    assert off < 0.01, f"normalised velocity is off by {off:.4f}"
    assert int(found["profiles_used"]) >= 10
    assert found["normalised_position"].values[[0, -1]] == pytest.approx([0, 1])


def test_profile_at_rest_is_unknown_not_an_error():
    run = shear_run(0.05, duration=50.0)
    still = run.assign(wall_velocity=run["wall_velocity"] * 0)
    assert np.isnan(mean_profile(still)["normalised_velocity"]).all()


def test_affine_field_has_no_non_affine_velocity():
    run = shear_run(0.3, 0.59, snapshots=(20.0,), duration=60.0)
    y = run["field_y"]
    affine = xr.zeros_like(run["velocity"])
    affine[..., 0] = (0.7 * y + 0.1).broadcast_like(affine[..., 0])
    found = non_affine_velocity(run.assign(velocity=affine), 0)
    assert float(found["shear_rate_bulk"]) == pytest.approx(0.7)
    assert float(abs(found["non_affine_velocity"]).max()) < 1e-12
    assert float(found["heterogeneity"]) < 1e-12


def test_heterogeneity_is_the_rms_of_eq_30():
    run = shear_run(0.3, snapshots=(1.0,), duration=60.0)
    y, x = run["field_y"].values, run["field_x"].values
    amplitude, rate = 0.01, 0.7
    wave = amplitude * np.sin(2 * np.pi * x / 0.0625)[None, :] * np.ones_like(y)[:, None]
    field = np.stack((rate * y[:, None] + wave, np.zeros_like(wave)), axis=-1)[None]
    found = heterogeneity(run.assign(velocity=(run["velocity"].dims, field)))
    assert int(found["snapshots_used"]) == 0
    late = run.assign_coords(snapshot_time=("snapshot", [59.0]))
    found = heterogeneity(late.assign(velocity=(run["velocity"].dims, field)))
    expected = amplitude / math.sqrt(2) / (rate * HEIGHT)
    assert float(found["heterogeneity"]) == pytest.approx(expected, rel=1e-9)


def test_a_film_of_solvent_is_found_below_noise():
    run = shear_run(0.5, 0.0, duration=400.0, noise=0.02)
    y, film, layer = run["wall_distance"].values, 1.2e-3, 2.0
    depth = np.minimum(y, HEIGHT - y)
    rate = 0.5  # Of the film: stress over viscosity.
    inside = np.where(depth < film, rate * depth, rate * film + layer / 100 * (depth - film))
    half = rate * film + layer / 100 * (0.5 * HEIGHT - film)
    exact = np.where(y < HEIGHT / 2, inside - half, half - inside)
    random = generator(3)
    noisy = exact + 0.02 * half * random.standard_normal((run.sizes["profile"], len(y)))
    still = run.assign(velocity_profile=(run["velocity_profile"].dims, noisy))
    still["wall_velocity"][:] = [-half, half]
    found = slip_lengths(still)
    length, error = (float(found[f"newtonian_slip_length{end}"]) for end in ("", "_error"))
    assert error < 0.15 * film
    assert abs(length - film) < 4 * error, f"{length:.3e} ± {error:.1e}, truth {film:.3e}"


def test_total_slip_length_is_slip_over_bulk_rate():
    found = slip_lengths(shear_run(0.5, 0.0, duration=400.0, noise=0.05))
    expected = slip_rate(0.5, 0.0, 300.0) / bulk_rate(0.5, 300.0)
    length, error = (float(found[f"total_slip_length{end}"]) for end in ("", "_error"))
    assert error < 0.05 * expected
    assert abs(length - expected) < 4 * error, f"{length:.3e} ± {error:.1e}, truth {expected:.3e}"
    creep = slip_lengths(shear_run(0.05, 0.0, duration=400.0))
    assert math.isnan(float(creep["total_slip_length"]))


def test_missing_snapshot_and_bulk_are_named():
    run = shear_run(0.3, snapshots=(20.0,), duration=60.0)
    with pytest.raises(DatasetError, match="has 1 snapshots, so there is none of number 1"):
        non_affine_velocity(run, 1)
    bare = json.loads(run.attrs["parameters"])
    bare["recording"]["bulk_margin"] = None
    with pytest.raises(DatasetError, match=r"recording\.bulk_margin"):
        non_affine_velocity(run.assign_attrs(parameters=json.dumps(bare)), 0)
    with pytest.raises(DatasetError, match="'parameters' cannot be read"):
        steady_state(run.drop_attrs())


STRESSES, ROUGHNESSES, GAP = (0.05, 0.2, 0.5), (0.0, 0.59), (0.2, 0.59, 2)


@pytest.fixture(scope="module")
def runs():
    return sweep(STRESSES, ROUGHNESSES, (1, 2), missing={GAP}, duration=300.0, noise=0.05)


@pytest.fixture(scope="module")
def curve(runs):
    return flow_curve(runs)


def test_table_has_a_dimension_for_each_label_and_a_gap_for_each_missing_run(curve):
    assert dict(curve.sizes) == {"stress": 3, "roughness": 2, "seed": 2}
    missing = curve["status"] == "missing"
    assert int(missing.sum()) == 1
    place = {"stress": 0.2, "roughness": 0.59, "seed": 2}
    assert bool(missing.sel(place))
    assert math.isnan(float(curve["shear_rate_wall"].sel(place)))
    assert not bool(curve["steady"].sel(place))
    assert curve["stress"].attrs["units"] == "stress unit"


def test_every_variable_has_unit_and_meaning(curve, runs):
    for table in (curve, creep(runs), profiles(runs), mean_over_seeds(curve)):
        for name, variable in {**table.data_vars, **table.coords}.items():
            assert {"units", "long_name"} <= set(variable.attrs), f"{name} lacks them"


def test_order_of_runs_does_not_matter(curve, runs):
    xr.testing.assert_identical(flow_curve(runs[::-1]), curve)


def test_labels_may_be_strings():
    table = collect(
        [
            ({"wall": kind, "n": n}, shear_run(0.3, duration=5.0, profiles=2))
            for kind in "ba"
            for n in (2, 1)
        ],
        lambda run: xr.Dataset({"end": float(run["time"][-1])}),
    )
    assert table["wall"].values.tolist() == ["a", "b"]
    assert table["n"].values.tolist() == [1, 2]


def test_contradictory_tables_are_refused():
    run = shear_run(0.3, duration=5.0, profiles=2)
    for pairs, words in (
        ([({"a": 1}, None)], "none of 1 runs is done"),
        ([({"a": 1}, run), ({"b": 1}, run)], "label all alike"),
        ([({"a": 1}, run), ({"a": 1}, run)], "same swept values"),
    ):
        with pytest.raises(DatasetError, match=words):
            flow_curve(pairs)


def test_creep_table_keeps_the_integral_and_ends_with_each_run():
    short, long = shear_run(0.3, duration=50.0), shear_run(0.3, seed=2, duration=100.0)
    table = creep([({"seed": 1}, short), ({"seed": 2}, long)])
    assert np.isnan(table["shear_rate_wall"].sel(seed=1).values[-1])
    known = table["shear_rate_wall"].sel(seed=2)
    assert np.isfinite(known).all()
    assert (np.diff(table["time"]) > 0).all()


def test_one_seed_keeps_its_own_error(curve):
    mean = mean_over_seeds(curve)
    place = {"stress": 0.2, "roughness": 0.59}
    for name in ("shear_rate_wall", "shear_rate_wall_error"):
        alone = float(curve[name].sel(place | {"seed": 1}))
        assert float(mean[name].sel(place)) == pytest.approx(alone)
    assert int(mean["runs_done"].sel(place)) == 1
    assert int(mean["runs"].sel(place)) == 2


def test_same_input_gives_the_same_bytes(runs, curve):
    xr.testing.assert_identical(flow_curve(runs), curve)
