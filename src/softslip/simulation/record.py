"""What a run writes down: interval means of the observables, profiles and snapshots (Sec. III)."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from softslip.config.parameters import Parameters
from softslip.files.quantities import described
from softslip.simulation.arrays import below, under
from softslip.simulation.observer import Observer, Sample
from softslip.solver.geometry import FloatArray, IntArray
from softslip.solver.state import State
from softslip.solver.suspension import Evaluation, Suspension


def interval_edges(steps: int, per_decade: int, longest: int) -> IntArray:
    """Return the steps at which record intervals end, from 0 on: those up to ``steps``.

    The ends grow geometrically, ``per_decade`` to a decade, until intervals reach ``longest``
    steps, and are its multiples from there on. They do not depend on ``steps``, so that a longer
    run records the same, and one that ends at a multiple of ``longest`` ends with a whole record.
    """
    edges, end = list[int](), 0
    while end <= steps:
        edges.append(end)
        width = max(int(np.ceil(end * 10 ** (1 / per_decade))) - end, 1)
        end = end + width if width < longest else (end // longest + 1) * longest
    return np.array(edges, dtype=np.int64)


def _rows(memory: Sample, name: str, most: int) -> list[Sample]:
    """Return the rows of a table that was stored by columns."""
    columns = below(memory, name)
    count = int(columns.pop("count"))
    if not 0 <= count <= most or any(len(column) != count for column in columns.values()):
        raise ValueError(f"{name} has rows of {count} of {most}, or columns of other lengths")
    return [
        {key: np.asarray(column[row]) for key, column in columns.items()} for row in range(count)
    ]


class _Mean:
    """Time average of samples since the last `take`, by the trapezoidal rule.

    Attributes
    ----------
    time
        Of the latest sample.
    """

    def __init__(self) -> None:
        self._start = self.time = 0.0
        self._last: Sample = {}
        self._integral: Sample = {}

    def add(self, time: float, sample: Sample) -> None:
        if self._last:
            half = 0.5 * (time - self.time)
            for name, value in sample.items():
                area = half * (self._last[name] + value)
                self._integral[name] = self._integral.get(name, 0.0) + area
        self.time, self._last = time, sample

    def memory(self) -> Sample:
        """Return all that the average needs to resume, as arrays by name."""
        times = {"times": np.array([self._start, self.time])}
        return times | under("last", self._last) | under("integral", self._integral)

    def restore(self, memory: Sample) -> None:
        """Resume from a `memory`."""
        self._start, self.time = (float(time) for time in memory["times"])
        self._last, self._integral = below(memory, "last"), below(memory, "integral")

    def take(self) -> Sample:
        means = self.means()
        self._start, self._integral = self.time, {}
        return means

    def means(self) -> Sample:
        """Return the averages since the last `take`, none where no time has passed."""
        width = self.time - self._start
        return {name: area / width for name, area in self._integral.items()}


def _with_rest(
    rows: list[Sample], edges: FloatArray, mean: _Mean
) -> tuple[list[Sample], FloatArray]:
    """Return rows with the edges of their intervals, with a last one that the end has cut off."""
    edges, rest = edges[: len(rows) + 1], mean.means()
    if not rest:
        return rows, edges
    return [*rows, rest], np.append(edges, np.float64(mean.time))


class Recorder:
    """Collects interval means, profiles and snapshots of one stage.

    The intervals do not depend on how long the stage is, but that its end cuts off the last ones.

    Parameters
    ----------
    parameters
        Of the run.
    steps
        Number of steps of the stage.
    suspension
        Evaluates the velocity fields of snapshots.
    observer
        Measures the samples.
    snapshots
        Times of the snapshots [time unit].

    Attributes
    ----------
    edges
        Ends of the records from 0 on, but for one that the end of the stage cuts off, shape
        (records + 1,) [time unit].
    stops
        Times that steps must end at, shape (stops,) [time unit].
    """

    def __init__(
        self,
        parameters: Parameters,
        steps: int,
        suspension: Suspension,
        observer: Observer,
        snapshots: Sequence[float] = (),
    ) -> None:
        recording, unit = parameters.recording, parameters.time_stepping.step
        longest = max(round(recording.longest_interval / unit), 1)
        edges = interval_edges(steps, recording.samples_per_decade, longest)
        share = max(round(recording.profile_interval / unit), 1)
        profile_edges = np.arange(0, steps + 1, share, dtype=np.int64)
        shots = np.minimum(np.round(np.asarray(snapshots) / unit).astype(np.int64), steps)
        self.edges = np.asarray(edges * unit, dtype=np.float64)
        self._profile_edges = np.asarray(profile_edges * unit, dtype=np.float64)
        self._snapshot_times = set((shots * unit).tolist())
        stops = np.union1d(np.union1d(edges, profile_edges), np.append(shots, steps))
        self.stops: FloatArray = stops[stops > 0] * unit
        self._end = steps * unit
        self._stride = recording.stride
        self._spacing = recording.field_spacing * parameters.suspension.mean_radius
        self._suspension = suspension
        self._observer = observer
        self._mean, self._profile = _Mean(), _Mean()
        self._records: list[Sample] = []
        self._profiles: list[Sample] = []
        self._snapshots: list[Sample] = []

    def visit(self, state: State, evaluation: Evaluation) -> None:
        """Record a state; call with every state of the stage in order."""
        time = state.time
        record_ends = time in self.edges[len(self._records) + 1 :][:1]
        profile_ends = time in self._profile_edges[len(self._profiles) + 1 :][:1]
        if state.step % self._stride == 0 or record_ends or profile_ends or time == self._end:
            values = self._observer.measure(state, evaluation)
            self._profile.add(time, {"velocity_profile": values.pop("velocity_profile")})
            self._mean.add(time, values)
        if record_ends:
            self._records.append(self._mean.take())
        if profile_ends:
            self._profiles.append(self._profile.take())
        if time in self._snapshot_times:
            self._snapshots.append(self._snapshot(state, evaluation))

    @property
    def at_edge(self) -> bool:
        """Whether the latest state ends a record that a longer stage has too."""
        return bool(self.edges[len(self._records)] == self._mean.time)

    def series(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return the edges of the records so far, and an observable's means between them.

        Parameters
        ----------
        name
            Of a scalar observable of `Observer`.

        Raises
        ------
        KeyError
            When it is not recorded.
        """
        means = np.array([float(record[name]) for record in self._records])
        return self.edges[: means.size + 1], means

    def memory(self) -> Sample:
        """Return all that was recorded so far, as arrays by name, for `restore`."""
        tables: Sample = {}
        for name, rows in (("record", self._records), ("snapshot", self._snapshots)):
            columns = {key: np.array([row[key] for row in rows]) for key in (rows[:1] or [{}])[0]}
            tables |= under(name, columns | {"count": np.asarray(len(rows))})
        if self._profiles:
            tables["profiles"] = np.array([row["velocity_profile"] for row in self._profiles])
        return (
            tables | under("mean", self._mean.memory()) | under("profile", self._profile.memory())
        )

    def restore(self, memory: Sample) -> None:
        """Resume from what `memory` returned; snapshots and records come back bit for bit.

        Raises
        ------
        KeyError, ValueError
            When that is not the memory of this stage.
        """
        self._records = _rows(memory, "record", self.edges.size - 1)
        self._snapshots = _rows(memory, "snapshot", len(self._snapshot_times))
        profiles = memory.get("profiles", np.empty((0, self._observer.heights.size)))
        if profiles.ndim != 2 or profiles.shape[1] != self._observer.heights.size:
            raise ValueError(f"profiles has shape {profiles.shape}")
        self._profiles = [{"velocity_profile": profile} for profile in profiles]
        self._mean.restore(below(memory, "mean"))
        self._profile.restore(below(memory, "profile"))

    def _snapshot(self, state: State, evaluation: Evaluation) -> Sample:
        box = self._suspension.box
        field_x, field_y = (
            (np.arange(count) + 0.5) * (size / count)
            for size in (box.length, box.height)
            for count in [max(round(size / self._spacing), 1)]
        )
        points = np.stack(np.meshgrid(field_x, field_y), axis=-1)
        velocity = self._suspension.velocities_at(points.reshape(-1, 2), evaluation)
        return {
            "snapshot_time": np.asarray(state.time),
            "node_position": evaluation.positions,
            "velocity": velocity.reshape(points.shape),
            "field_x": field_x,
            "field_y": field_y,
        }

    def dataset(self) -> xr.Dataset:
        """Return everything recorded so far, with units and long names.

        The last record and profile are the means of what the end has left of their intervals.
        """
        records, edges = _with_rest(self._records, self.edges, self._mean)
        profiles, profile_edges = _with_rest(self._profiles, self._profile_edges, self._profile)
        ends = edges[1:]
        dataset = xr.Dataset(
            coords={
                "time": ("time", ends),
                "wall": ("wall", ["lower", "upper"]),
                "wall_distance": ("wall_distance", self._observer.heights),
                "profile_time": ("profile", profile_edges[1:]),
            }
        )
        dataset["interval"] = ("time", np.diff(edges))
        for name, value in (records[0] if records else {}).items():
            dims = ("time", "wall") if value.shape else ("time",)
            dataset[name] = (dims, np.array([record[name] for record in records]))
        velocities = np.array([profile["velocity_profile"] for profile in profiles])
        dataset["velocity_profile"] = (("profile", "wall_distance"), velocities)
        return described(self._with_snapshots(dataset))

    def _with_snapshots(self, dataset: xr.Dataset) -> xr.Dataset:
        if not self._snapshots:
            return dataset
        dims = {
            "snapshot_time": ("snapshot",),
            "node_position": ("snapshot", "node", "axis"),
            "velocity": ("snapshot", "field_y", "field_x", "axis"),
        }
        for name, axes in dims.items():
            dataset[name] = (axes, np.array([shot[name] for shot in self._snapshots]))
        for name in ("field_x", "field_y"):
            dataset = dataset.assign_coords({name: (name, self._snapshots[0][name])})
        return dataset.assign_coords(axis=("axis", ["x", "y"]))
