"""Members and long runs of a trade-off made up from a known law, in the real ones' schemas."""

import json

import numpy as np
import xarray as xr

from softslip.solver.mobility.grid import regularisation_length
from softslip.studies.tradeoff.long_runs import RATES

STRESSES, ROUGHNESSES = (0.05, 0.5), (0.0, 0.59)
RECORDS, SKIPPED, SHORT = 3, 1, 2
SLOPE, CURVATURE = 0.15, 0.02
"""Share by which rates fall per regularisation length, and what its square gives back."""

MESH = regularisation_length(1.0, "compact")
COSTS = {"evaluation_time": 1e-3, "evaluations": 100.0, "cost": 0.1}
MARKERS = 4


def level_rates():
    """Rates at no regularisation, (quantity, stress, roughness)."""
    rates = np.empty((3, 2, 2))
    rates[0] = [[1e-4, 1e-6], [6e-4, -1e-5]]
    rates[1] = [[1e-3, 1e-4], [2e-2, 1e-2]]
    rates[2] = [[1e-5, 1e-4], [1.3e-2, 1.1e-2]]
    return rates


def share(spread):
    """Rates at a regularisation length over those at none."""
    return 1 - SLOPE * spread + CURVATURE * spread**2


def parameters(spread, spacing, tolerance, *, resolution=8192, mobility="ewald"):
    return {
        "hydrodynamics": {
            "mobility": mobility,
            "resolution": resolution,
            "regularisation": spread,
            "node_spacing": spacing,
            "symbol": "compact",
        },
        "time_stepping": {"tolerance": tolerance},
        "channel": {"length": 0.0625, "height": 0.17},
        "steric": {"length": 9 / 8192},
    }


def member(
    name,
    kind,
    spread=0.2,
    *,
    spacing=5.0,
    tolerance=1e-2,
    error=0.0,
    cost=1.0,
    level="standard",
    effect="",
    short=False,
    stopped=None,
    tree=None,
    rates=None,
):
    """A member whose every rate is wrong by a share ``error`` of the law's value."""
    tree = tree or parameters(spread, spacing, tolerance)
    effective = MESH if spread is None else spread
    growth = 1 + 0.1 * np.arange(SKIPPED + RECORDS)
    base = level_rates() * share(effective) if rates is None else rates
    values = (1 + error) * base[..., None] * growth
    if short:
        values[..., SHORT:] = np.nan
    status = np.full((2, 2), "done", dtype=object)
    if stopped is not None:
        values[:, 1, 0] = np.nan
        status[1, 0] = stopped
    scene = ("stress", "roughness")
    both = np.ones((2, 2))
    markers = np.random.default_rng(np.random.SeedSequence(7)).random((4 * MARKERS, 2)) * 0.06
    own = {
        "hydrodynamics": {"regularisation": spread, "node_spacing": spacing},
        "time_stepping": {"tolerance": tolerance},
    }
    return xr.Dataset(
        {
            **{key: ((*scene, "time"), values[row]) for row, key in enumerate(RATES)},
            "film_thickness": ((*scene, "time"), 8e-4 * np.ones_like(values[0])),
            "cost": (scene, 0.1 * cost * both),
            "evaluations": (scene, 100.0 * both),
            "evaluation_time": (scene, 1e-3 * cost * both),
            "reference_cost": (scene, 0.1 * both),
            "reference_evaluations": (scene, 100.0 * both),
            "reference_evaluation_time": (scene, 1e-3 * both),
            "steps": (scene, 5.0 * both),
            "rejections": (scene, 0.0 * both),
            "area_deviation": (scene, 1e-6 * both),
            "velocity": (("marker_node", "axis"), (1 + error) * (markers - markers.mean(0))),
            "marker": (("marker_node", "axis"), markers),
            "marker_scene": ("marker_node", np.repeat(np.arange(4), MARKERS)),
            "status": (scene, status.astype(str)),
        },
        coords={
            "stress": list(STRESSES),
            "roughness": list(ROUGHNESSES),
            "time": 1.0 + np.arange(SKIPPED + RECORDS),
        },
        attrs={
            "member": name,
            "kind": kind,
            "effect": effect,
            "precision": "double",
            "level": level,
            "parameters": json.dumps(tree),
            "settings": json.dumps(own if kind in ("factorial", "finest") else {}),
            "skipped": SKIPPED,
            "short_window": SHORT,
        },
    )


def members():
    """The finest of four regularisation lengths, a grid on two spacings, levels and variants."""
    found = [
        member(f"finest-e{label}", "finest", spread, spacing=2.0, tolerance=1e-4, cost=9.0)
        for label, spread in (("0.1", 0.1), ("0.2", 0.2), ("0.4", 0.4), ("mesh", None))
    ]
    found.append(member("twin", "twin", 0.1, spacing=2.0, error=1e-6, cost=9.0))
    found.append(member("closer", "closer", 0.1, spacing=1.42, error=1e-3, cost=20.0))
    for label, spread in (("0.1", 0.1), ("0.2", 0.2), ("mesh", None)):
        for spacing, error, cost in ((4.0, 0.002, 2.0), (6.0, 0.01, 0.7)):
            found.append(
                member(
                    f"e{label}-n{spacing:g}-t0.01",
                    "factorial",
                    spread,
                    spacing=spacing,
                    error=error,
                    cost=cost * (1.2 if spread == 0.1 else 1.1 if spread else 1.0),
                )
            )
    found.append(member("level-standard", "level", None, error=0.005))
    found.append(member("single", "variant", None, error=0.006, effect="precision"))
    mesh = parameters(None, 1.42, 2e-3, resolution=4096, mobility="grid")
    found.append(
        member("mesh-4096", "variant", 2 * MESH, tree=mesh, short=True, cost=30.0, level="literal")
    )
    return found


def long_run(roughness=0.0, seed=1, *, periods=1, spreads=(0.1, 0.4, np.nan), offset=0.0):
    """A long run of steady rates with white noise of a tenth."""
    random = np.random.default_rng(np.random.SeedSequence([seed, periods, int(100 * roughness)]))
    count = 64
    effective = np.where(np.isnan(spreads), MESH, spreads)
    dims = ("regularisation", "stress")
    column = 0 if roughness == 0 else 1
    dataset = xr.Dataset(
        coords={
            "regularisation": list(spreads),
            "stress": list(STRESSES),
            "time": np.arange(1.0, count + 1),
        },
        attrs={"case": "made up", "roughness": roughness, "seed": seed, "periods": periods},
    )
    for row, name in enumerate(RATES):
        law = level_rates()[row, :, column] * (1 - SLOPE * effective[:, None]) * (1 + offset)
        noise = 0.1 * np.abs(law[..., None]) * random.standard_normal((*law.shape, count))
        dataset[name] = ((*dims, "time"), law[..., None] + noise)
        dataset[f"{name}_mean"] = (dims, law)
        dataset[f"{name}_error"] = (dims, 0.02 * np.abs(law))
    dataset["interval"] = ((*dims, "time"), np.ones((len(spreads), 2, count)))
    for flag in ("steady_wall", "steady_bulk", "steady_slip"):
        dataset[flag] = (dims, np.ones((len(spreads), 2), dtype=np.int8))
    dataset["cost"] = (dims, np.full((len(spreads), 2), 0.2))
    dataset["status"] = (dims, np.full((len(spreads), 2), "done"))
    return dataset


def long_runs():
    return [
        long_run(0.0, 1),
        long_run(0.0, 2, offset=0.1),
        long_run(0.59, 1),
        long_run(0.59, 2),
        long_run(0.0, 1, periods=2, spreads=(np.nan,)),
    ]
