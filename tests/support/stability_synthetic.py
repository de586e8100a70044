"""Datasets of the stability studies, made up, as far as their figures look at them."""

import numpy as np
import xarray as xr


def cells():
    """Cells of two groups and both schemes, of every verdict."""
    rows = [
        ("step_euler", "0.1", "literal", "correct"),
        ("step_euler", "2", "literal", "stopped"),
        ("stress", "0.05", "standard", "correct"),
        ("stress", "1e+03, long", "standard", "wrong"),
        ("stress", "0.05", "literal", "correct"),
    ]
    names = ("group", "label", "scheme", "verdict")
    columns = zip(*rows, strict=True)
    return xr.Dataset(
        {
            name: ("cell", np.array(values, dtype=object), {"units": "1"})
            for name, values in zip(names, columns, strict=True)
        }
    )


def limits():
    """Limits of four settings and of three numbers of stages."""
    theory = np.array([1e-3, 2e-3, 5e-3, 1e-2])
    stages = np.array([2, 5, 12])
    time = {"units": "time unit"}
    return xr.Dataset(
        {
            "euler_theory": ("setting", theory, time),
            "euler_limit": ("setting", 0.99 * theory, time),
            "rkc2_theory": ("stages", 1e-3 * stages**2.0, time),
            "rkc2_limit": ("stages", 1.02e-3 * stages**2.0, time),
        },
        coords={
            "mobility": ("setting", ["grid", "grid", "ewald", "ewald"]),
            "roughness": ("setting", [0.0, 0.59, 0.0, 0.59]),
            "stages": stages,
        },
    )
