"""Steady averages of the long runs: means over packings, their errors, and what decides them."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from softslip.solver.geometry import FloatArray
from softslip.solver.mobility.grid import regularisation_length
from softslip.studies.meanings import OF_QUANTITY, with_meanings
from softslip.studies.tradeoff.extrapolation import fitted
from softslip.studies.tradeoff.long_runs import RATES

FEWEST_BLOCKS, FEWEST_RECORDS = 2, 2
"""Blocks at least into which the last half of a run is cut, and records at least in a block."""

HALVINGS = 4
"""How often the last half of a run is halved, to see what a shorter run would give."""

MEANINGS = {
    "steady_mean": (OF_QUANTITY, "steady average over the packings"),
    "steady_error": (OF_QUANTITY, "its standard error"),
    "steady_runs": ("1", "number of packings whose run is steady"),
    "packings": ("1", "number of packings"),
    "steady_cost": ("s / time unit", "processor time per simulated time of the long runs"),
    "steady_limit": (OF_QUANTITY, "steady average extrapolated to no regularisation"),
    "steady_limit_error": (OF_QUANTITY, "standard error of the extrapolated steady average"),
    "steady_slope": (
        OF_QUANTITY,
        "change of the steady average per regularisation length over the mesh size",
    ),
    "steady_slope_error": (OF_QUANTITY, "standard error of that change"),
    "steady_chi_square": ("1", "squared residuals of the straight line per degree of freedom"),
    "seed_scatter": (OF_QUANTITY, "standard deviation between packings"),
    "run_error": (OF_QUANTITY, "rms error of an average over a shorter time"),
    "run_length": ("time unit", "time that a shorter run averages over"),
    "wide_mean": (OF_QUANTITY, "steady average in channels of twice the period"),
    "wide_error": (OF_QUANTITY, "its standard error"),
    "steady_regularisation": ("1", "regularisation length over the paper's mesh size"),
    "wide_regularisation": ("1", "regularisation length over the paper's mesh size"),
    "steady_stress": ("stress unit", "imposed stress"),
    "steady_roughness": ("1", "wall roughness"),
}
"""Unit and meaning of each variable."""


def gather_steady(cases: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the steady averages of all long runs of one design.

    Parameters
    ----------
    cases
        Of `studies.tradeoff.long_runs.measure_steady`.

    Returns
    -------
    xarray.Dataset
        Along ``quantity``, ``steady_stress``, ``steady_roughness``, ``steady_regularisation``:
        ``steady_mean`` over the packings with ``steady_error`` (the larger of what single runs
        say and of what packings differ by) and ``steady_runs``, how many were steady;
        ``steady_limit`` at ε = 0 with error, slope and χ²; ``seed_scatter``, the standard
        deviation between packings; ``run_error`` of shorter runs (``run_length``); and
        ``wide_mean`` with error of channels of twice the period.
    """
    narrow = [case for case in cases if case.attrs["periods"] == 1]
    wide = [case for case in cases if case.attrs["periods"] > 1]
    rows = {}
    for roughness in sorted({float(case.attrs["roughness"]) for case in narrow}):
        alike = [case for case in narrow if case.attrs["roughness"] == roughness]
        rows[roughness] = _over_seeds(alike)
    found = xr.concat(list(rows.values()), "steady_roughness").assign_coords(
        steady_roughness=list(rows)
    )
    found = _with_limits(found)
    if wide:
        means = _over_seeds(wide)
        for name in ("mean", "error"):
            found[f"wide_{name}"] = means[f"steady_{name}"].rename(
                steady_regularisation="wide_regularisation"
            )
    return with_meanings(found, MEANINGS)


def _values(case: xr.Dataset, suffix: str) -> FloatArray:
    """Return averages or errors, shape (quantity, regularisation, stress)."""
    return np.stack([_grid(case, f"{name}_{suffix}") for name in RATES])


def _grid(case: xr.Dataset, name: str) -> FloatArray:
    """Return a variable, NaN where every run stopped, shape (regularisation, stress)."""
    if name not in case:
        return np.full((case.sizes["regularisation"], case.sizes["stress"]), np.nan)
    return np.asarray(case[name].transpose("regularisation", "stress").values, dtype=np.float64)


def _over_seeds(cases: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return means, errors and scatters over the packings of equal walls."""
    means = np.stack([_values(case, "mean") for case in cases])
    errors = np.stack([_values(case, "error") for case in cases])
    count = len(cases)
    within = np.sqrt((errors**2).sum(axis=0)) / count
    apart = means.std(axis=0, ddof=1) if count > 1 else np.full(within.shape, np.nan)
    steady = sum(
        np.stack([_grid(case, f"steady_{flag}") for flag in ("slip", "wall", "bulk")])
        for case in cases
    )
    dims = ("quantity", "steady_regularisation", "steady_stress")
    scatter = np.sqrt(np.mean(apart**2, axis=1))
    lengths, run_errors = _run_errors(cases)
    costs = np.mean([_grid(case, "cost") for case in cases], axis=0)
    return xr.Dataset(
        {
            "steady_mean": (dims, means.mean(axis=0)),
            "steady_error": (dims, np.fmax(within, apart / np.sqrt(count))),
            "steady_runs": (dims, np.nan_to_num(steady)),
            "seed_scatter": (("quantity", "steady_stress"), scatter),
            "run_error": (("run_length", "quantity", "steady_stress"), run_errors),
            "steady_cost": (dims[1:], costs),
            "packings": ((), count),
        },
        coords={
            "quantity": list(RATES),
            "steady_regularisation": _effective_lengths(cases[0]["regularisation"].values),
            "steady_stress": cases[0]["stress"].values,
            "run_length": lengths,
        },
    )


def _effective_lengths(values: FloatArray) -> FloatArray:
    """Return regularisation lengths over the paper's mesh size, its mesh's own for NaN."""
    return np.where(np.isnan(values), regularisation_length(1.0, "compact"), values)


def _run_errors(cases: Sequence[xr.Dataset]) -> tuple[FloatArray, FloatArray]:
    """Return run lengths, and the rms deviation of averages over them from that over the last half.

    Lengths are the half, quarter ... of the last half; all packings and regularisation lengths
    count alike. Shape (lengths, quantity, stress).
    """
    duration = float(np.nanmax([case["time"].max() for case in cases]))
    lengths = np.array([0.5 * duration / 2**n for n in range(1, HALVINGS + 1)], dtype=np.float64)
    shape = (len(lengths), len(RATES), cases[0].sizes["stress"])
    found: FloatArray = np.full(shape, np.nan)
    for number, length in enumerate(lengths):
        for row, name in enumerate(RATES):
            for column in range(found.shape[2]):
                squares = [
                    value
                    for case in cases
                    if name in case
                    for value in _deviations(case, name, column, length)
                ]
                if squares:
                    found[number, row, column] = np.sqrt(np.mean(squares))
    return lengths, found


def _deviations(case: xr.Dataset, name: str, column: int, length: float) -> list[float]:
    """Return the squared deviations of the means over blocks of the last half of each run."""
    time = case["time"].values
    duration = float(time[-1])
    blocks = round(0.5 * duration / length)
    result: list[float] = []
    for row in range(case.sizes["regularisation"]):
        values = case[name].isel(regularisation=row, stress=column).values
        widths = case["interval"].isel(regularisation=row, stress=column).values
        late = time > 0.5 * duration * (1 + 1e-9)
        if not np.isfinite(values[late]).all() or late.sum() < FEWEST_RECORDS * blocks:
            continue
        cuts = np.array_split(np.arange(late.sum()), blocks)
        kept, weights = values[late], widths[late]
        means = np.array([float(np.average(kept[cut], weights=weights[cut])) for cut in cuts])
        if blocks >= FEWEST_BLOCKS:
            # The blocks share their mean, which takes away a degree of freedom.
            result.append(float(means.var(ddof=1)))
    return result


def _with_limits(found: xr.Dataset) -> xr.Dataset:
    """Add the straight lines to ε = 0."""
    names = {"value": "limit", "error": "limit_error"}
    names |= {name: name for name in ("slope", "slope_error", "chi_square")}
    shape = tuple(found.sizes[dim] for dim in ("quantity", "steady_stress", "steady_roughness"))
    table = {name: np.full(shape, np.nan) for name in names}
    lengths = found["steady_regularisation"].values
    order = ("quantity", "steady_stress", "steady_roughness", "steady_regularisation")
    means, errors = (found[f"steady_{name}"].transpose(*order).values for name in ("mean", "error"))
    for place in np.ndindex(shape):
        line = fitted(lengths, means[place], errors[place])
        for name in names:
            table[name][place] = getattr(line, name)
    return found.assign(
        {f"steady_{label}": (order[:3], table[name]) for name, label in names.items()}
    )
