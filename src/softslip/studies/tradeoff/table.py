"""The trade-off dataset: errors and costs of all members, limits, and steady averages."""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from softslip.config.fidelity import LEVELS
from softslip.files.conventions import FLAG_ATTRIBUTES
from softslip.files.quantities import QUANTITIES
from softslip.solver.films import REFERENCE_MESH_SIZE
from softslip.solver.geometry import BoolArray, FloatArray
from softslip.solver.mobility.grid import regularisation_length
from softslip.studies.boxes import merged
from softslip.studies.meanings import OF_QUANTITY, attributes, with_meanings
from softslip.studies.tradeoff.averages import gather_steady
from softslip.studies.tradeoff.comparison import SCENE, Comparison, root_mean_square
from softslip.studies.tradeoff.long_runs import RATES
from softslip.studies.tradeoff.member_dataset import DONE

JUDGED = ("factorial", "finest", "level")
"""Kinds of members among which no other may be better in both error and cost."""

VARIABLES: dict[str, tuple[str, str]] = {
    "error": ("1", "rms error against the limit of no regularisation, over records and scenes"),
    "regularisation_error": ("1", "that error of the finest member of the same regularisation"),
    "total_error": ("1", "largest error of slip velocity and shear rates, see gather"),
    "finest_error": ("1", "rms difference from the finest member"),
    "same_error": ("1", "rms difference from the finest member of the same regularisation length"),
    "numerical_error": ("1", "largest of those differences, from nodes, steps and scheme alone"),
    "level_error": ("1", "rms difference of a variant from the level that it varies"),
    "scene_error": ("1", "rms error against the limit of no regularisation in each scene"),
    "bias": ("1", "mean difference from the limit of no regularisation in each scene, signed"),
    "velocity_error": ("1", "rms error of the markers' velocities at the start, relative"),
    "position_error": (
        "1",
        "rms error of the markers' positions after the short window, over σ_LJ",
    ),
    "area_deviation": QUANTITIES["area_deviation"],
    "cost": ("s / time unit", "processor time per simulated time"),
    "cost_ratio": ("1", "cost over that of the level 'standard' in the same job"),
    "steps": ("1 / time unit", "steps per simulated time, mean of the scenes"),
    "evaluations": ("1 / time unit", "evaluations per simulated time, mean of the scenes"),
    "rejections": ("1", "trial steps that were repeated shorter, of all scenes"),
    "pareto": ("1", "whether no other member is both more accurate and cheaper"),
    "magnitude": (OF_QUANTITY, "rms value of the finest member in each scene"),
    "scale": (OF_QUANTITY, "what errors are relative to at each stress"),
    "limit": (OF_QUANTITY, "mean of the records at no regularisation"),
    "limit_uncertainty": (OF_QUANTITY, "uncertainty of that limit"),
    "limit_slope": (OF_QUANTITY, "its change per regularisation length over mesh size"),
    "limit_residual": (OF_QUANTITY, "rms distance of the members from a straight line"),
    "limit_error": ("1", "uncertainty of the limit, relative, rms over scenes"),
    "closer_error": ("1", "rms difference of the finest member from one on closer nodes"),
    "floor": ("1", "rms difference of the finest member from its twin, by divergence alone"),
    "mean": (OF_QUANTITY, "mean of the records that all members have"),
    "film_thickness": ("length unit", "mean of the smallest film in each scene"),
}
"""Units and meanings of the members' variables."""


def gather(members: Sequence[xr.Dataset], steady: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the trade-off dataset of one design.

    Errors are differences of records, squared and averaged over records and scenes, relative to
    the rms value at the same stress of the roughness where it is largest: of γ̇_wall for both
    shear rates, of V_s for itself, or a tenth of the walls' speed where V_s is less than that.
    Where nothing flows there is then nothing to be accurate in.

    The truth is the limit ε → 0 of the finest members, record by record. In one scene the errors of
    regularisation and of nodes and steps may cancel, which they need not in another. The total
    error is therefore the sum of both, each against its own truth, of the quantity where it is
    largest; of a scheme with a regularisation length of its own it is the error as it is.

    Costs are evaluations times the least time of one, over the same of the reference in the same
    job, times the median cost of the reference.

    Parameters
    ----------
    members
        Of `studies.tradeoff.member_dataset.measure_member`.
    steady
        Of `studies.tradeoff.long_runs.measure_steady`; may be empty.

    Raises
    ------
    DatasetError
        When the finest members are missing or stopped.
    """
    table = Comparison(members)
    found = xr.Dataset(
        {**_errors(table), **_limits(table), **_costs_and_front(table), **_of_members(table)},
        _coordinates(table),
        {
            "finest": table.names[table.finest],
            "records": table.records.shape[-1],
            "interval": float(np.diff(members[0]["time"].values[:2])[0]),
            "paper_regularisation": regularisation_length(1.0, "compact"),
        },
    )
    if steady:
        found = found.merge(gather_steady(steady), combine_attrs="override")
    with_meanings(found, VARIABLES)
    found["pareto"].attrs.update(FLAG_ATTRIBUTES)
    return found


Variables = dict[str, Any]
"""Variables by name, as `xarray.Dataset` takes them."""


def _errors(table: Comparison) -> Variables:
    """Return the differences of all members from the truths that there are."""
    error = table.against([table.limit.value] * len(table.members))
    same = table.against(table.same_truths())
    regularisation = table.regularisation_errors()
    apart = [table.differences(row, table.limit.value) for row in range(len(table.members))]
    from_finest = table.against([table.records[table.finest]] * len(table.members))
    own, by_scene = ("member", "quantity"), ("member", "quantity", *SCENE)
    return {
        "error": (own, error),
        "regularisation_error": (own, regularisation),
        "total_error": ("member", table.total_errors()),
        "finest_error": (own, from_finest),
        "same_error": (own, same),
        "numerical_error": ("member", same.max(axis=1)),
        "level_error": (own, table.against(table.level_truths())),
        "scene_error": (by_scene, np.stack([root_mean_square(each, 1) for each in apart])),
        "bias": (by_scene, np.stack([each.mean(axis=-1) for each in apart])),
        "mean": (by_scene, table.records[..., : table.common].mean(axis=-1)),
        "closer_error": ("quantity", table.beside("closer")),
        "floor": ("quantity", table.beside("twin")),
    }


def _limits(table: Comparison) -> Variables:
    """Return the limit of no regularisation, and what it and all errors are relative to."""
    limit, scene = table.limit_of_mean, ("quantity", *SCENE)
    doubt = root_mean_square(table.limit.uncertainty / table.scale[..., None, None], 3)
    return {
        "magnitude": (scene, table.magnitude),
        "scale": (("quantity", "stress"), table.scale),
        "limit": (scene, limit.value),
        "limit_uncertainty": (scene, limit.uncertainty),
        "limit_slope": (scene, limit.slope),
        "limit_residual": (scene, limit.residual),
        "limit_error": ("quantity", doubt),
    }


def _costs_and_front(table: Comparison) -> Variables:
    """Return costs over the reference's and in core-seconds, and who is beaten in both."""

    def evaluating(each: xr.Dataset, prefix: str) -> float:
        spent = each[f"{prefix}evaluations"] * each[f"{prefix}evaluation_time"]
        return float(spent.mean(skipna=False))

    ratio = np.array(
        [evaluating(each, "") / evaluating(each, "reference_") for each in table.members]
    )
    usual = np.median([float(each["reference_cost"].mean()) for each in table.members])
    judged = np.isin(table.kinds, JUDGED)
    return {
        "cost": ("member", ratio * float(usual)),
        "cost_ratio": ("member", ratio),
        "pareto": ("member", pareto(table.total_errors(), ratio, judged).astype(np.int8)),
    }


def pareto(error: FloatArray, cost: FloatArray, judged: BoolArray) -> BoolArray:
    """Return which judged members no other one beats in error or cost without losing the other.

    Parameters
    ----------
    error, cost
        Shape (members,); members that lack one are not judged.
    judged
        Which members take part, shape (members,).
    """
    judged = judged & np.isfinite(error) & np.isfinite(cost)
    better = (error[None] <= error[:, None]) & (cost[None] <= cost[:, None])
    strictly = (error[None] < error[:, None]) | (cost[None] < cost[:, None])
    beaten = (better & strictly & judged[None]).any(axis=1)
    return np.asarray(judged & ~beaten)


def _of_members(table: Comparison) -> Variables:
    """Return what is taken from each member by itself."""
    given = table.members
    short = slice(table.skipped, table.short)
    films = [
        each["film_thickness"].isel(time=short).mean("time", skipna=False).transpose(*SCENE).values
        for each in given
    ]

    def over(name: str, reduction: str) -> tuple[str, list[float]]:
        return "member", [float(getattr(each[name], reduction)()) for each in given]

    return {
        "film_thickness": (("member", *SCENE), films),
        "velocity_error": ("member", [table.marker_error(each, "velocity") for each in given]),
        "position_error": ("member", [table.marker_error(each, "marker") for each in given]),
        "area_deviation": over("area_deviation", "max"),
        "steps": over("steps", "mean"),
        "evaluations": over("evaluations", "mean"),
        "rejections": over("rejections", "sum"),
    }


def _coordinates(table: Comparison) -> dict[str, Any]:
    def numerics(key: str, value: str) -> list[float]:
        return [float(tree.get(key, {}).get(value, np.nan)) for tree in table.trees]

    def stated(key: str) -> list[str]:
        return [each.attrs[key] for each in table.members]

    cells = np.array(numerics("hydrodynamics", "resolution")) * REFERENCE_MESH_SIZE
    first = table.members[0]
    return {
        "member": ("member", table.names, _words("name of the numerical scheme")),
        "quantity": ("quantity", list(RATES), _words("observable")),
        **{name: first[name] for name in SCENE},
        "kind": ("member", table.kinds, _words("what it is there for")),
        "level": ("member", stated("level"), _words("level of fidelity that it varies")),
        "effect": ("member", stated("effect"), _words("what it shows the effect of")),
        "regularisation": (
            "member",
            table.regularisations,
            attributes("1", "regularisation length over the paper's mesh size"),
        ),
        "node_spacing": (
            "member",
            numerics("hydrodynamics", "node_spacing") / cells,
            attributes("1", "node spacing over the paper's mesh size"),
        ),
        "tolerance": (
            "member",
            numerics("time_stepping", "tolerance"),
            attributes("1", "error of a step over the contact range that is accepted"),
        ),
        "settings": (
            "member",
            [_settings(each) for each in table.members],
            _words("numerical settings as JSON"),
        ),
        "status": ("member", [_status(each) for each in table.members], _words("done, or why not")),
    }


def _words(meaning: str) -> dict[str, str]:
    return {"long_name": meaning}


def _settings(member: xr.Dataset) -> str:
    """Return a member's numerical settings, with those of its level, as JSON."""
    own, level = json.loads(member.attrs["settings"]), LEVELS.get(member.attrs["level"], {})
    return json.dumps(merged(level, own), sort_keys=True)


def _status(member: xr.Dataset) -> str:
    """Return 'done', or the first reason why a scene stopped."""
    reasons = [str(text) for text in member["status"].values.ravel() if text != DONE]
    return reasons[0] if reasons else DONE
