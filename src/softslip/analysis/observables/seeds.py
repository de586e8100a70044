"""Averages over independent samples of the same suspension."""

import numpy as np
import xarray as xr

from softslip.analysis.observables.steady import FLAGS
from softslip.analysis.observables.tables import DONE, MISSING
from softslip.files.quantities import QUANTITIES


def mean_over_seeds(dataset: xr.Dataset) -> xr.Dataset:
    """Average a collected dataset over its dimension ``seed``; without one, return it as it is.

    Missing runs are left out. With two seeds or more, the error is the standard error over them
    or that of the runs' own errors, whichever is larger (two seeds may agree by chance); where
    a seed is not steady the own errors are drifts, which seeds share, and are averaged instead.
    With one seed it is the run's own.

    Returns
    -------
    xr.Dataset
        Means; ``<name>_error`` for every number, NaN where nothing is known of it; flags that are
        True where they are for every run done; ``status``, "done" where any run is; and, new,
        ``runs`` and ``runs_done``, the number of runs behind each cell. Texts are dropped.
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
        elif variable.dtype.kind == "f" and not str(name).endswith("_error"):
            mean, error = _seed_statistics(dataset, str(name))
            result[name] = mean.assign_attrs(variable.attrs)
            meaning = f"uncertainty of: {variable.attrs.get('long_name', name)}"
            unit = variable.attrs.get("units", "1")
            result[f"{name}_error"] = error.assign_attrs(units=unit, long_name=meaning)
    words = np.where(done.any("seed"), DONE, MISSING)
    status = done.any("seed").copy(data=words).assign_attrs(dataset["status"].attrs)
    runs = xr.full_like(done, 1, dtype=int).sum("seed")
    return result.assign(
        status=status,
        runs=runs.assign_attrs(QUANTITIES["runs"].attributes),
        runs_done=done.sum("seed").assign_attrs(QUANTITIES["runs_done"].attributes),
    )


def _seed_statistics(dataset: xr.Dataset, name: str) -> tuple[xr.DataArray, xr.DataArray]:
    """Return the mean of a variable over seeds and its standard error."""
    values = dataset[name]
    known = values.notnull()
    count = known.sum("seed")
    some = count.where(count > 0)
    mean = values.fillna(0.0).sum("seed") / some
    squares = ((values - mean) ** 2).fillna(0.0).sum("seed")
    spread = (squares / (some * (some - 1).where(some > 1))) ** 0.5
    if f"{name}_error" not in dataset:
        return mean, spread
    own = dataset[f"{name}_error"]
    together = (own**2).fillna(0.0).sum("seed") ** 0.5 / some
    flag = FLAGS.get(name)
    if flag is not None:
        steady = (dataset[flag] | ~known).all("seed")
        together = together.where(steady, own.fillna(0.0).sum("seed") / some)
    together = together.where(own.notnull().any("seed"))
    return mean, spread.where(~(spread < together) & spread.notnull(), together)
