"""Made-up results of validations."""

import numpy as np
import xarray as xr


def dataset(case, axes, leading="speed", refused=(), **attrs):
    """Made-up results with an error of 1e-3 times the number of their place."""
    shape = tuple(len(values) for values in axes.values())
    number = 1.0 + np.arange(np.prod(shape)).reshape(shape)
    lost = np.isin(number, refused)
    names = [leading, f"bare_{leading}"]
    variables = {}
    for name in names:
        variables[f"{name}_result"] = (tuple(axes), np.where(lost, np.nan, 10 * number))
        variables[f"{name}_reference"] = (tuple(axes), np.where(lost, np.nan, 10.0))
        variables[f"{name}_error"] = (tuple(axes), np.where(lost, np.nan, 1e-3 * number))
        variables[f"{name}_tolerance"] = (tuple(axes), np.where(lost, np.nan, 5e-3))
    variables["passed"] = (tuple(axes), ~lost & (number <= 5))
    variables["refusal"] = (tuple(axes), np.where(lost, "said why", "").astype(object))
    return xr.Dataset(
        variables, coords=axes, attrs={"case": case, "leading": leading, "summary": "", **attrs}
    )
