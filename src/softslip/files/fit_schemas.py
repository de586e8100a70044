"""What the dataset of fits to all runs of a scenario must look like; `files.products` names it."""

from dataclasses import replace
from typing import Any

from softslip.files.quantities import JOINT, POOLED, unit_of
from softslip.files.schema import Schema, Variable, of_quantity
from softslip.files.table_schemas import SHARED

FLOW_PARAMETERS = ("yield_stress", "consistency", "flow_index")
"""Parameters of the flow law, in the order of its covariance."""

INTERVAL = ("confidence", "end")
"""Dimensions of intervals: how likely they hold the true value, and their ends."""


def _fitted(name: str, message: str, prefix: str = "", **others: Any) -> dict[str, Variable]:
    """Return a fit's parameter, its error and its intervals; known where the fit was made."""
    unit = unit_of(name)
    common: dict[str, Any] = {"unknown": True, "swept": True}
    # What points do not determine has an infinite error, and intervals without ends.
    bare: dict[str, Any] = {**others, "infinite": True}
    return {
        f"{prefix}{name}": Variable((), unit, known_where=(message, "fitted"), **common, **others),
        f"{prefix}{name}_error": Variable((), unit, **common, **(bare | {"least": 0.0})),
        f"{prefix}{name}_interval": Variable(INTERVAL, unit, **common, **bare),
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
    positive = {"least": 0.0, **others}
    return {
        **_quality(prefix, message, **others),
        # Below 0 where it cannot be told from 0.
        **_fitted("yield_stress", message, prefix, **others),
        **_fitted("consistency", message, prefix, **positive),
        **_fitted("flow_index", message, prefix, **positive),
        f"{prefix}covariance": Variable(
            ("parameter", "other_parameter"),
            unit_of("covariance"),
            unknown=True,
            infinite=True,
            swept=True,
            **others,
        ),
    }


def _law(name: str, prefix: str = "", **others: Any) -> dict[str, Variable]:
    """Return the variables of a law with one parameter of interest."""
    message = f"{prefix}{name}_message"
    made = _fitted(name, message, prefix, **others)
    return {**_quality(f"{prefix}{name}_", message, **others), **made}


def _slip_law(name: str) -> dict[str, Variable]:
    """Return the variables of a law of slip above yield, with or without a film."""
    return {**_law(name), **of_quantity(f"{name}_film", kind="flag", swept=True)}


def _flow_and_slip() -> dict[str, Variable]:
    """Return the variables of the fit of flow and slip with one yield stress."""
    message, slip = f"{JOINT}fit_message", ("slip_coefficient", "newtonian_slip_coefficient")
    found = _flow_law(JOINT, **_POOLED)
    for name in slip:
        found |= _fitted(name, message, JOINT, **_POOLED)
    return found | of_quantity(f"{JOINT}agreement", unknown=True, swept=True, least=0.0, **_POOLED)


_POOLED: dict[str, Any] = {"pooled": ("roughness",)}

# It follows from the slip coefficients, so that no deviation is left.
_CRITICAL_ROUGHNESS = {
    name: variable
    for name, variable in _law("critical_roughness", **_POOLED).items()
    if not name.endswith("reduced_chi_square")
}

SIZES = {"separation": "wall_separation", "length": "channel_length"}
"""Dimensions of the channel's size, by what they are called in the names of trends."""

MOONEY = "mooney_slip_velocity"


def _trend(name: str, size: str) -> dict[str, Variable]:
    """Return the variables of the trend of a quantity with a size, of each stress by itself."""
    parameter = f"{name}_{size}_trend"
    found = _law(parameter, sweep=f"{parameter}_message", pooled=(SIZES[size],))
    # Two sizes determine it, and then nothing is left to tell whether it describes the points.
    quality = f"{parameter}_reduced_chi_square"
    return {**found, quality: replace(found[quality], known_where=None)}


def _finite_size() -> dict[str, Variable]:
    """Return the variables of what depends on the channel's size, of each stress by itself."""
    message = f"{MOONEY}_message"
    of_mooney: dict[str, Any] = {"sweep": message, "pooled": (SIZES["separation"],)}
    found = {
        **_law(MOONEY, **of_mooney),
        **_fitted("mooney_shear_rate_bulk", message, **of_mooney),
        **of_quantity(f"{MOONEY}_mismatch", unknown=True, swept=True, **of_mooney),
    }
    for size in SIZES:
        for name in ("shear_rate_bulk", "slip_velocity"):
            found |= _trend(name, size)
    return found


FITS = Schema(
    {
        **_flow_law(""),
        **_flow_law(POOLED, **_POOLED),
        **_flow_and_slip(),
        **_law("newtonian_slip_coefficient"),
        **_slip_law("slip_coefficient"),
        **_slip_law("slip_exponent"),
        **_slip_law("slip_yield_stress"),
        **of_quantity("slip_linear_evidence", unknown=True, infinite=True, swept=True),
        **_CRITICAL_ROUGHNESS,
        **of_quantity("critical_roughness_bracket", "end", unknown=True, swept=True, **_POOLED),
        **_law("heterogeneity_exponent"),
        **_law("heterogeneity_exponent", POOLED, **_POOLED),
        **_law("yielding_exponent"),
        **_law("yielding_exponent", POOLED, **_POOLED),
        **_law("slip_time_exponent"),
        **_finite_size(),
        "parameter": Variable(("parameter",), None, "word", words=FLOW_PARAMETERS),
        "other_parameter": Variable(("other_parameter",), None, "word", words=FLOW_PARAMETERS),
        **of_quantity("confidence", "confidence", increasing=True, above=0.0),
        "end": Variable(("end",), None, "word", words=("low", "high")),
    },
    sweep="fit_message",
    shared=SHARED,
)
"""Laws and their errors, from `analysis.fits`."""
