"""What the datasets over all runs of a scenario must look like; `files.products` names them."""

from typing import Any

from softslip.config.fields import all_fields, extra
from softslip.config.parameters import Parameters
from softslip.config.sweep import label_of
from softslip.files.quantities import unit_of
from softslip.files.schema import Schema, Variable, of_quantity

DONE = ("status", "done")
"""Where a table holds a run."""

_SHARED = {
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


def _mean(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run; unknown ones must be `known_where` it says."""
    return of_quantity(name, unknown=True, swept=True, **others)


def _with_error(name: str, **others: Any) -> dict[str, Variable]:
    """Return a variable with one value a run, and its error."""
    return {**_mean(name, **others), **_mean(f"{name}_error", least=0.0)}


def _series(name: str, **others: Any) -> dict[str, Variable]:
    """Return a steady mean with its error and its drift, which is infinite about a mean of 0."""
    return {**_with_error(name, **others), **_mean(f"{name}_drift", infinite=True)}


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
        **_mean("steady_from", least=0.0, known_where=DONE),
        **_mean("drift", infinite=True),
        **_with_error("shear_stress", known_where=DONE),
        **_with_error("yielding_time", above=0.0),
        **_flag("yielded"),
        **_with_error("slip_time", above=0.0),
        **_with_error("heterogeneity", least=0.0),
        **_mean("snapshots_used", least=0.0, known_where=DONE),
    },
    sweep="status",
    shared=_SHARED,
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
    shared=_SHARED,
)
"""Series in time, from `analysis.observables.creep`."""

PROFILES = Schema(
    {
        **_RUNS,
        **_flag("steady_wall"),
        **of_quantity("normalised_position", "normalised_position", least=0.0, increasing=True),
        # Unknown where walls stand still, or no mesh line is at a wall.
        **of_quantity("normalised_velocity", "normalised_position", unknown=True, swept=True),
        **of_quantity(
            "normalised_velocity_error", "normalised_position", unknown=True, least=0.0, swept=True
        ),
    },
    sweep="status",
    shared=_SHARED,
)
"""Mean velocity profiles, from `analysis.observables.profiles`."""

FLOW_PARAMETERS = ("yield_stress", "consistency", "flow_index")
"""Parameters of the flow law, in the order of its covariance; none is below 0."""


def _fitted(name: str, message: str, prefix: str = "", **others: Any) -> dict[str, Variable]:
    """Return a fit's parameter and its error; known where the fit was made."""
    unit = unit_of(name)
    common: dict[str, Any] = {"unknown": True, "swept": True}
    return {
        f"{prefix}{name}": Variable((), unit, known_where=(message, "fitted"), **common, **others),
        # The covariance of points that do not fix a parameter is infinite.
        f"{prefix}{name}_error": Variable(
            (), unit, **common, **(others | {"least": 0.0, "infinite": True})
        ),
    }


def _quality(prefix: str, message: str, **others: Any) -> dict[str, Variable]:
    """Return what every fit says of itself."""
    common: dict[str, Any] = {"swept": True, **others}
    known = {"known_where": (message, "fitted"), **common}
    return {
        f"{prefix}reduced_chi_square": Variable((), "1", unknown=True, least=0.0, **known),
        f"{prefix}points": Variable((), "1", "count", least=0.0, **common),
        message: Variable((), "1", "word", **common),
    }


def _flow_law(prefix: str, **others: Any) -> dict[str, Variable]:
    """Return the variables of a fit of the flow law."""
    message = f"{prefix}fit_message"
    fitted = {"least": 0.0, **others}
    return {
        **_quality(prefix, message, **others),
        **_fitted("yield_stress", message, prefix, **fitted),
        **_fitted("consistency", message, prefix, **fitted),
        **_fitted("flow_index", message, prefix, **fitted),
        f"{prefix}covariance": Variable(
            ("parameter", "other_parameter"),
            unit_of("covariance"),
            unknown=True,
            infinite=True,
            swept=True,
            **others,
        ),
    }


def _slip_law(name: str) -> dict[str, Variable]:
    """Return the variables of a fit of slip velocity over stress."""
    message = f"{name}_message"
    return {**_quality(f"{name}_", message), **_fitted(name, message)}


FITS = Schema(
    {
        **_flow_law(""),
        **_flow_law("pooled_", pooled=("roughness",)),
        **_slip_law("slip_coefficient"),
        **_slip_law("newtonian_slip_coefficient"),
        "parameter": Variable(("parameter",), None, "word", words=FLOW_PARAMETERS),
        "other_parameter": Variable(("other_parameter",), None, "word", words=FLOW_PARAMETERS),
    },
    sweep="fit_message",
    shared=_SHARED,
)
"""Laws and their errors, from `analysis.fits`."""
