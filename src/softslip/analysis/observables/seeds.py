"""Averages over independent samples of the same suspension, which are judged together."""

import numpy as np
import scipy
import xarray as xr

from softslip.analysis.observables.steady import FLAGS, MEAN_ENDINGS, NO_SERIES, VERDICT_NAMES
from softslip.analysis.observables.tables import DONE, MISSING
from softslip.analysis.observables.verdicts import (
    DRIFTING,
    LARGE_ERROR,
    SIGNIFICANCE,
    SMALL_DRIFT,
    STEADY,
    TOO_SHORT,
    WITHIN_ERROR,
)
from softslip.files.quantities import QUANTITIES

LEAST_SEEDS = 3
"""Fewest samples whose scatter is their error."""

LIKELY_DRIFT = 0.5
"""Share of samples that drift each by itself beyond which their condition drifts."""

SENSITIVITY = "_smoothing"
"""End of the name of what says how much a number depends on its smoothing at most."""

ENDINGS = (*MEAN_ENDINGS, SENSITIVITY)
"""Ends of the names of what belongs to a mean and is not averaged by itself."""


def mean_over_seeds(dataset: xr.Dataset) -> xr.Dataset:
    """Average a collected dataset over its dimension ``seed``; without one, return it as it is.

    Missing runs are left out. With three seeds or more the error is the standard error over them,
    with one degree of freedom less than seeds: an interval takes Student's quantile, 1.32 errors
    for 68 % and 4.3 for 95 % with three. With fewer it is that of the runs' own errors together,
    with the degrees of freedom of Welch and Satterthwaite, unless two differ significantly (5 %).

    Seeds are judged together (`verdict_over_seeds`): one of them that seems to drift by chance
    does not spoil the others.

    Returns
    -------
    xr.Dataset
        Means; ``<name>_error`` for every number, NaN where nothing is known of it, and
        ``<name>_freedom``; the drift of the mean of series, with its error; the most that a mean
        depends on smoothing; verdicts, and flags
        that are True where the verdict is steady; other flags, True where they are for every run
        done; ``status``, "done" where any run is; and, new, ``runs`` and ``runs_done``, the number
        of runs behind each cell. Other texts are dropped.
    """
    if "seed" not in dataset.dims:
        return dataset
    done = dataset["status"] == DONE
    result = xr.Dataset(attrs=dataset.attrs)
    for name, variable in dataset.data_vars.items():
        if "seed" not in variable.dims:
            result[name] = variable
        elif variable.dtype.kind == "b":
            result[name] = (variable | ~done).all("seed") & done.any("seed")
            result[name].attrs = variable.attrs
        elif str(name).endswith(SENSITIVITY):
            # No mean changes by more than the mean of the changes.
            result[name] = variable.mean("seed").assign_attrs(variable.attrs)
        elif variable.dtype.kind == "f" and not str(name).endswith(ENDINGS):
            result = result.assign(_averaged(dataset, str(name)))
    result = _with_verdicts(dataset, result)
    words = np.where(done.any("seed"), DONE, MISSING)
    status = done.any("seed").copy(data=words).assign_attrs(dataset["status"].attrs)
    runs = xr.full_like(done, 1, dtype=int).sum("seed")
    return result.assign(
        status=status,
        runs=runs.assign_attrs(QUANTITIES["runs"].attributes),
        runs_done=done.sum("seed").assign_attrs(QUANTITIES["runs_done"].attributes),
    )


def _averaged(dataset: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """Return a variable's mean over seeds with its error and freedom, and its mean drift."""
    values = dataset[name]
    mean, error, freedom = _seed_statistics(
        values, dataset.get(f"{name}_error"), dataset.get(f"{name}_freedom")
    )
    unit, words = values.attrs.get("units", "1"), values.attrs.get("long_name", name)
    found = {
        name: mean.assign_attrs(values.attrs),
        f"{name}_error": error.assign_attrs(units=unit, long_name=f"uncertainty of: {words}"),
    }
    words = f"degrees of freedom of the uncertainty of: {words}"
    found[f"{name}_freedom"] = freedom.assign_attrs(units="1", long_name=words)
    drift, drift_error = f"{name}_drift", f"{name}_drift_error"
    if drift in dataset:
        own = dataset.get(drift_error)
        found[drift], spread, _ = _seed_statistics(dataset[drift], own, None)
        found[drift].attrs = dataset[drift].attrs
        if own is not None:
            found[drift_error] = spread.assign_attrs(own.attrs)
    return found


def _seed_statistics(
    values: xr.DataArray, errors: xr.DataArray | None, freedoms: xr.DataArray | None
) -> tuple[xr.DataArray, xr.DataArray, xr.DataArray]:
    """Return the mean of a variable over seeds, its standard error and the freedom of that."""
    known = values.notnull() & (abs(values) < np.inf)
    count = known.sum("seed")
    some = count.where(count > 0)
    mean = values.where(known, 0.0).sum("seed") / some
    squares = ((values - mean) ** 2).where(known, 0.0).sum("seed")
    spread = (squares / (some * (some - 1).where(some > 1))) ** 0.5
    if errors is None:
        return mean, spread, (count - 1).where(count > 1)
    power = (errors.where(known) ** 2).fillna(0.0)
    total = power.sum("seed")
    own = (total**0.5 / some).where(errors.notnull().any("seed"))
    many = count >= LEAST_SEEDS
    with np.errstate(invalid="ignore"):
        # Two that lie apart by more than their errors say more than these errors do.
        many = many | (spread > scipy.stats.norm.isf(SIGNIFICANCE / 2) * own)
    if freedoms is None:
        own_freedom = xr.full_like(own, np.nan)
    else:
        shares = (power**2 / freedoms.where(freedoms > 0)).fillna(0.0).sum("seed")
        alone = freedoms.where(known).max("seed")
        own_freedom = (total**2 / shares.where(shares > 0)).fillna(alone)
    return mean, spread.where(many, own), ((count - 1) * 1.0).where(many, own_freedom)


def verdict_over_seeds(
    verdict: xr.DataArray, drift: xr.DataArray, drift_error: xr.DataArray
) -> xr.DataArray:
    """Return the verdict on samples of one condition, with `STEADY` for either steady one.

    They drift if more than half of them do each by itself, or if their mean drift is significant:
    a t-test at 5 % with the standard error over three or more samples. A single sample keeps its
    verdict, and one that is too short makes them all so, as it is in their mean.

    Parameters
    ----------
    verdict
        Of each sample, empty where it is missing; along ``seed``.
    drift, drift_error
        Mean drift over seeds and its standard error.
    """
    judged = verdict.isin((STEADY, WITHIN_ERROR, DRIFTING))
    count = judged.sum("seed")
    drifting = (verdict == DRIFTING).sum("seed")
    freedom = np.where(count >= LEAST_SEEDS, count - 1, np.inf)
    limit = xr.zeros_like(drift) + scipy.stats.t.isf(SIGNIFICANCE / 2, np.maximum(freedom, 1))
    with np.errstate(invalid="ignore"):
        trend = (abs(drift) > limit * drift_error) & (abs(drift) > SMALL_DRIFT)
    drifts = (drifting > LIKELY_DRIFT * count) | ((count > 1) & trend)
    drifts = drifts.transpose(*count.dims)
    short = (verdict == TOO_SHORT).any("seed").transpose(*count.dims)
    words = np.where(drifts, DRIFTING, np.where(count > 0, STEADY, NO_SERIES))
    return count.copy(data=np.where(short, TOO_SHORT, words).astype(object))


def _with_verdicts(dataset: xr.Dataset, result: xr.Dataset) -> xr.Dataset:
    """Return the averages with a verdict on each series, and with the flags that follow from it."""
    for name, flag in FLAGS.items():
        verdict = VERDICT_NAMES[name]
        if not {verdict, f"{name}_drift", f"{name}_drift_error"} <= set(dataset.data_vars):
            continue
        cell = verdict_over_seeds(
            dataset[verdict], result[f"{name}_drift"], result[f"{name}_drift_error"]
        )
        scale = abs(result[name])
        if name == "slip_velocity" and "wall_separation" in result.coords:
            scale = 0.5 * abs(result["shear_rate_wall"]) * result["wall_separation"]
        large = ~(result[f"{name}_error"] <= LARGE_ERROR * scale)
        cell = cell.where(~((cell == STEADY) & large), WITHIN_ERROR)
        result[verdict] = cell.assign_attrs(dataset[verdict].attrs)
        result[flag] = cell.isin((STEADY, WITHIN_ERROR)).assign_attrs(dataset[flag].attrs)
    if "steady" in dataset and "verdict_bulk" in result:
        bulk = result["steady_bulk"] | (result["verdict_bulk"] == NO_SERIES)
        result["steady"] = (result["steady_wall"] & bulk).assign_attrs(dataset["steady"].attrs)
    return result
