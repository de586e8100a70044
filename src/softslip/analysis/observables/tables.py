"""Many runs in one dataset: a dimension for each swept parameter, gaps where runs are missing."""

from collections.abc import Callable, Hashable, Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from softslip.analysis.observables.master_curves import collapse
from softslip.analysis.observables.series import (
    BULK_SERIES,
    FloatArray,
    interval_means,
    parameters_of,
    record_edges,
)
from softslip.analysis.observables.slip_lengths import slip_lengths
from softslip.analysis.observables.steady import FLAGS, steady_state, verdicts_of
from softslip.analysis.observables.timescales import slip_time, yielding_time
from softslip.analysis.observables.velocity_fields import heterogeneity, mean_profile
from softslip.config.parameters import Parameters
from softslip.errors import DatasetError
from softslip.files.quantities import QUANTITIES

COMMON = {
    "stress": ("rheometer", "stress"),
    "roughness": ("wall", "roughness"),
    "wall_separation": ("channel", "height"),
}
"""Dimensions that become a single coordinate where they are not swept, and their parameters."""

Runs = Iterable[tuple[Mapping[str, Any], xr.Dataset | None]]
"""The swept values of each run and its file's content, or None where it is missing."""

DONE, MISSING = "done", "missing"
"""Values of the variable ``status``."""


def collect(runs: Runs, function: Callable[[xr.Dataset], xr.Dataset]) -> xr.Dataset:
    """Reduce each run to a small dataset and lay them out on the grid of the swept values.

    Parameters
    ----------
    runs
        Pairs of the swept values (label → number or string) and the run, or None where it is
        missing. All runs carry the same labels.
    function
        Takes a run and returns a dataset whose variables have the same dimensions for all runs.

    Returns
    -------
    xr.Dataset
        The function's variables with one more dimension for each label, ahead of their own;
        numbers sorted by size, other values by their text. Where a run is missing, numbers are
        NaN, flags False and texts empty. The variable ``status`` says "done" or "missing", and
        ``run_id`` which run of the shear stage it is.

    Raises
    ------
    DatasetError
        When no run is done, labels differ or values repeat, or results differ in size.
    """
    pairs = [(dict(labels), run) for labels, run in runs]
    done = [
        (labels, function(run), str(run.attrs.get("run", "")))
        for labels, run in pairs
        if run is not None
    ]
    if not done:
        raise DatasetError(f"none of {len(pairs)} runs is done; run the shear stage first")
    axes = _axes([labels for labels, _ in pairs])
    shape = tuple(len(values) for values in axes.values())
    status = np.full(shape, MISSING, dtype="<U7")
    identity = np.full(shape, "", dtype=object)
    template = done[0][1]
    filled = {name: _empty(shape, variable) for name, variable in template.data_vars.items()}
    for labels, result, name in done:
        place = tuple(_place(values, labels[label]) for label, values in axes.items())
        if status[place] == DONE:
            raise DatasetError(f"two runs have the same swept values {labels}; give them once")
        status[place], identity[place] = DONE, name
        _put(filled, place, result, template)
    swept = {label: (label, values, _axis_attributes(label)) for label, values in axes.items()}
    table = xr.Dataset(
        {
            name: ((*axes, *template[name].dims), values, template[name].attrs)
            for name, values in filled.items()
        },
        coords={**template.coords, **swept},
    )
    table["status"] = tuple(axes), status, QUANTITIES["status"].attributes
    table["run_id"] = tuple(axes), identity, QUANTITIES["run_id"].attributes
    return _with_common_values(table, [run for _, run in pairs if run is not None])


def _plain(value: Any) -> Any:
    """Return a swept value as a number or a string."""
    if isinstance(value, np.generic):
        value = value.item()
    return value if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


def _axes(labels: list[dict[str, Any]]) -> dict[str, list[Any]]:
    names = list(labels[0])
    for other in labels:
        if set(other) != set(names):
            raise DatasetError(
                f"runs are labelled by {sorted(names)} and by {sorted(other)}; label all alike"
            )
    values = {name: {_plain(each[name]) for each in labels} for name in names}
    return {
        name: sorted(found) if _all_numbers(found) else sorted(map(str, found))
        for name, found in values.items()
    }


def _place(values: list[Any], value: Any) -> int:
    plain = _plain(value)
    return values.index(plain if plain in values else str(plain))


def _all_numbers(values: set[Any]) -> bool:
    return not any(isinstance(value, str) for value in values)


def _axis_attributes(label: str) -> dict[str, str]:
    """Return unit, meaning and symbol of the parameter that a dimension is named after."""
    for section in (Parameters, *(f.annotation for f in Parameters.model_fields.values())):
        for name, field in getattr(section, "model_fields", {}).items():
            extra = field.json_schema_extra
            if isinstance(extra, dict) and extra.get("label", name) == label:
                return {
                    "units": str(extra["unit"]),
                    "long_name": str(field.description).rstrip("."),
                    "symbol": str(extra["symbol"]),
                }
    return {"units": "1", "long_name": label.replace("_", " ")}


def _empty(shape: tuple[int, ...], variable: xr.DataArray) -> np.ndarray:
    full = (*shape, *variable.shape)
    if variable.dtype.kind == "b":
        return np.zeros(full, dtype=bool)
    if variable.dtype.kind in "fiu":
        return np.full(full, np.nan)
    return np.full(full, "", dtype=object)


def _put(
    filled: dict[Hashable, np.ndarray],
    place: tuple[int, ...],
    result: xr.Dataset,
    template: xr.Dataset,
) -> None:
    for name, values in filled.items():
        if result[name].shape != template[name].shape:
            raise DatasetError(
                f"{name} has the shape {result[name].shape} in one run and "
                f"{template[name].shape} in another; bring them to a common grid first"
            )
        found = result[name].values
        # Without dimensions: the text itself, not an array of it.
        values[place] = found if found.ndim else found.item()


def _with_common_values(table: xr.Dataset, runs: list[xr.Dataset]) -> xr.Dataset:
    """Name what all runs share, so that a figure can say it although it was not swept."""
    for label, (section, name) in COMMON.items():
        values = {getattr(getattr(parameters_of(run), section), name) for run in runs}
        value = values.pop()
        if label not in table.coords and not values and value is not None:
            table = table.assign_coords({label: ((), value, _axis_attributes(label))})
    return table


def _scalars(run: xr.Dataset) -> xr.Dataset:
    parts = (steady_state, yielding_time, slip_time, heterogeneity, slip_lengths)
    return xr.merge([part(run) for part in parts])


def flow_curve(runs: Runs) -> xr.Dataset:
    """Collect the steady-state averages, times and heterogeneity of runs (Figs. 5 to 8).

    See `collect` for the layout, and `steady_state`, `yielding_time`, `slip_time`,
    `heterogeneity` and `slip_lengths` for the variables of each run. `collapse` of `creep` adds
    what the runs of all roughnesses and seeds say together, without these dimensions.
    """
    pairs = list(runs)
    table = collect(pairs, _scalars)
    return table.assign(collapse(creep(pairs)).data_vars).assign_attrs(title="Flow curve")


def creep(runs: Runs, points_per_decade: int = 20) -> xr.Dataset:
    """Collect the time series of runs on a common grid in time (Fig. 8a-c).

    Each point is the mean over an interval; intervals grow by a constant factor and are nowhere
    shorter than the shortest record of any run.

    Parameters
    ----------
    runs
        As for `collect`.
    points_per_decade
        Intervals per decade of time.

    Returns
    -------
    xr.Dataset
        shear_rate_wall, shear_rate_bulk and slip_velocity along ``time``, the middle of each
        interval [time unit]; NaN beyond a run's end and for bulk series that a run lacks.
    """
    pairs = [(labels, run) for labels, run in runs]
    spans = [record_edges(run) for _, run in pairs if run is not None]
    if not spans:
        raise DatasetError(f"none of {len(pairs)} runs is done; run the shear stage first")
    shortest = min(float(np.diff(span).min()) for span in spans)
    edges = [min(float(span[1]) for span in spans)]
    last = max(float(span[-1]) for span in spans)
    growth = 10 ** (1 / points_per_decade)
    while edges[-1] < last * (1 - 1e-9):
        edges.append(min(max(edges[-1] * growth, edges[-1] + shortest), last))
    return collect(pairs, lambda run: _on_grid(run, np.array(edges))).assign_attrs(title="Creep")


def _on_grid(run: xr.Dataset, edges: FloatArray) -> xr.Dataset:
    nothing = np.full(len(edges) - 1, np.nan)
    attributes = QUANTITIES["time"].attributes | {"long_name": "middle of each interval"}
    return xr.Dataset(
        {
            name: (
                "time",
                nothing
                if name in BULK_SERIES and name not in run
                else interval_means(run, name, edges),
                QUANTITIES[name].attributes,
            )
            for name in FLAGS
        },
        coords={"time": ("time", 0.5 * (edges[1:] + edges[:-1]), attributes)},
    )


def profiles(runs: Runs) -> xr.Dataset:
    """Collect the steady normalised velocity profiles of runs (Fig. 4).

    Profiles are interpolated to the finest normalised mesh among the runs.

    Returns
    -------
    xr.Dataset
        ``normalised_velocity`` and its error along ``normalised_position``, and whether walls
        move steadily: the rate ``shear_rate_wall`` with its verdict, see `verdicts_of`.
    """
    pairs = [(labels, run) for labels, run in runs]
    counts = [run.sizes["wall_distance"] for _, run in pairs if run is not None]
    position = np.linspace(0.0, 1.0, max(counts, default=2))
    return collect(pairs, lambda run: _profile_at(run, position)).assign_attrs(title="Profiles")


def _profile_at(run: xr.Dataset, position: FloatArray) -> xr.Dataset:
    profile = mean_profile(run)
    known = profile["normalised_position"].values
    names = ("normalised_velocity", "normalised_velocity_error")
    lines = xr.Dataset(
        {
            name: (
                "normalised_position",
                np.interp(position, known.clip(0, 1), profile[name].values, np.nan, np.nan),
                profile[name].attrs,
            )
            for name in names
        },
        coords={
            "normalised_position": (
                "normalised_position",
                position,
                profile["normalised_position"].attrs,
            )
        },
    )
    return lines.merge(verdicts_of(steady_state(run), "shear_rate_wall"))
