"""Shear runs made up from known laws, in the schema that the shear stage writes."""

import math

import numpy as np
import xarray as xr
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import Voronoi

from softslip.config.parameters import Parameters
from softslip.simulation.sample import wall_contour

YIELD_STRESS, CONSISTENCY, FLOW_INDEX = 0.055, 0.6, 0.57
HEIGHT, LENGTH, RADIUS, RESOLUTION = 0.125, 0.0625, 0.00846, 2048


def generator(*key):
    return np.random.default_rng(np.random.SeedSequence(key))


def red_noise(count, memory, random):
    """AR(1) noise of variance 1 whose correlation decays by e in ``memory`` steps."""
    keep = math.exp(-1 / memory)
    shocks = random.standard_normal(count) * math.sqrt(1 - keep**2)
    shocks[0] = random.standard_normal()
    out = np.empty(count)
    out[0] = shocks[0]
    for i in range(1, count):
        out[i] = keep * out[i - 1] + shocks[i]
    return out


def record_ends(duration, first=0.01, per_decade=30, longest=1.0):
    ends = [first]
    while ends[-1] < duration * (1 - 1e-9):
        width = min(max(first, ends[-1] * (10 ** (1 / per_decade) - 1)), longest)
        ends.append(min(ends[-1] + width, duration))
    return np.array(ends)


def steady_rate(stress):
    return (max(stress - YIELD_STRESS, 0.0) / CONSISTENCY) ** (1 / FLOW_INDEX)


def yielding_time_of(stress):
    return 17.5 * ((stress - YIELD_STRESS) / 0.445) ** -1.3


def bulk_rate(stress, time):
    """Creep t^-0.7 that yields near the paper's time, or goes on for ever below yield."""
    creep = 0.08 * stress * (time + 0.02) ** -0.7
    if stress <= YIELD_STRESS:
        return creep
    return creep + steady_rate(stress) / (1 + (yielding_time_of(stress) / time) ** 3)


def slip_rate(stress, roughness, time):
    """Slip velocity: strong at smooth walls, suppressed by a factor 20 beyond β = 0.3."""
    factor = 1.0 if roughness < 0.3 else 0.05
    late = 0.004 * stress if stress <= YIELD_STRESS else 0.02 * (stress - YIELD_STRESS)
    return factor * late * (0.05 + 0.95 / (1 + (3.0 / time) ** 2))


def parameters(stress=0.3, roughness=0.0, seed=1, snapshots=(), duration=600.0, height=HEIGHT):
    return Parameters.from_mapping(
        {
            "channel": {"length": LENGTH, "height": height, "outer_gap": 0.03125},
            "wall": {"roughness": roughness},
            "rheometer": {"stress": stress},
            "hydrodynamics": {"resolution": RESOLUTION},
            "time_stepping": {"shear_time": duration},
            "recording": {"snapshots": list(snapshots)},
            "seed": seed,
        }
    )


def series(time, interval, rate, slip, height):
    """The variables along time that follow from a bulk rate and a slip velocity."""
    wall = rate + 2 * slip / height
    half = 0.5 * height * wall
    rate_unit, speed_unit = "1 / time unit", "length unit / time unit"
    columns = {
        "interval": (interval, "time unit"),
        "shear_rate_wall": (wall, rate_unit),
        "shear_rate_bulk": (rate, rate_unit),
        "slip_velocity": (slip, speed_unit),
        "strain": (np.cumsum(wall * interval), "1"),
        "stress_deviation": (np.full_like(time, 1e-3), "1"),
        "area_deviation": (np.full_like(time, 1e-5), "1"),
        "film_thickness": (np.full_like(time, 8e-4), "length unit"),
    }
    dataset = xr.Dataset(
        {
            name: ("time", values, {"units": unit, "long_name": name.replace("_", " ")})
            for name, (values, unit) in columns.items()
        },
        coords={"time": ("time", time, {"units": "time unit", "long_name": "end of interval"})},
    )
    pair = {"units": speed_unit, "long_name": "velocity of each wall"}
    dataset["wall_velocity"] = ("time", "wall"), np.stack((-half, half), axis=1), pair
    dataset["slip_velocity_wall"] = ("time", "wall"), np.stack((slip, slip), axis=1), pair
    return dataset.assign_coords(wall=[0, 1])


def profile(y, rate, slip, height):
    """Linear in the bulk, with the slip spread over a thin film and a fluidised layer."""
    depth = np.minimum(y, height - y)
    near = 0.7 * np.exp(-((depth / 1.2e-3) ** 2)) + 0.3 * np.exp(-depth / 8e-3)
    return rate * (y - height / 2) + slip * near * np.sign(y - height / 2)


def with_profiles(run, count, height):
    end = float(run["time"][-1])
    ends = end * np.arange(1, count + 1) / count
    y = np.arange(round(height * RESOLUTION) + 1) / RESOLUTION
    starts = ends - end / count
    time, rows = run["time"].values, []
    for start, stop in zip(starts, ends, strict=True):
        inside = (time > start) & (time <= stop)
        weight = run["interval"].values[inside]
        rate = np.average(run["shear_rate_bulk"].values[inside], weights=weight)
        slip = np.average(run["slip_velocity"].values[inside], weights=weight)
        rows.append(profile(y, rate, slip, height))
    unit = {"units": "length unit / time unit", "long_name": "velocity profile"}
    return (
        run.assign(velocity_profile=(("profile", "wall_distance"), np.array(rows), unit))
        .assign(_end=("profile", ends))
        .rename(_end="profile_time")
        .assign_coords(
            wall_distance=("wall_distance", y, {"units": "length unit", "long_name": "distance"})
        )
    )


def packing(given, random):
    """Rounded cells that fill the channel and wrap around in x: contours of shape (nodes, 2)."""
    contour = wall_contour(given)
    height, bump = given.channel.height, contour.bump_radius
    low, spacing = bump, 2.0 * RADIUS
    columns = round(LENGTH / spacing)
    rows = max(round((height - 2 * low) / (0.87 * spacing)), 2)
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    sites = np.empty((len(grid), 2))
    sites[:, 0] = (grid[:, 0] + 0.5 * (grid[:, 1] % 2) + 0.25) * LENGTH / columns
    sites[:, 1] = low + (grid[:, 1] + 0.5) * (height - 2 * low) / rows
    sites += 0.22 * spacing * random.uniform(-1, 1, sites.shape)
    mirrored = np.concatenate(
        [
            np.stack((sites[:, 0] + shift * LENGTH, y), axis=1)
            for shift in (0, -1, 1)
            for y in (sites[:, 1], 2 * low - sites[:, 1], 2 * (height - low) - sites[:, 1])
        ]
    )
    cells = Voronoi(mirrored)
    contours = []
    for number in range(len(sites)):
        corners = cells.vertices[cells.regions[cells.point_region[number]]]
        middle = corners.mean(axis=0)
        corners = corners[np.argsort(np.arctan2(*(corners - middle).T[::-1]))]
        closed = np.concatenate((corners, corners[:1]))
        along = np.concatenate(([0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))))
        at = np.linspace(0, along[-1], 120, endpoint=False)
        outline = np.stack([np.interp(at, along, closed[:, axis]) for axis in (0, 1)], axis=1)
        smooth = gaussian_filter1d(outline, 4, axis=0, mode="wrap")
        contours.append(middle + 0.96 * (smooth - middle))
    return contours


def with_snapshots(run, given, times):
    random = generator(given.seed, 7)
    height, contour = given.channel.height, wall_contour(given)
    lower = contour.points(300)
    nodes, fields, sizes = [], [], []
    x = np.linspace(0, LENGTH, 30, endpoint=False)
    y = np.linspace(0, height, 60)
    for time in times:
        membranes = packing(given, random)
        sizes = [len(each) for each in membranes]
        drift = 0.37 * LENGTH
        walls = [lower - [drift, 0], np.column_stack((lower[:, 0] + drift, height - lower[:, 1]))]
        nodes.append(np.concatenate([*membranes, *walls]))
        at = int(np.argmin(np.abs(run["time"].values - time)))
        rate = float(run["shear_rate_bulk"][at])
        flow = profile(y, rate, float(run["slip_velocity"][at]), height)
        phase = random.uniform(0, 2 * np.pi, 4)
        swirl = [
            np.sin(2 * np.pi * x[None, :] / LENGTH + phase[0])
            * np.sin(np.pi * y[:, None] / height * 3)
            + np.sin(4 * np.pi * x[None, :] / LENGTH + phase[1])
            * np.sin(np.pi * y[:, None] / height * 5),
            np.sin(2 * np.pi * x[None, :] / LENGTH + phase[2])
            * np.sin(np.pi * y[:, None] / height * 2),
        ]
        field = 0.06 * rate * height * np.stack(swirl, axis=-1)
        field[..., 0] += flow[:, None]
        fields.append(field)
    length, speed = {"units": "length unit"}, {"units": "length unit / time unit"}
    return (
        run.assign(
            snapshot_time=("snapshot", np.array(times), {"units": "time unit"}),
            node_position=(("snapshot", "node", "axis"), np.array(nodes), length),
            nodes_per_particle=("particle", sizes),
            velocity=(("snapshot", "field_y", "field_x", "axis"), np.array(fields), speed),
        )
        .assign_coords(field_x=("field_x", x, length), field_y=("field_y", y, length))
        .assign_attrs(wall_nodes=len(lower))
    )


def shear_run(stress=0.3, roughness=0.0, seed=1, *, duration=600.0, noise=0.1, **options):
    """A run whose steady rates, slip and yielding time are known.

    Parameters
    ----------
    noise
        Relative standard deviation of the series.
    options
        ``snapshots`` (times), ``height``, ``profiles``.
    """
    height, times = options.get("height", HEIGHT), options.get("snapshots", ())
    given = parameters(stress, roughness, seed, times, duration, height)
    ends = record_ends(duration)
    interval = np.diff(np.concatenate(([0.0], ends)))
    middle = ends - 0.5 * interval
    random = generator(seed, round(1e6 * stress), round(1e6 * roughness))
    fluctuation = [1 + noise * red_noise(len(ends), 2.0, random) for _ in range(2)]
    rate = bulk_rate(stress, middle) * fluctuation[0]
    slip = slip_rate(stress, roughness, middle) * fluctuation[1]
    run = series(ends, interval, rate, slip, height)
    run["stress"] = "time", np.full_like(ends, stress), {"units": "stress unit"}
    run = with_profiles(run, options.get("profiles", 20), height)
    if times:
        run = with_snapshots(run, given, times)
    return run.assign_attrs(
        parameters=given.model_dump_json(),
        run=f"s{stress:g}-b{roughness:g}-{seed}",
        stage="shear",
        parent="aged",
        mean_radius=RADIUS,
        area_fraction=0.84,
        particles=28,
    )


def sweep(stresses, roughnesses=(0.0,), seeds=(1,), missing=(), **options):
    """Labelled runs over a full grid, with None at the (stress, roughness, seed) missing."""
    return [
        (
            {"stress": stress, "roughness": roughness, "seed": seed},
            None
            if (stress, roughness, seed) in missing
            else shear_run(stress, roughness, seed, **options),
        )
        for stress in stresses
        for roughness in roughnesses
        for seed in seeds
    ]
