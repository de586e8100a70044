"""What the datasets over all runs of a scenario must look like; `files.products` names them."""

from typing import Any

from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters
from softslip.config.sweep import label_of
from softslip.files.schema import Schema, Variable, of_quantity

DONE = ("status", "done")
"""Where a table holds a run."""

VERDICTS = ("", "steady", "steady within its error", "drifting", "too short")
"""Verdicts on a series; the empty one where a run lacks the series, or is missing."""

SHARED = {
    label_of(path): str(extra(all_fields(Parameters)[path], "unit"))
    for path in ("rheometer.stress", "wall.roughness", "channel.height")
}
"""Units of the parameters that a dataset names where all its runs share them, by their labels."""

_RUNS = {
    **of_quantity("status", kind="word", words=("done", "missing"), swept=True),
    **of_quantity("run_id", kind="word", swept=True),
}
"""Which runs there are."""


def _flag(name: str) -> dict[str, Variable]:
    """Return a variable that is true or false for each run."""
    return of_quantity(name, kind="flag", swept=True)


def _verdict(name: str) -> dict[str, Variable]:
    """Return a variable with the verdict on a series of each run; none where there is no series."""
    return of_quantity(name, kind="word", words=VERDICTS, swept=True)


def _mean(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run; unknown ones must be `known_where` it says."""
    return of_quantity(name, unknown=True, swept=True, **others)


def _with_error(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run, and its error."""
    return {**_mean(name, **others), **_mean(f"{name}_error", least=0.0)}


def _with_freedom(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run, its error, and the degrees of freedom of that."""
    return {**_with_error(name, **others), **_mean(f"{name}_freedom", least=0.0)}


def _series(name: str, **others: Any) -> dict[str, Variable]:
    """Return a steady mean with its error and its drift, which is infinite about a mean of 0."""
    return {
        **_with_freedom(name, **others),
        **_mean(f"{name}_drift", infinite=True),
        **_mean(f"{name}_drift_error", infinite=True, least=0.0),
    }


_OVER_ROUGHNESS: dict[str, Any] = {"swept": True, "pooled": ("roughness", "seed"), "least": 0.0}

_COLLAPSE = {
    **of_quantity("master_curve_spread", unknown=True, **_OVER_ROUGHNESS),
    **of_quantity("master_curve_expected_spread", unknown=True, **_OVER_ROUGHNESS),
    **of_quantity("master_curve_spread_ratio", unknown=True, **_OVER_ROUGHNESS),
    **of_quantity("master_curve_spread_chance", unknown=True, **_OVER_ROUGHNESS),
    **of_quantity("master_curves", kind="count", **_OVER_ROUGHNESS),
}
"""How well the bulk's rates in time collapse over roughnesses, unknown where there is one only."""

FLOW_CURVE = Schema(
    {
        **_RUNS,
        **_series("shear_rate_wall", known_where=DONE),
        **_series("shear_rate_bulk"),
        **_series("slip_velocity"),
        **_flag("steady_wall"),
        **_flag("steady_bulk"),
        **_flag("steady_slip"),
        **_flag("steady"),
        **_verdict("verdict_wall"),
        **_verdict("verdict_bulk"),
        **_verdict("verdict_slip"),
        **_mean("steady_from", least=0.0, known_where=DONE),
        **_mean("drift", infinite=True),
        **_with_freedom("shear_stress", known_where=DONE),
        **_with_error("yielding_time", above=0.0),
        # Infinite where the time is found with one smoothing only.
        **_mean("yielding_time_smoothing", least=0.0, infinite=True),
        **_flag("yielded"),
        **_with_error("slip_time", above=0.0),
        **_mean("slip_time_smoothing", least=0.0, infinite=True),
        **_with_freedom("heterogeneity", least=0.0),
        **_with_freedom("newtonian_slip_length"),
        # Its error is infinite where the bulk rate is within two errors of 0.
        **_with_freedom("total_slip_length"),
        **_mean("total_slip_length_error", least=0.0, infinite=True),
        **_mean("snapshots_used", least=0.0, known_where=DONE),
        **_COLLAPSE,
    },
    sweep="status",
    shared=SHARED,
)
"""One point a run, from `analysis.observables.flow_curve`."""

CREEP = Schema(
    {
        **_RUNS,
        **of_quantity("time", "time", above=0.0, increasing=True),
        # Unknown beyond the end of a run that is shorter than others.
        **of_quantity("shear_rate_wall", "time", unknown=True, swept=True),
        **of_quantity("shear_rate_bulk", "time", unknown=True, swept=True),
        **of_quantity("slip_velocity", "time", unknown=True, swept=True),
    },
    sweep="status",
    shared=SHARED,
)
"""Series in time, from `analysis.observables.creep`."""

PROFILES = Schema(
    {
        **_RUNS,
        **_series("shear_rate_wall", known_where=DONE),
        **_verdict("verdict_wall"),
        **_flag("steady_wall"),
        **of_quantity("normalised_position", "normalised_position", least=0.0, increasing=True),
        # Unknown where walls stand still, or no mesh line is at a wall.
        **of_quantity("normalised_velocity", "normalised_position", unknown=True, swept=True),
        **of_quantity(
            "normalised_velocity_error", "normalised_position", unknown=True, least=0.0, swept=True
        ),
    },
    sweep="status",
    shared=SHARED,
)
"""Mean velocity profiles, from `analysis.observables.profiles`."""

FROM_WALL, OF_PARTICLES = "distance_from_wall", "particle_distance"
"""Dimensions of profiles: of the flow, and of what particles are like."""


def _profile(name: str, dim: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with a value for each distance from the wall, and its error."""
    common: dict[str, Any] = {"unknown": True, "swept": True}
    return {
        **of_quantity(name, dim, **common, **others),
        **of_quantity(f"{name}_error", dim, least=0.0, **common),
    }


STRUCTURE = Schema(
    {
        **_RUNS,
        **of_quantity(FROM_WALL, FROM_WALL, above=0.0, increasing=True),
        **of_quantity("quantile", "quantile", above=0.0, increasing=True),
        **of_quantity(OF_PARTICLES, OF_PARTICLES, above=0.0, increasing=True),
        **_profile("deformation", OF_PARTICLES, least=0.0),
        **_profile("orientation", OF_PARTICLES),
        **_profile("fluidity", FROM_WALL),
        **_profile("particle_stress", FROM_WALL),
        **of_quantity("wall_film", "quantile", unknown=True, swept=True, least=0.0),
        **of_quantity("wall_film_error", "quantile", unknown=True, swept=True, least=0.0),
        **_with_error("first_layer_gap", least=0.0),
        **_with_error("correlation_length", least=0.0),
        **_with_error("cooperativity_length", above=0.0),
        **_mean("structure_snapshots", least=0.0, known_where=DONE),
        **_series("shear_rate_wall", known_where=DONE),
        **_series("shear_rate_bulk"),
        **_verdict("verdict_wall"),
        **_verdict("verdict_bulk"),
        **_flag("steady_wall"),
        **_flag("steady_bulk"),
    },
    sweep="status",
    shared=SHARED,
)
"""Structure between the walls, from `analysis.observables.structure`."""

COMPARED = {
    **dict.fromkeys(("yield_stress", "flow_index", "slip_exponent", "critical_roughness"), ()),
    **dict.fromkeys(("heterogeneity_exponent", "newtonian_slip_length"), ()),
    **dict.fromkeys(("joint_yield_stress", "joint_flow_index"), ()),
    **dict.fromkeys(("yielding_exponent", "yielding_time"), ()),
    "separation_effect": ("wall_separation",),
}
"""Numbers of the paper, and the dimensions that each is about."""


def _compared(name: str, pooled: tuple[str, ...]) -> dict[str, Variable]:
    """Return the variables of one number beside the paper's."""
    common: dict[str, Any] = {"swept": True, "pooled": pooled}
    return {
        **of_quantity(name, unknown=True, **common),
        **of_quantity(f"{name}_error", unknown=True, least=0.0, **common),
        **of_quantity(f"{name}_reported", **common),
        **of_quantity(f"{name}_reported_error", unknown=True, least=0.0, **common),
        **of_quantity(f"{name}_difference", unknown=True, **common),
        **of_quantity(f"{name}_remark", kind="word", **common),
    }


COMPARISON = Schema(
    {
        **of_quantity("runs_done", kind="count", least=0.0, swept=True),
        **{
            key: variable
            for name, pooled in COMPARED.items()
            for key, variable in _compared(name, pooled).items()
        },
    },
    sweep="runs_done",
    shared=SHARED,
)
"""Numbers beside the paper's, from `analysis.against_paper`."""
